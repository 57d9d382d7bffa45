//! A regular hexagon.

use super::polygon::Polygon;
use super::shape::{MadeShape, positive};

pub(super) fn make(sizes: &[f64]) -> MadeShape {
    let [width] = positive(sizes)?;
    let corner = |k: i32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
        (0.5 * width * cos, 0.5 * width * sin)
    };
    Ok(Box::new(Polygon::new((0..6).map(corner).collect())?))
}
