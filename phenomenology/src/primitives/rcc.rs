//! RCC: right circular cylinder.

use super::axis::{Axis, disc_reach};
use super::entry::{AXIAL_FACES, Group, PrimitiveEntry};
use super::fault::{PrimitiveFault, positive};
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "RCC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz R",
    layout: &[Group::Point, Group::Vector, Group::Length],
    faces: AXIAL_FACES,
    describes: "circular cylinder by base centre, axis vector and radius",
};

/// A circular cylinder. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rcc {
    axis: Axis,
    radius: f64,
}

impl Rcc {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        Ok(Self { axis: Axis::new("RCC", p)?, radius: positive("RCC", "radius R", p[6])? })
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let (_, p) = self.axis.split(ray.origin - self.axis.base);
        let (_, d) = self.axis.split(ray.direction);
        self.axis.cylinder(ray, p, d, self.radius)
    }

    /// Outward normal of a face at a point.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        self.axis.normal(face, || self.axis.split(point - self.axis.base).1.unit())
    }

    /// The box around its two ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let half = disc_reach(self.axis.direction, self.radius);
        self.axis.bounds(half, half)
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let (z, across) = self.axis.split(point - self.axis.base);
        self.axis.holds(z) && across.norm2() <= self.radius * self.radius
    }
}
