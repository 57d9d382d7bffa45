//! What a shape is.

use crate::ensure;
use std::fmt;

/// An opening in the plane of the pupil. x points along the columns of the image and y along its rows; the origin is the axis of the optics.
pub trait Shape: fmt::Debug + Send + Sync {
    /// Half of the width and of the height of the box around the origin that holds the shape, m.
    fn half_box_m(&self) -> (f64, f64);

    /// Radius of the circle around the origin that holds the shape, m.
    fn radius_m(&self) -> f64;

    /// The parts of the line at height `y` that lie in the shape, m: pairs of limits in ascending order, without overlap.
    fn spans(&self, y: f64) -> Vec<(f64, f64)>;

    /// The heights at which the parts begin, end or turn, m: between two of them their limits are smooth.
    fn breaks_m(&self) -> Vec<f64>;
}

/// A shape, or which lengths it needs.
pub type MadeShape = Result<Box<dyn Shape>, String>;

/// One row of the table of shapes.
#[derive(Debug, Clone, Copy)]
pub struct ShapeKind {
    /// Its name.
    pub name: &'static str,
    /// Its lengths, as they are written after the name.
    pub sizes: &'static str,
    /// Function that makes it of its lengths in m. The error says which are expected.
    pub make: fn(&[f64]) -> MadeShape,
    /// What it is.
    pub about: &'static str,
}

/// Lengths above 0, as many as the shape has.
pub(super) fn positive<const N: usize>(sizes: &[f64]) -> Result<[f64; N], String> {
    let found: [f64; N] = sizes.try_into().map_err(|_| format!("it has {} lengths, expected {N}", sizes.len()))?;
    ensure!(found.iter().all(|v| *v > 0.0), "its lengths must be above 0".to_owned());
    Ok(found)
}
