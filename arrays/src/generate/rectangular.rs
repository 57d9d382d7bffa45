//! A full rectangular grid of square cells.

use super::shape::{Point, Shape};
use crate::Result;

/// Columns and rows. Without a wish the grid is as close to a square as the number of elements allows, and at most twice as wide as high.
fn sides(s: &Shape) -> Option<(usize, usize)> {
    let columns = match s.columns {
        Some(columns) => columns,
        None => (2..=s.elements).find(|c| c * c >= s.elements && s.elements.is_multiple_of(*c)).filter(|c| c * c <= 2 * s.elements)?,
    };
    s.elements.is_multiple_of(columns).then_some((columns, s.elements / columns))
}

pub fn has(s: &Shape) -> bool {
    sides(s).is_some()
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let (columns, rows) = sides(s).unwrap_or((1, 1));
    Ok(grid(columns, rows))
}

/// The places of a grid at distance 1 from each other. The first and the last are opposite corners.
pub fn grid(columns: usize, rows: usize) -> Vec<Point> {
    (0..rows).flat_map(|j| (0..columns).map(move |i| [i as f64, j as f64])).collect()
}
