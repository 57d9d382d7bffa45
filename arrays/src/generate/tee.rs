//! A bar and a stem that leaves its middle at a right angle.

use super::shape::{Point, Shape};
use crate::Result;

/// Two halves of the bar and the stem have the same number of elements, and one stands where they meet.
pub fn has(s: &Shape) -> bool {
    s.elements >= 4 && s.elements % 3 == 1
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let along = (s.elements - 1) / 3;
    let mut points = vec![[0.0; 2]];
    for n in 1..=along {
        let r = libm::pow(n as f64 / along as f64, s.exponent);
        points.extend([[-r, 0.0], [r, 0.0], [0.0, -r]]);
    }
    Ok(points)
}
