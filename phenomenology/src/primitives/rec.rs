//! REC: right elliptic cylinder.

use super::axis::Axis;
use super::entry::{AXIAL_FACES, Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use super::frame::{length, perpendicular};
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "REC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz Ax Ay Az Bx By Bz",
    layout: &[Group::Point, Group::Vector, Group::Vector, Group::Vector],
    faces: AXIAL_FACES,
    describes: "elliptic cylinder by base centre, axis vector and two semi-axes",
};

/// An elliptic cylinder. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rec {
    axis: Axis,
    semi: [Vec3; 2],
    /// The semi-axes divided by the squares of their lengths.
    dual: [Vec3; 2],
}

impl Rec {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let axis = Axis::new("REC", p)?;
        let [h, a, b] = [3, 6, 9].map(|at| Vec3::from_slice(&p[at..at + 3]));
        let (la, lb) = (length("REC", "A", a)?, length("REC", "B", b)?);
        perpendicular("REC", ("H", h), ("A", a))?;
        perpendicular("REC", ("H", h), ("B", b))?;
        perpendicular("REC", ("A", a), ("B", b))?;
        Ok(Self { axis, semi: [a, b], dual: [a * (1.0 / (la * la)), b * (1.0 / (lb * lb))] })
    }

    /// Coordinates of a vector along the semi-axes, in units of their lengths. The third is zero.
    #[inline]
    fn scaled(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.dual[0]), v.dot(self.dual[1]), 0.0)
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        self.axis.cylinder(ray, self.scaled(ray.origin - self.axis.base), self.scaled(ray.direction), 1.0)
    }

    /// Outward normal of a face at a point.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        self.axis.normal(face, || {
            let s = self.scaled(point - self.axis.base);
            (self.dual[0] * s.x + self.dual[1] * s.y).unit()
        })
    }

    /// The box around its two ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [a, b] = self.semi;
        let half = Vec3::new(a.x.hypot(b.x), a.y.hypot(b.y), a.z.hypot(b.z));
        self.axis.bounds(half, half)
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let o = point - self.axis.base;
        self.axis.holds(o.dot(self.axis.direction)) && self.scaled(o).norm2() <= 1.0
    }
}
