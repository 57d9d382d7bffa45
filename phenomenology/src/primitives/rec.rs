//! REC: right elliptic cylinder.

use super::fault::PrimitiveFault;
use super::frame::{length, perpendicular};
use super::{Group, PrimitiveEntry, Solid};
use crate::geometry::{Bounds, Ray, Span};
use crate::vector::Vec3;

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "REC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz Ax Ay Az Bx By Bz",
    layout: &[Group::Point, Group::Vector, Group::Vector, Group::Vector],
    faces: &["side", "base at V", "top at V+H"],
    describes: "elliptic cylinder by base centre, axis vector and two semi-axes",
    build: |p| Rec::new(p).map(Solid::Rec),
};

/// An elliptic cylinder. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rec {
    base: Vec3,
    axis: Vec3,
    height: f64,
    semi: [Vec3; 2],
    dual: [Vec3; 2],
}

impl Rec {
    fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let [h, a, b] = [3, 6, 9].map(|at| Vec3::from_slice(&p[at..at + 3]));
        let height = length("REC", "H", h)?;
        let (la, lb) = (length("REC", "A", a)?, length("REC", "B", b)?);
        perpendicular("REC", ("H", h), ("A", a))?;
        perpendicular("REC", ("H", h), ("B", b))?;
        perpendicular("REC", ("A", a), ("B", b))?;
        Ok(Self {
            base: Vec3::from_slice(p),
            axis: h * (1.0 / height),
            height,
            semi: [a, b],
            dual: [a * (1.0 / (la * la)), b * (1.0 / (lb * lb))],
        })
    }

    /// Coordinates of a vector in units of the semi-axes.
    #[inline]
    fn scaled(&self, v: Vec3) -> (f64, f64) {
        (v.dot(self.dual[0]), v.dot(self.dual[1]))
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let o = ray.origin - self.base;
        let ((x, y), (dx, dy)) = (self.scaled(o), self.scaled(ray.direction));
        let a = dx * dx + dy * dy;
        let mut span = Span::ALL;
        if a > 1e-30 {
            let near = -(x * dx + y * dy) / a;
            let (px, py) = (x + dx * near, y + dy * near);
            let rest = 1.0 - px * px - py * py;
            if rest <= 0.0 {
                return None;
            }
            let half = (rest / a).sqrt();
            span.clip(near - half, 1, near + half, 1);
        } else if x * x + y * y > 1.0 {
            return None;
        }
        span.slab(o.dot(self.axis), ray.direction.dot(self.axis), 0.0, self.height, (2, 3)).then_some(span)
    }

    /// Outward normal of a face at a point.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        match face {
            2 => -self.axis,
            3 => self.axis,
            _ => {
                let (x, y) = self.scaled(point - self.base);
                (self.dual[0] * x + self.dual[1] * y).unit()
            }
        }
    }

    /// Box around the ellipses of its ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [a, b] = self.semi;
        let half = Vec3::new(a.x.hypot(b.x), a.y.hypot(b.y), a.z.hypot(b.z));
        Bounds::around(self.base, half).union(Bounds::around(self.base + self.axis * self.height, half))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let o = point - self.base;
        let (x, y) = self.scaled(o);
        (0.0..=self.height).contains(&o.dot(self.axis)) && x * x + y * y <= 1.0
    }
}
