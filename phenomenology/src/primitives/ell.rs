//! ELL: ellipsoid of revolution about the line of its foci.

use super::axis::disc_reach;
use super::entry::{Group, PrimitiveEntry};
use super::fault::{PrimitiveFault, positive};
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "ELL",
    aliases: &[],
    parameters: "F1x F1y F1z F2x F2y F2z L",
    layout: &[Group::Point, Group::Point, Group::Length],
    faces: &["surface"],
    describes: "ellipsoid by its foci and the length of its major axis",
};

/// An ellipsoid of revolution. It has one face, number 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ell {
    center: Vec3,
    axis: Vec3,
    major: f64,
    minor: f64,
}

impl Ell {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let (f1, f2) = (Vec3::from_slice(p), Vec3::from_slice(&p[3..6]));
        let length = positive("ELL", "major axis L", p[6])?;
        let distance = (f2 - f1).norm();
        if length <= distance {
            return Err(PrimitiveFault::ShortEllipsoid { major_m: length, distance_m: distance });
        }
        let axis = if distance > 0.0 { (f2 - f1) * (1.0 / distance) } else { Vec3::UP };
        let minor = 0.5 * ((length - distance) * (length + distance)).sqrt();
        Ok(Self { center: (f1 + f2) * 0.5, axis, major: 0.5 * length, minor })
    }

    /// A vector in units of the semi-axes.
    #[inline]
    fn scaled(&self, v: Vec3) -> Vec3 {
        let along = v.dot(self.axis);
        (v - self.axis * along) * (1.0 / self.minor) + self.axis * (along / self.major)
    }

    /// The part of a line inside.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        let (o, d) = (self.scaled(ray.origin - self.center), self.scaled(ray.direction));
        let a = d.norm2();
        let near = -o.dot(d) / a;
        let rest = 1.0 - (o + d * near).norm2();
        if rest <= 0.0 {
            return None;
        }
        let half = (rest / a).sqrt();
        Some(Span { t_in: near - half, t_out: near + half, face_in: 1, face_out: 1 })
    }

    /// Outward normal at a point.
    #[must_use]
    pub fn normal(&self, _face: u8, point: Vec3) -> Vec3 {
        self.scaled(self.scaled(point - self.center)).unit()
    }

    /// Box around it.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let across = disc_reach(self.axis, self.minor);
        let half = |along: f64, across: f64| (along * self.major).hypot(across);
        Bounds::around(self.center, Vec3::new(half(self.axis.x, across.x), half(self.axis.y, across.y), half(self.axis.z, across.z)))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.scaled(point - self.center).norm2() <= 1.0
    }
}
