//! RCC: right circular cylinder.

use super::fault::{PrimitiveFault, positive};
use super::frame::length;
use super::{Group, PrimitiveEntry, Solid};
use crate::geometry::{Bounds, Ray, Span};
use crate::vector::Vec3;

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "RCC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz R",
    layout: &[Group::Point, Group::Vector, Group::Length],
    faces: &["side", "base at V", "top at V+H"],
    describes: "circular cylinder by base centre, axis vector and radius",
    build: |p| Rcc::new(p).map(Solid::Rcc),
};

/// A circular cylinder. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rcc {
    base: Vec3,
    axis: Vec3,
    height: f64,
    radius: f64,
}

impl Rcc {
    fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let h = Vec3::from_slice(&p[3..6]);
        let height = length("RCC", "H", h)?;
        Ok(Self { base: Vec3::from_slice(p), axis: h * (1.0 / height), height, radius: positive("RCC", "radius R", p[6])? })
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let o = ray.origin - self.base;
        let (z, dz) = (o.dot(self.axis), ray.direction.dot(self.axis));
        let (p, d) = (o - self.axis * z, ray.direction - self.axis * dz);
        let a = d.norm2();
        let mut span = Span::ALL;
        if a > 1e-30 {
            let near = -p.dot(d) / a;
            let rest = self.radius * self.radius - (p + d * near).norm2();
            if rest <= 0.0 {
                return None;
            }
            let half = (rest / a).sqrt();
            span.clip(near - half, 1, near + half, 1);
        } else if p.norm2() > self.radius * self.radius {
            return None;
        }
        span.slab(z, dz, 0.0, self.height, (2, 3)).then_some(span)
    }

    /// Outward normal of a face at a point.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        match face {
            2 => -self.axis,
            3 => self.axis,
            _ => {
                let o = point - self.base;
                (o - self.axis * o.dot(self.axis)).unit()
            }
        }
    }

    /// Box around the discs of its ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let half = disc_reach(self.axis, self.radius);
        Bounds::around(self.base, half).union(Bounds::around(self.base + self.axis * self.height, half))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let o = point - self.base;
        let z = o.dot(self.axis);
        (0.0..=self.height).contains(&z) && (o - self.axis * z).norm2() <= self.radius * self.radius
    }
}

/// How far a disc with this unit axis reaches along x, y and z.
pub(super) fn disc_reach(axis: Vec3, radius: f64) -> Vec3 {
    let reach = |a: f64| radius * (1.0 - a * a).max(0.0).sqrt();
    Vec3::new(reach(axis.x), reach(axis.y), reach(axis.z))
}
