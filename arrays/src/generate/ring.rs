//! Equal steps along a circle.

use super::shape::{Point, Shape, arm_angle, polar};
use crate::Result;

pub fn has(s: &Shape) -> bool {
    s.elements >= 3
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    Ok((0..s.elements).map(|i| polar(1.0, arm_angle(i, s.elements))).collect())
}
