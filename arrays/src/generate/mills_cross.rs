//! Two lines of equal spacings at right angles.

use super::shape::{Point, Shape};
use crate::Result;

/// With an element at the centre, both lines have an odd number of elements; without it, an even number.
pub fn has(s: &Shape) -> bool {
    s.elements >= 4 && s.elements % 4 <= 1
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let (along, centre) = (s.elements / 4, s.elements % 4 == 1);
    let mut points = vec![[0.0; 2]; usize::from(centre)];
    for n in 1..=along {
        // Without an element at the centre the lines cross in the middle of a spacing.
        let r = n as f64 - if centre { 0.0 } else { 0.5 };
        points.extend([[r, 0.0], [-r, 0.0], [0.0, r], [0.0, -r]]);
    }
    Ok(points)
}
