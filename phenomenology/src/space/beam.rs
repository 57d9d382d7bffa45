//! Bundles of rays.

use super::bounds::Bounds;

/// All rays that start in one box and whose directions lie in another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    origins: Bounds,
    directions: Bounds,
}

impl Beam {
    /// The rays with origins in m and directions of unit length in these boxes.
    #[must_use]
    pub fn new(origins: Bounds, directions: Bounds) -> Self {
        Self { origins, directions }
    }

    /// A distance before which no ray enters a box, m; `None` if no ray can meet it. It exists for every box that a ray meets, and for some that no
    /// ray meets: it asks for one distance at which the rays as a whole reach the box along each axis.
    #[must_use]
    #[inline]
    pub fn entry(&self, b: &Bounds) -> Option<f64> {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            // The lowest ray is not above the box, and the highest one is not below it.
            let below = (self.directions.min[axis], b.max[axis] - self.origins.min[axis]);
            let above = (-self.directions.max[axis], self.origins.max[axis] - b.min[axis]);
            for (speed, room) in [below, above] {
                // Distances t with speed t <= room.
                if speed > 0.0 {
                    far = far.min(room / speed);
                } else if speed < 0.0 {
                    near = near.max(room / speed);
                } else if !(room >= 0.0) {
                    return None;
                }
            }
        }
        (near <= far).then_some(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{Ray, Vec3};
    use proptest::prelude::*;

    fn place(spread: f64) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-spread..spread).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn a_box_that_a_ray_meets_is_met(
            from in place(20.0), to in place(5.0), size in 0.0..3.0, wide in 0.0..2.0, angle in 0.0..0.1, at in prop::array::uniform3(-1.0..1.0)
        ) {
            let direction = (to - from).unit();
            let beam = Beam::new(
                Bounds::around(from, Vec3::new(wide, wide, wide)),
                Bounds::around(direction, Vec3::new(angle, angle, angle)),
            );
            let [a, b, c] = at;
            let ray = Ray::from_unit(from + Vec3::new(a, b, c) * wide, direction + Vec3::new(b, c, a) * angle);
            let target = Bounds::around(to, Vec3::new(size, 0.5 * size, 2.0 * size));
            let first = beam.entry(&target).unwrap_or(f64::INFINITY);
            prop_assert!(target.entry(&ray, f64::INFINITY).is_none_or(|t| first <= t + 1e-9));
        }
    }

    #[test]
    fn boxes_beside_and_behind_are_not_met() {
        let beam = Beam::new(
            Bounds::around(Vec3::ZERO, Vec3::new(0.1, 0.1, 0.1)),
            Bounds::around(Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 0.1, 0.1)),
        );
        let at = |x: f64, y: f64| beam.entry(&Bounds::around(Vec3::new(x, y, 0.0), Vec3::new(0.5, 0.5, 0.5))).is_some();
        assert!(at(10.0, 0.0) && at(10.0, 1.4) && !at(10.0, 2.0));
        assert!(!at(-10.0, 0.0) && !at(1.0, 3.0));
        // A direction without any component along an axis.
        assert!(
            Beam::new(Bounds::around(Vec3::ZERO, Vec3::ZERO), Bounds::around(Vec3::UP, Vec3::ZERO))
                .entry(&Bounds::around(Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.5, 0.5, 0.5)))
                .is_none()
        );
    }
}
