//! The axis of a cylinder or cone: a base point, a direction and a height.

use super::fault::PrimitiveFault;
use super::frame::length;
use crate::space::{Bounds, Ray, Span, Vec3};

/// Number of the face at the base, and of the face at the top.
const ENDS: (u8, u8) = (2, 3);

/// Squared length below which the part of a ray across the axis counts as zero, so that the ray runs along the axis. Unit directions
/// carry rounding errors of 1e-16, whose square is 1e-32.
const ALONG_AXIS: f64 = 1e-30;

/// The axis of a body that stands between two parallel planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub base: Vec3,
    /// Unit direction from the base to the top.
    pub direction: Vec3,
    pub height: f64,
}

impl Axis {
    /// From the base point and the axis vector, which are the first six parameters.
    pub(super) fn new(code: &'static str, p: &[f64]) -> Result<Self, PrimitiveFault> {
        let h = Vec3::from_slice(&p[3..6]);
        let height = length(code, "H", h)?;
        Ok(Self { base: Vec3::from_slice(p), direction: h * (1.0 / height), height })
    }

    /// The height of a vector along the axis, and what is left of it across the axis.
    #[inline]
    pub(super) fn split(&self, v: Vec3) -> (f64, Vec3) {
        let along = v.dot(self.direction);
        (along, v - self.direction * along)
    }

    /// Keeps the part of a line between base and top, given the height `z` of its origin and the change `dz` of height along it.
    #[inline]
    pub(super) fn slab(&self, span: &mut Span, z: f64, dz: f64) -> bool {
        span.slab(z, dz, 0.0, self.height, ENDS)
    }

    /// The part of a ray inside a cylinder. `p` and `d` are its origin and direction across the axis, in units in which the section of
    /// the cylinder is a circle of radius `radius`.
    #[inline]
    pub(super) fn cylinder(&self, ray: &Ray, p: Vec3, d: Vec3, radius: f64) -> Option<Span> {
        let a = d.norm2();
        let mut span = Span::ALL;
        if a > ALONG_AXIS {
            // Distances count from the point nearest to the axis, so that no digits are lost far away.
            let near = -p.dot(d) / a;
            let rest = radius * radius - (p + d * near).norm2();
            if rest <= 0.0 {
                return None;
            }
            let half = (rest / a).sqrt();
            span.clip(near - half, 1, near + half, 1);
        } else if p.norm2() > radius * radius {
            return None;
        }
        let z = (ray.origin - self.base).dot(self.direction);
        self.slab(&mut span, z, ray.direction.dot(self.direction)).then_some(span)
    }

    /// Outward normal of the base or the top. The normal of the side comes from `side`.
    pub(super) fn normal(&self, face: u8, side: impl FnOnce() -> Vec3) -> Vec3 {
        match face {
            2 => -self.direction,
            3 => self.direction,
            _ => side(),
        }
    }

    /// The box around two ends that reach `base` and `top` to each side of the axis.
    pub(super) fn bounds(&self, base: Vec3, top: Vec3) -> Bounds {
        Bounds::around(self.base, base).union(Bounds::around(self.base + self.direction * self.height, top))
    }

    /// Whether a height lies between base and top.
    pub(super) fn holds(&self, z: f64) -> bool {
        (0.0..=self.height).contains(&z)
    }
}

/// How far a disc with this unit axis reaches along x, y and z.
pub(super) fn disc_reach(axis: Vec3, radius: f64) -> Vec3 {
    let reach = |a: f64| radius * (1.0 - a * a).max(0.0).sqrt();
    Vec3::new(reach(axis.x), reach(axis.y), reach(axis.z))
}
