//! TRC: truncated right cone.

use super::axis::{Axis, disc_reach};
use super::entry::{AXIAL_FACES, Group, PrimitiveEntry};
use super::fault::PrimitiveFault;
use crate::space::{Bounds, Ray, Span, Vec3};

/// Row of the table.
pub(super) const ENTRY: PrimitiveEntry = PrimitiveEntry {
    code: "TRC",
    aliases: &[],
    parameters: "Vx Vy Vz Hx Hy Hz R1 R2",
    layout: &[Group::Point, Group::Vector, Group::Length, Group::Length],
    faces: AXIAL_FACES,
    describes: "truncated cone by base centre, axis vector, base radius and top radius; one of the radii may be 0",
};

/// A truncated cone. Faces: 1 side, 2 base, 3 top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trc {
    axis: Axis,
    radius: [f64; 2],
    /// Change of radius along the axis.
    slope: f64,
}

impl Trc {
    pub(super) fn new(p: &[f64]) -> Result<Self, PrimitiveFault> {
        let axis = Axis::new("TRC", p)?;
        let radius = [p[6], p[7]];
        for (what, value) in [("radius R1", p[6]), ("radius R2", p[7])] {
            if value < 0.0 || radius == [0.0, 0.0] {
                return Err(PrimitiveFault::NotPositive { code: "TRC", what, value });
            }
        }
        Ok(Self { axis, radius, slope: (p[7] - p[6]) / axis.height })
    }

    /// The part of a line inside.
    ///
    /// The radius is not negative between the end planes, so the line fulfils `|across| <= radius` there in a single stretch.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Span> {
        // Distances count from the point nearest to the middle of the axis, so that no digits are lost for cones far away.
        let middle = self.axis.base + self.axis.direction * (0.5 * self.axis.height);
        let start = (middle - ray.origin).dot(ray.direction);
        let ((z, p), (dz, d)) = (self.axis.split(ray.at(start) - self.axis.base), self.axis.split(ray.direction));
        let mut span = Span::ALL;
        if !self.axis.slab(&mut span, z, dz) {
            return None;
        }
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
                // The line is steeper than the cone and stays inside one nappe.
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
        // At the apex no direction across the axis is defined. The normal there is the axis.
        self.axis.normal(face, || (self.axis.split(point - self.axis.base).1.unit() - self.axis.direction * self.slope).unit())
    }

    /// The box around its two ends.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let [base, top] = self.radius.map(|r| disc_reach(self.axis.direction, r));
        self.axis.bounds(base, top)
    }

    /// Whether a point lies inside or on it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let (z, across) = self.axis.split(point - self.axis.base);
        let r = self.radius[0] + self.slope * z;
        self.axis.holds(z) && across.norm2() <= r * r
    }
}
