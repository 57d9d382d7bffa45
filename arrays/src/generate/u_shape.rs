//! Three sides of a square with equal spacings.

use super::shape::{Point, Shape};
use crate::Result;

/// The three sides have the same number of spacings.
pub fn has(s: &Shape) -> bool {
    s.elements >= 4 && s.elements % 3 == 1
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let side = (s.elements - 1) / 3;
    let mut points: Vec<Point> = (0..=side).map(|i| [i as f64, 0.0]).collect();
    points.extend((1..=side).flat_map(|j| [[0.0, j as f64], [side as f64, j as f64]]));
    Ok(points)
}
