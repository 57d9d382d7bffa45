//! Straight arms from a centre, along which the distances grow as a power.

use super::shape::{Point, Shape, arm_angle, polar};
use crate::{ArrayError, Result};

/// The arms share the elements evenly; one more may stand at the centre.
pub fn has(s: &Shape) -> bool {
    s.elements >= s.arms && s.elements % s.arms <= 1
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    ArrayError::need("arms", s.arms, s.arms >= 3, "at least 3")?;
    let along = s.elements / s.arms;
    let mut points = vec![[0.0; 2]; s.elements % s.arms];
    for arm in 0..s.arms {
        points.extend((1..=along).map(|n| polar(libm::pow(n as f64 / along as f64, s.exponent), arm_angle(arm, s.arms))));
    }
    Ok(points)
}
