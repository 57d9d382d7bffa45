//! WED: half of a box, a right triangle swept along an edge.

use super::entry::{Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use super::frame::Frame;
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "WED",
    aliases: &["RAW"],
    parameters: "Vx Vy Vz H1x H1y H1z H2x H2y H2z H3x H3y H3z",
    layout: &[Group::Point, Group::Vector, Group::Vector, Group::Vector],
    faces: &["at V across H1", "at V across H2", "slope", "at V across H3", "at V+H3"],
    describes: "right triangle V, V+H1, V+H2 swept along H3",
};

/// A wedge. Faces: 1 the leg across H1, 2 the leg across H2, 3 the slope, 4 and 5 the ends of H3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wed {
    frame: Frame,
    slope: Vec3,
}

impl Wed {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let frame = Frame::new("WED", p)?;
        Ok(Self { frame, slope: (frame.dual[0] + frame.dual[1]).unit() })
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let o = self.frame.coordinates(ray.origin);
        let d = self.frame.dual.map(|dual| ray.direction.dot(dual));
        let mut span = Span::ALL;
        let inside = span.below(-o[0], -d[0], 0.0, 1)
            && span.below(-o[1], -d[1], 0.0, 2)
            && span.below(o[0] + o[1], d[0] + d[1], 1.0, 3)
            && span.slab(o[2], d[2], 0.0, 1.0, (4, 5));
        inside.then_some(span)
    }

    /// Outward normal of a face.
    #[must_use]
    pub fn normal(&self, face: u8, _point: Vec3) -> Vec3 {
        match face {
            1 => -self.frame.normal[0],
            2 => -self.frame.normal[1],
            3 => self.slope,
            4 => -self.frame.normal[2],
            _ => self.frame.normal[2],
        }
    }

    /// Box around its corners.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [a, b, c] = self.frame.edges;
        let v = self.frame.corner;
        Bounds::of_points([v, v + a, v + b, v + c, v + a + c, v + b + c])
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let [u, v, w] = self.frame.coordinates(point);
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&w)
    }
}
