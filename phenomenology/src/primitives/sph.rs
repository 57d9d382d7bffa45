//! SPH: sphere.

use super::entry::{Group, PrimitiveEntry};
use super::fault::{PrimitiveFault, positive};
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "SPH",
    aliases: &[],
    parameters: "Vx Vy Vz R",
    layout: &[Group::Point, Group::Length],
    faces: &["surface"],
    describes: "sphere by centre and radius",
};

/// A sphere. It has one face, number 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sph {
    center: Vec3,
    radius: f64,
}

impl Sph {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        Ok(Self { center: Vec3::from_slice(p), radius: positive("SPH", "radius R", p[3])? })
    }

    /// The part of a line inside.
    ///
    /// Distances count from the point nearest to the centre, so that no digits are lost for spheres far away.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let near = (self.center - ray.origin).dot(ray.direction);
        let across = ray.at(near) - self.center;
        let rest = self.radius * self.radius - across.norm2();
        if rest <= 0.0 {
            return None;
        }
        let half = rest.sqrt();
        Some(Span { t_in: near - half, t_out: near + half, face_in: 1, face_out: 1 })
    }

    /// Outward normal at a point.
    #[must_use]
    pub fn normal(&self, _face: u8, point: Vec3) -> Vec3 {
        (point - self.center).unit()
    }

    /// Box around it.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        Bounds::around(self.center, Vec3::new(self.radius, self.radius, self.radius))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        (point - self.center).norm2() <= self.radius * self.radius
    }
}
