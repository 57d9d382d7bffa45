//! Vectors of three numbers.

use std::ops::{Add, AddAssign, Index, Mul, Neg, Sub};

/// A point (m) or a direction: x points east, y north and z up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Vec3 {
    /// East.
    pub x: f64,
    /// North.
    pub y: f64,
    /// Up.
    pub z: f64,
}

impl Vec3 {
    /// The vector of zeros.
    pub const ZERO: Self = Self::new(0.0, 0.0, 0.0);
    /// The unit vector that points up.
    pub const UP: Self = Self::new(0.0, 0.0, 1.0);

    /// From its components.
    #[must_use]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    /// From the first three numbers of a slice, which must have at least three.
    #[must_use]
    pub fn from_slice(values: &[f64]) -> Self {
        Self::new(values[0], values[1], values[2])
    }

    /// The components.
    #[must_use]
    pub const fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    /// Scalar product.
    #[must_use]
    #[inline]
    pub fn dot(self, o: Self) -> f64 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Vector product.
    #[must_use]
    #[inline]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }

    /// Square of the length.
    #[must_use]
    #[inline]
    pub fn norm2(self) -> f64 {
        self.dot(self)
    }

    /// Length.
    #[must_use]
    #[inline]
    pub fn norm(self) -> f64 {
        self.norm2().sqrt()
    }

    /// The unit vector of the same direction. A vector of zeros stays as it is.
    #[must_use]
    #[inline]
    pub fn unit(self) -> Self {
        let n = self.norm();
        if n > 0.0 { self * (1.0 / n) } else { self }
    }

    /// Component-wise minimum.
    #[must_use]
    #[inline]
    pub fn min(self, o: Self) -> Self {
        Self::new(self.x.min(o.x), self.y.min(o.y), self.z.min(o.z))
    }

    /// Component-wise maximum.
    #[must_use]
    #[inline]
    pub fn max(self, o: Self) -> Self {
        Self::new(self.x.max(o.x), self.y.max(o.y), self.z.max(o.z))
    }

    /// Whether all components are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }

    /// The direction after reflection by a mirror with this unit normal.
    #[must_use]
    #[inline]
    pub fn mirrored(self, normal: Self) -> Self {
        self - normal * (2.0 * self.dot(normal))
    }
}

impl From<[f64; 3]> for Vec3 {
    fn from(a: [f64; 3]) -> Self {
        Self::new(a[0], a[1], a[2])
    }
}

impl Add for Vec3 {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl AddAssign for Vec3 {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Sub for Vec3 {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl Neg for Vec3 {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl Index<usize> for Vec3 {
    type Output = f64;
    #[inline]
    fn index(&self, axis: usize) -> &f64 {
        [&self.x, &self.y, &self.z][axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_turns_the_component_along_its_normal() {
        let d = Vec3::new(0.6, 0.0, -0.8);
        assert_eq!(d.mirrored(Vec3::UP), Vec3::new(0.6, 0.0, 0.8));
        let n = Vec3::new(1.0, 2.0, -0.5).unit();
        let r = d.mirrored(n);
        assert!((r.norm() - 1.0).abs() < 1e-15 && (r.dot(n) + d.dot(n)).abs() < 1e-15);
    }
}
