//! TRC: truncated right cone.

use super::fault::PrimitiveFault;
use super::frame::length;
use super::rcc::disc_reach;
use super::{Group, PrimitiveEntry, Solid};
use crate::geometry::{Bounds, Ray, Span};
use crate::vector::Vec3;

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "TRC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz R1 R2",
    layout: &[Group::Point, Group::Vector, Group::Length, Group::Length],
    faces: &["side", "base at V", "top at V+H"],
    describes: "truncated cone by base centre, axis vector, base radius and top radius; one of the radii may be 0",
    build: |p| Trc::new(p).map(Solid::Trc),
};

/// A truncated cone. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trc {
    base: Vec3,
    axis: Vec3,
    height: f64,
    radius: [f64; 2],
    /// Change of radius along the axis.
    slope: f64,
}

impl Trc {
    fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let h = Vec3::from_slice(&p[3..6]);
        let height = length("TRC", "H", h)?;
        let radius = [p[6], p[7]];
        for (what, value) in [("radius R1", p[6]), ("radius R2", p[7])] {
            if value < 0.0 || radius == [0.0, 0.0] {
                return Err(PrimitiveFault::NotPositive { code: "TRC", what, value });
            }
        }
        Ok(Self { base: Vec3::from_slice(p), axis: h * (1.0 / height), height, radius, slope: (p[7] - p[6]) / height })
    }

    /// The part of a line inside.
    ///
    /// Between the end planes the radius is not negative, and there `|across| <= radius` is a single stretch of the line.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        // Counted from the point nearest to the middle of the axis, so that far cones lose no digits.
        let middle = self.base + self.axis * (0.5 * self.height);
        let start = (middle - ray.origin).dot(ray.direction);
        let o = ray.at(start) - self.base;
        let (z, dz) = (o.dot(self.axis), ray.direction.dot(self.axis));
        let mut span = Span::ALL;
        if !span.slab(z, dz, 0.0, self.height, (2, 3)) {
            return None;
        }
        let (p, d) = (o - self.axis * z, ray.direction - self.axis * dz);
        let (r, dr) = (self.radius[0] + self.slope * z, self.slope * dz);
        // a t^2 + 2 b t + c <= 0
        let (a, b, c) = (d.norm2() - dr * dr, p.dot(d) - r * dr, p.norm2() - r * r);
        let open = if a.abs() < 1e-14 {
            if b == 0.0 {
                c <= 0.0
            } else {
                let t = -0.5 * c / b;
                if b > 0.0 { span.clip(f64::NEG_INFINITY, 0, t, 1) } else { span.clip(t, 1, f64::INFINITY, 0) }
            }
        } else {
            let discriminant = b * b - a * c;
            if discriminant <= 0.0 {
                // Steeper than the cone, the line is always inside one nappe.
                a < 0.0
            } else {
                let q = -(b + discriminant.sqrt().copysign(b));
                let (t1, t2) = (q / a, c / q);
                let (lo, hi) = (t1.min(t2), t1.max(t2));
                if a > 0.0 {
                    span.clip(lo, 1, hi, 1)
                } else if dr > 0.0 {
                    span.clip(hi, 1, f64::INFINITY, 0)
                } else {
                    span.clip(f64::NEG_INFINITY, 0, lo, 1)
                }
            }
        };
        open.then(|| span.shifted(start))
    }

    /// Outward normal of a face at a point.
    #[must_use]
    pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
        match face {
            2 => -self.axis,
            3 => self.axis,
            _ => {
                let o = point - self.base;
                let across = o - self.axis * o.dot(self.axis);
                // At the apex every direction across is as good; the axis is left.
                (across.unit() - self.axis * self.slope).unit()
            }
        }
    }

    /// Box around the discs of its ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [r1, r2] = self.radius;
        Bounds::around(self.base, disc_reach(self.axis, r1))
            .union(Bounds::around(self.base + self.axis * self.height, disc_reach(self.axis, r2)))
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let o = point - self.base;
        let z = o.dot(self.axis);
        let r = self.radius[0] + self.slope * z;
        (0.0..=self.height).contains(&z) && (o - self.axis * z).norm2() <= r * r
    }
}
