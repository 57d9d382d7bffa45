//! Rays.

use super::vector::Vec3;

/// A half-line with a unit direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, m.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// One over each component of the direction.
    pub inverse: Vec3,
}

impl Ray {
    /// From a start and a direction of any length above zero.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self::from_unit(origin, direction.unit())
    }

    /// From a start and a unit direction.
    #[must_use]
    #[inline]
    pub fn from_unit(origin: Vec3, direction: Vec3) -> Self {
        let inverse = Vec3::new(1.0 / direction.x, 1.0 / direction.y, 1.0 / direction.z);
        Self { origin, direction, inverse }
    }

    /// The point at distance `t`.
    #[must_use]
    #[inline]
    pub fn at(&self, t: f64) -> Vec3 {
        self.origin + self.direction * t
    }
}
