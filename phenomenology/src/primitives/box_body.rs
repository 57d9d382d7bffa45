//! BOX: a box of any orientation.

use super::entry::{Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use super::frame::Frame;
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "BOX",
    aliases: &[],
    parameters: "Vx Vy Vz H1x H1y H1z H2x H2y H2z H3x H3y H3z",
    layout: &[Group::Point, Group::Vector, Group::Vector, Group::Vector],
    faces: &["at V across H1", "at V+H1", "at V across H2", "at V+H2", "at V across H3", "at V+H3"],
    describes: "box by a corner and three perpendicular edges",
};

/// A box by a corner and three perpendicular edges. Faces 1 to 6: the two ends of H1, of H2, of H3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxBody {
    frame: Frame,
}

impl BoxBody {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        Ok(Self { frame: Frame::new("BOX", p)? })
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let o = ray.origin - self.frame.corner;
        let mut span = Span::ALL;
        for (axis, dual) in self.frame.dual.iter().enumerate() {
            let face = 2 * axis as u8 + 1;
            if !span.slab(o.dot(*dual), ray.direction.dot(*dual), 0.0, 1.0, (face, face + 1)) {
                return None;
            }
        }
        Some(span)
    }

    /// Outward normal of a face.
    #[must_use]
    pub fn normal(&self, face: u8, _point: Vec3) -> Vec3 {
        let n = self.frame.normal[usize::from((face - 1) / 2)];
        if face.is_multiple_of(2) { n } else { -n }
    }

    /// Box around its corners.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [a, b, c] = self.frame.edges;
        Bounds::of_points((0..8).map(|k| {
            let on = |bit: u32, v: Vec3| if k >> bit & 1 == 1 { v } else { Vec3::ZERO };
            self.frame.corner + on(0, a) + on(1, b) + on(2, c)
        }))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.frame.coordinates(point).iter().all(|u| (0.0..=1.0).contains(u))
    }
}
