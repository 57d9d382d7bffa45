//! The eight bodies of combinatorial geometry, one a file.
//!
//! Every body is convex, closed and finite: a line meets it in one [`Span`]. A body knows its intersection, its outward
//! normals, its bounds and its inside test. [`PRIMITIVES`] lists them; to add one, write its file, a variant of [`Solid`] and its row.
//!
//! # Reference
//! Guber et al. 1967, A geometric description technique (MAGIC), and Emmett 1975, ORNL-4972 (MORSE): bodies and parameter order.

mod box_body;
mod ell;
mod fault;
mod frame;
mod rcc;
mod rec;
mod rpp;
mod sph;
mod trc;
mod wed;

#[cfg(test)]
mod law_tests;

pub use box_body::BoxBody;
pub use ell::Ell;
pub use fault::PrimitiveFault;
pub use rcc::Rcc;
pub use rec::Rec;
pub use rpp::Rpp;
pub use sph::Sph;
pub use trc::Trc;
pub use wed::Wed;

use crate::geometry::{Bounds, Ray, Similarity, Span};
use crate::vector::Vec3;

/// What a group of parameters is, so that a body can be moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Three coordinates of a point.
    Point,
    /// Three components of a vector.
    Vector,
    /// One length.
    Length,
    /// Lower and upper limit on each axis; turned, it becomes a BOX.
    Extents,
}

impl Group {
    const fn len(self) -> usize {
        match self {
            Self::Point | Self::Vector => 3,
            Self::Length => 1,
            Self::Extents => 6,
        }
    }
}

/// One row of the table of bodies.
#[derive(Debug)]
pub struct PrimitiveEntry {
    /// Code of three letters.
    pub code: &'static str,
    /// Other codes it answers to.
    pub aliases: &'static [&'static str],
    /// Its parameters in order, for messages and the book.
    pub parameters: &'static str,
    /// What the parameters are.
    pub layout: &'static [Group],
    /// Names of its faces; the first has number 1.
    pub faces: &'static [&'static str],
    /// One line about it.
    pub describes: &'static str,
    build: fn(&[f64]) -> Result<Solid, PrimitiveFault>,
}

/// Every body.
pub static PRIMITIVES: &[PrimitiveEntry] =
    &[rpp::ENTRY, box_body::ENTRY, sph::ENTRY, rcc::ENTRY, rec::ENTRY, trc::ENTRY, ell::ENTRY, wed::ENTRY];

impl PrimitiveEntry {
    /// The row of a code, in capitals or not.
    #[must_use]
    pub fn by_code(code: &str) -> Option<&'static Self> {
        PRIMITIVES.iter().find(|p| p.code.eq_ignore_ascii_case(code) || p.aliases.iter().any(|a| a.eq_ignore_ascii_case(code)))
    }

    /// How many parameters it takes.
    #[must_use]
    pub fn count(&self) -> usize {
        self.layout.iter().map(|g| g.len()).sum()
    }
}

/// The shape of a body, ready for rays.
#[derive(Debug, Clone, PartialEq)]
pub enum Solid {
    /// Box along the axes.
    Rpp(Rpp),
    /// Box of any attitude.
    Box(BoxBody),
    /// Sphere.
    Sph(Sph),
    /// Circular cylinder.
    Rcc(Rcc),
    /// Elliptic cylinder.
    Rec(Rec),
    /// Truncated cone.
    Trc(Trc),
    /// Ellipsoid of revolution.
    Ell(Ell),
    /// Wedge.
    Wed(Wed),
}

macro_rules! each {
    ($self:expr, $s:ident => $do:expr) => {
        match $self {
            Solid::Rpp($s) => $do,
            Solid::Box($s) => $do,
            Solid::Sph($s) => $do,
            Solid::Rcc($s) => $do,
            Solid::Rec($s) => $do,
            Solid::Trc($s) => $do,
            Solid::Ell($s) => $do,
            Solid::Wed($s) => $do,
        }
    };
}

impl Solid {
    /// The part of a line inside the body; distances may be negative.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        each!(self, s => s.intersect(ray))
    }

    /// Outward unit normal of a face at a point on it.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        each!(self, s => s.normal(face, point))
    }

    /// The smallest box along the axes, or one a little larger.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        each!(self, s => s.bounds())
    }

    /// Whether a point lies inside or on the body.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        each!(self, s => s.contains(point))
    }
}

/// Largest number a body may have, m; squares and products of such numbers are still finite.
const FARTHEST_M: f64 = 1e12;

/// A body: its code, its parameters and its shape.
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
        let entry = PrimitiveEntry::by_code(code).ok_or_else(|| PrimitiveFault::UnknownCode {
            code: code.to_owned(),
            known: PRIMITIVES.iter().map(|p| p.code).collect::<Vec<_>>().join(", "),
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
        Ok(Self { entry, parameters: parameters.to_vec(), solid: (entry.build)(parameters)? })
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
