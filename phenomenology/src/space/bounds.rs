//! Boxes along the axes that hold bodies.

use super::ray::Ray;
use super::vector::Vec3;

/// An axis-aligned box, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

impl Bounds {
    /// A box without any point.
    pub const EMPTY: Self = Self {
        min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };
    /// The box of all points.
    pub const ALL: Self = Self {
        min: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
        max: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    };

    /// The smallest box that holds the points.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The box around a point that reaches `half` to each side.
    #[must_use]
    pub fn around(center: Vec3, half: Vec3) -> Self {
        Self { min: center - half, max: center + half }
    }

    /// The smallest box that holds both boxes.
    #[must_use]
    pub fn union(self, o: Self) -> Self {
        Self { min: self.min.min(o.min), max: self.max.max(o.max) }
    }

    /// The part that is common to both boxes.
    #[must_use]
    pub fn intersection(self, o: Self) -> Self {
        Self { min: self.min.max(o.min), max: self.max.min(o.max) }
    }

    /// Whether it holds no point.
    #[must_use]
    pub fn is_empty(self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Whether it has finite corners.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Middle.
    #[must_use]
    pub fn center(self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Diagonal.
    #[must_use]
    pub fn size(self) -> Vec3 {
        self.max - self.min
    }

    /// Half the surface area, m2. The probability that a random ray meets the box is proportional to it.
    #[must_use]
    pub fn half_area(self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let s = self.size();
        s.x * s.y + s.y * s.z + s.z * s.x
    }

    /// The box grown by `by` on each side.
    #[must_use]
    pub fn grown(self, by: f64) -> Self {
        let g = Vec3::new(by, by, by);
        Self { min: self.min - g, max: self.max + g }
    }

    /// Whether a point lies in it.
    #[must_use]
    pub fn contains(self, p: Vec3) -> bool {
        p.x >= self.min.x && p.y >= self.min.y && p.z >= self.min.z && p.x <= self.max.x && p.y <= self.max.y && p.z <= self.max.z
    }

    /// Distance at which a ray enters the box. `None` if it enters beyond `t_max` or misses the box. A ray that starts inside enters at 0.
    #[must_use]
    #[inline]
    pub fn entry(&self, ray: &Ray, t_max: f64) -> Option<f64> {
        let (o, i) = (ray.origin, ray.inverse);
        let (x1, x2) = ((self.min.x - o.x) * i.x, (self.max.x - o.x) * i.x);
        let (y1, y2) = ((self.min.y - o.y) * i.y, (self.max.y - o.y) * i.y);
        let (z1, z2) = ((self.min.z - o.z) * i.z, (self.max.z - o.z) * i.z);
        let near = larger(larger(smaller(x1, x2), smaller(y1, y2)), larger(smaller(z1, z2), 0.0));
        let far = smaller(smaller(larger(x1, x2), larger(y1, y2)), smaller(larger(z1, z2), t_max));
        (near <= far).then_some(near)
    }
}

/// The smaller of two numbers, the second where one is NaN. It is one instruction, and `f64::min`, which has to look for NaN, is five.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers, as [`smaller`].
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_along_an_axis_meet_a_box_they_pass_through() {
        let b = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 2.0, 3.0) };
        let ray = Ray::new(Vec3::new(-5.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert_eq!(b.entry(&ray, 100.0), Some(5.0));
        assert_eq!(b.entry(&ray, 4.0), None);
        let beside = Ray::new(Vec3::new(-5.0, 2.5, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert_eq!(b.entry(&beside, 100.0), None);
        let inside = Ray::new(Vec3::new(0.5, 0.5, 0.5), Vec3::new(0.0, 0.0, -1.0));
        assert_eq!(b.entry(&inside, 100.0), Some(0.0));
    }
}
