//! A full hexagon of a triangular grid.

use super::shape::{Point, Shape};
use crate::Result;

/// Number of places of a hexagon with `rings` rings around its middle.
pub fn places(rings: usize) -> usize {
    1 + 3 * rings * (rings + 1)
}

fn rings(elements: usize) -> Option<usize> {
    (1..=elements).take_while(|r| places(*r) <= elements).find(|r| places(*r) == elements)
}

pub fn has(s: &Shape) -> bool {
    rings(s.elements).is_some()
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    Ok(grid(rings(s.elements).unwrap_or(1)))
}

/// The places of a hexagon at distance 1 from each other. The first and the last are opposite corners.
pub fn grid(rings: usize) -> Vec<Point> {
    let n = rings as i64;
    let half_height = libm::sqrt(3.0) / 2.0;
    let mut points = Vec::with_capacity(places(rings));
    for row in -n..=n {
        let columns = 2 * n + 1 - row.abs();
        points.extend((0..columns).map(|c| [c as f64 - (columns - 1) as f64 / 2.0, row as f64 * half_height]));
    }
    points
}
