//! Four arms at right angles, along which the distances grow as a power.

use super::shape::{Point, Shape};
use crate::Result;

/// Four equal arms, with or without an element at the centre.
pub fn has(s: &Shape) -> bool {
    s.elements >= 4 && s.elements % 4 <= 1
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let along = s.elements / 4;
    let mut points = vec![[0.0; 2]; s.elements % 4];
    for n in 1..=along {
        let r = libm::pow(n as f64 / along as f64, s.exponent);
        points.extend([[r, 0.0], [-r, 0.0], [0.0, r], [0.0, -r]]);
    }
    Ok(points)
}
