//! RPP: rectangular parallelepiped along the axes.

use super::entry::{Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "RPP",
    aliases: &[],
    parameters: "xmin xmax ymin ymax zmin zmax",
    layout: &[Group::Extents],
    faces: &["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"],
    describes: "box along the axes",
};

/// A box along the axes. Faces 1 to 6: xmin, xmax, ymin, ymax, zmin, zmax.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rpp {
    limits: Bounds,
}

impl Rpp {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        for (axis, pair) in ['x', 'y', 'z'].into_iter().zip(p.chunks_exact(2)) {
            if !(pair[0] < pair[1]) {
                return Err(PrimitiveFault::Inverted { axis, min: pair[0], max: pair[1] });
            }
        }
        Ok(Self { limits: Bounds { min: Vec3::new(p[0], p[2], p[4]), max: Vec3::new(p[1], p[3], p[5]) } })
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let (b, o, d, i) = (&self.limits, ray.origin, ray.direction, ray.inverse);
        let mut span = Span::ALL;
        for axis in 0..3 {
            if d[axis] == 0.0 {
                if o[axis] < b.min[axis] || o[axis] > b.max[axis] {
                    return None;
                }
                continue;
            }
            let (lo, hi) = ((b.min[axis] - o[axis]) * i[axis], (b.max[axis] - o[axis]) * i[axis]);
            let face = 2 * axis as u8 + 1;
            let open = if d[axis] > 0.0 { span.clip(lo, face, hi, face + 1) } else { span.clip(hi, face + 1, lo, face) };
            if !open {
                return None;
            }
        }
        Some(span)
    }

    /// Outward normal of a face.
    #[must_use]
    pub fn normal(&self, face: u8, _point: Vec3) -> Vec3 {
        let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
        match face {
            1 | 2 => Vec3::new(sign, 0.0, 0.0),
            3 | 4 => Vec3::new(0.0, sign, 0.0),
            _ => Vec3::new(0.0, 0.0, sign),
        }
    }

    /// The body is its own bounding box.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.limits
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.limits.contains(point)
    }
}
