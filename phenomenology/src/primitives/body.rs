//! A body made from a code and parameters.

use super::entry::{Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use super::solid::{PRIMITIVES, Primitive, Solid};
use crate::space::{Similarity, Vec3};

/// Largest size of a parameter, m. Squares and products of such numbers are still finite.
const FARTHEST_M: f64 = 1e12;

/// A body: its row of the table, its parameters and its shape.
#[derive(Debug, Clone)]
pub struct Body {
    /// Row of the table.
    pub entry: &'static PrimitiveEntry,
    /// Parameters in the order of the row, m.
    pub parameters: Vec<f64>,
    /// The shape.
    pub solid: Solid,
}

impl PartialEq for Body {
    fn eq(&self, other: &Self) -> bool {
        self.entry.code == other.entry.code && self.parameters == other.parameters
    }
}

impl Body {
    /// A body from its code and parameters.
    ///
    /// # Errors
    /// [`PrimitiveFault`]: unknown code, wrong number of parameters, one that is not finite, or a shape without volume.
    pub fn new(code: &str, parameters: &[f64]) -> Result<Self, PrimitiveFault> {
        let Primitive { entry, build } = Primitive::by_code(code).ok_or_else(|| PrimitiveFault::UnknownCode {
            code: code.to_owned(),
            known: PRIMITIVES.iter().map(|p| p.entry.code).collect::<Vec<_>>().join(", "),
        })?;
        if parameters.len() != entry.count() {
            return Err(PrimitiveFault::Count {
                code: entry.code,
                expected: entry.count(),
                found: parameters.len(),
                parameters: entry.parameters,
            });
        }
        if let Some(at) = parameters.iter().position(|p| !(p.abs() <= FARTHEST_M)) {
            return Err(PrimitiveFault::NotFinite { code: entry.code, number: at + 1, value: parameters[at] });
        }
        Ok(Self { entry, parameters: parameters.to_vec(), solid: build(parameters)? })
    }

    /// The body turned, scaled and moved. Faces keep their numbers.
    ///
    /// # Errors
    /// Never for a valid body and a scale above zero, short of overflow.
    pub fn transformed(&self, by: &Similarity) -> Result<Self, PrimitiveFault> {
        let mut parameters = Vec::with_capacity(12);
        let mut at = 0;
        for group in self.entry.layout {
            let given = &self.parameters[at..at + group.len()];
            match group {
                Group::Point => parameters.extend(by.point(Vec3::from_slice(given)).to_array()),
                Group::Vector => parameters.extend(by.vector(Vec3::from_slice(given)).to_array()),
                Group::Length => parameters.push(given[0] * by.scale()),
                Group::Extents => {
                    let low = Vec3::new(given[0], given[2], given[4]);
                    if by.is_turned() {
                        let edges = [
                            Vec3::new(given[1] - given[0], 0.0, 0.0),
                            Vec3::new(0.0, given[3] - given[2], 0.0),
                            Vec3::new(0.0, 0.0, given[5] - given[4]),
                        ];
                        parameters.extend(by.point(low).to_array());
                        parameters.extend(edges.iter().flat_map(|e| by.vector(*e).to_array()));
                        return Self::new("BOX", &parameters);
                    }
                    let (a, b) = (by.point(low), by.point(Vec3::new(given[1], given[3], given[5])));
                    parameters.extend([a.x, b.x, a.y, b.y, a.z, b.z]);
                }
            }
            at += group.len();
        }
        Self::new(self.entry.code, &parameters)
    }
}
