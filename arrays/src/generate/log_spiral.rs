//! Logarithmic spirals: equal turns and equal ratios of distances from element to element, so that the array looks alike at every scale.

use super::shape::{Point, Shape, arm_angle, polar};
use crate::{ArrayError, Result};
use std::f64::consts::TAU;

/// The arms share the elements evenly, at least two each; one more may stand at the centre.
pub fn has(s: &Shape) -> bool {
    s.elements / s.arms >= 2 && (s.elements.is_multiple_of(s.arms) || s.elements % s.arms == 1)
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    ArrayError::need("inner", s.inner, s.inner > 0.0, "above 0: the distances grow by a ratio")?;
    let along = s.elements / s.arms;
    let mut points = vec![[0.0; 2]; s.elements % s.arms];
    for arm in 0..s.arms {
        points.extend((0..along).map(|n| {
            let part = n as f64 / (along - 1) as f64;
            polar(libm::pow(s.inner, 1.0 - part), arm_angle(arm, s.arms) + TAU * s.turns * part)
        }));
    }
    Ok(points)
}
