//! Rotation, scaling and translation.

use super::vector::Vec3;

/// A rotation, then a scaling, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Images of the unit vectors along x, y and z.
    columns: [Vec3; 3],
    scale: f64,
    shift: Vec3,
}

impl Similarity {
    /// The transform that changes nothing.
    pub const IDENTITY: Self =
        Self { columns: [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)], scale: 1.0, shift: Vec3::ZERO };

    /// Rotates about x, then y, then z by angles in degrees (right-handed), scales, and moves by `shift` in m.
    ///
    /// Returns `None` if the scale is not above zero or a number is not finite.
    #[must_use]
    pub fn new(shift: Vec3, angles_deg: Vec3, scale: f64) -> Option<Self> {
        if !(scale > 0.0 && scale.is_finite() && shift.is_finite() && angles_deg.is_finite()) {
            return None;
        }
        let turn = |v: Vec3| {
            let (s, c) = sin_cos_deg(angles_deg.x);
            let v = Vec3::new(v.x, c * v.y - s * v.z, s * v.y + c * v.z);
            let (s, c) = sin_cos_deg(angles_deg.y);
            let v = Vec3::new(c * v.x + s * v.z, v.y, -s * v.x + c * v.z);
            let (s, c) = sin_cos_deg(angles_deg.z);
            Vec3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z)
        };
        Some(Self { columns: Self::IDENTITY.columns.map(turn), scale, shift })
    }

    /// The scale.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether the transform rotates.
    #[must_use]
    pub fn is_turned(&self) -> bool {
        self.columns != Self::IDENTITY.columns
    }

    fn turned(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    /// The image of a point.
    #[must_use]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.vector(p) + self.shift
    }

    /// The image of a vector.
    #[must_use]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.turned(v) * self.scale
    }

    /// This transform followed by `outer`.
    #[must_use]
    pub fn then(&self, outer: &Self) -> Self {
        Self { columns: self.columns.map(|c| outer.turned(c)), scale: self.scale * outer.scale, shift: outer.point(self.shift) }
    }
}

/// Sine and cosine of an angle. They are exact for multiples of 90 degrees, so that boxes turned by them stay along the axes.
fn sin_cos_deg(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_right_handed_and_compose() {
        let quarter = Similarity::new(Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 90.0), 2.0).unwrap();
        assert_eq!(quarter.point(Vec3::new(1.0, 0.0, 3.0)), Vec3::new(10.0, 2.0, 6.0));
        let inner = Similarity::new(Vec3::new(0.0, 1.0, 0.0), Vec3::new(30.0, 0.0, 0.0), 0.5).unwrap();
        let p = Vec3::new(0.3, -0.2, 0.9);
        let (once, twice) = (inner.then(&quarter).point(p), quarter.point(inner.point(p)));
        assert!((once - twice).norm() < 1e-14);
        assert!(Similarity::new(Vec3::ZERO, Vec3::ZERO, 0.0).is_none());
    }
}
