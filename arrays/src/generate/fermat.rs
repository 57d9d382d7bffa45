//! Each element turns by the golden angle and steps outwards, as the seeds of a sunflower.

use super::shape::{GOLDEN_ANGLE, Point, Shape, polar};
use crate::Result;

pub fn has(_: &Shape) -> bool {
    true
}

/// Distances grow as (n + 1/2)^exponent: with 1/2 every element has the same area.
pub fn points(s: &Shape) -> Result<Vec<Point>> {
    Ok((0..s.elements).map(|n| polar(libm::pow(n as f64 + 0.5, s.exponent), GOLDEN_ANGLE * n as f64)).collect())
}
