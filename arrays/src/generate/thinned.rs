//! Random places of a regular grid.
//!
//! Two opposite corners of the grid are always taken, so that the grid, not the choice, sets the aperture.
//!
//! # Reference
//! Willey 1962, IRE Trans. Antennas Propag. 10, 369 (space tapering of thinned arrays).

use super::shape::{Point, Shape};
use super::{hexagonal, rectangular};
use crate::random::{below, stream};
use crate::{ArrayError, Result};

/// Places for each element where the number of columns or rings is not given: a quarter of the grid is filled.
const PLACES: usize = 4;

pub fn has(_: &Shape) -> bool {
    true
}

/// Places of a square grid.
pub fn square(s: &Shape) -> Result<Vec<Point>> {
    let columns = s.columns.unwrap_or_else(|| (2..).find(|c| c * c >= PLACES * s.elements).unwrap_or(2));
    chosen(rectangular::grid(columns, columns), s)
}

/// Places of a triangular grid within a hexagon.
pub fn triangular(s: &Shape) -> Result<Vec<Point>> {
    let enough = || (1..).find(|r| hexagonal::places(*r) >= PLACES * s.elements).unwrap_or(1);
    let rings = if s.rings == 0 { enough() } else { s.rings };
    chosen(hexagonal::grid(rings), s)
}

fn chosen(mut places: Vec<Point>, s: &Shape) -> Result<Vec<Point>> {
    let n = places.len();
    ArrayError::need("elements", s.elements, s.elements <= n, format!("at most {n}, the places of the grid"))?;
    let last = n - 1;
    places.swap(1, last);
    let mut rng = stream(s.seed, "thinned grid", 0);
    for k in 2..s.elements {
        let other = k + below(&mut rng, n - k);
        places.swap(k, other);
    }
    places.truncate(s.elements);
    Ok(places)
}
