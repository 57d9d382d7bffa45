//! Equal steps along a Reuleaux triangle, the curve of constant width whose baselines cover the u-v disc most evenly.

use super::shape::{Point, Shape, polar};
use crate::Result;
use std::f64::consts::{FRAC_PI_3, PI, TAU};

pub fn has(s: &Shape) -> bool {
    s.elements >= 3
}

/// The triangle of width 1: three arcs of 60 degrees, each around the opposite corner.
pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let corner = |k: usize| polar(1.0 / libm::sqrt(3.0), TAU * k as f64 / 3.0);
    Ok((0..s.elements)
        .map(|i| {
            // The whole curve has three arcs; element i lies on arc `arc`, at this fraction of it.
            let (arc, along) = (3 * i / s.elements, (3 * i % s.elements) as f64 / s.elements as f64);
            let centre = corner(arc + 2);
            // From the corner `arc + 2` the corner `arc` is seen at 30 degrees before the direction to the opposite side.
            let middle = TAU * (arc + 2) as f64 / 3.0 + PI;
            let [x, y] = polar(1.0, middle - FRAC_PI_3 / 2.0 + FRAC_PI_3 * along);
            [centre[0] + x, centre[1] + y]
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{GenerateOptions, shape::Takes};
    use crate::quantity::Length;

    #[test]
    fn the_curve_has_one_width_and_equal_steps() {
        let shape = Shape::of("reuleaux", &[Takes::Seed], &GenerateOptions::new(300, Length(1.0))).unwrap();
        let p = points(&shape).unwrap();
        let width = |angle: f64| {
            let (s, c) = angle.sin_cos();
            let along = p.iter().map(|p| p[0] * c + p[1] * s);
            along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
        };
        for k in 0..36 {
            // Between two points a curve of curvature 1 rises by step^2 / 8.
            let step: f64 = PI / 300.0;
            assert!((width(f64::from(k) * 0.1) - 1.0).abs() < step * step / 2.0, "{k}: {}", width(f64::from(k) * 0.1));
        }
        for i in 0..300 {
            let (a, b) = (p[i], p[(i + 1) % 300]);
            let step = (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!((step / (PI / 300.0) - 1.0).abs() < 1e-4, "{i}: {step}");
        }
    }
}
