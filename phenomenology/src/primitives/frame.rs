//! Bodies with a corner or base and perpendicular edges or axes.

use super::fault::PrimitiveFault;
use crate::space::Vec3;

/// Largest cosine of the angle between two vectors that count as perpendicular. Edges written with five digits fulfil it.
const SQUARENESS: f64 = 1e-4;

/// Length of a vector, which must be above zero.
pub(super) fn length(code: &'static str, what: &'static str, v: Vec3) -> Result<f64, PrimitiveFault> {
    let length = v.norm();
    if length > 0.0 && length.is_finite() { Ok(length) } else { Err(PrimitiveFault::Singular { code, what, length }) }
}

/// Checks that two vectors are perpendicular.
pub(super) fn perpendicular(
    code: &'static str,
    (first, a): (&'static str, Vec3),
    (second, b): (&'static str, Vec3),
) -> Result<(), PrimitiveFault> {
    let cos = a.unit().dot(b.unit());
    if cos.abs() <= SQUARENESS {
        Ok(())
    } else {
        Err(PrimitiveFault::NotPerpendicular { code, first, second, degrees: cos.clamp(-1.0, 1.0).acos().to_degrees() })
    }
}

/// A corner and the dual vectors of three edges: `u = (x - corner) . dual` runs from 0 to 1 along each edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub corner: Vec3,
    pub edges: [Vec3; 3],
    pub dual: [Vec3; 3],
    /// Outward unit normals of the faces at `u = 1`.
    pub normal: [Vec3; 3],
}

impl Frame {
    /// From the corner and three edges. The edges must be perpendicular.
    pub(super) fn new(code: &'static str, p: &[f64]) -> Result<Self, PrimitiveFault> {
        const NAMES: [&str; 3] = ["H1", "H2", "H3"];
        let edges = [3, 6, 9].map(|at| Vec3::from_slice(&p[at..at + 3]));
        let mut lengths = [0.0; 3];
        for i in 0..3 {
            lengths[i] = length(code, NAMES[i], edges[i])?;
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            perpendicular(code, (NAMES[i], edges[i]), (NAMES[j], edges[j]))?;
        }
        Ok(Self {
            corner: Vec3::from_slice(p),
            edges,
            dual: std::array::from_fn(|i| edges[i] * (1.0 / (lengths[i] * lengths[i]))),
            normal: std::array::from_fn(|i| edges[i] * (1.0 / lengths[i])),
        })
    }

    /// The coordinates of a point along the edges.
    #[inline]
    pub(super) fn coordinates(&self, point: Vec3) -> [f64; 3] {
        let d = point - self.corner;
        self.dual.map(|dual| d.dot(dual))
    }
}
