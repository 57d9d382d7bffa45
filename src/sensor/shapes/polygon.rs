//! A polygon.

use super::shape::{MadeShape, Shape};
use crate::ensure;

/// A polygon; where it crosses itself, a place is inside if an odd number of its sides lies to the right of it.
#[derive(Debug)]
pub(super) struct Polygon {
    corners: Vec<(f64, f64)>,
}

impl Polygon {
    /// # Errors
    /// Fewer than three corners, or corners on one line.
    pub(super) fn new(corners: Vec<(f64, f64)>) -> Result<Self, String> {
        ensure!(corners.len() >= 3, "it needs at least three corners".to_owned());
        let polygon = Self { corners };
        let area: f64 = polygon.sides().map(|(a, b)| 0.5 * (a.0 * b.1 - b.0 * a.1)).sum();
        let radius = polygon.radius_m();
        ensure!(area.abs() > 1e-9 * radius * radius, "its area is 0".to_owned());
        Ok(polygon)
    }

    fn sides(&self) -> impl Iterator<Item = ((f64, f64), (f64, f64))> + '_ {
        self.corners.iter().copied().zip(self.corners.iter().copied().cycle().skip(1))
    }
}

impl Shape for Polygon {
    fn half_box_m(&self) -> (f64, f64) {
        self.corners.iter().fold((0.0, 0.0), |(x, y), c| (c.0.abs().max(x), c.1.abs().max(y)))
    }

    fn radius_m(&self) -> f64 {
        self.corners.iter().fold(0.0, |r, c| c.0.hypot(c.1).max(r))
    }

    fn spans(&self, y: f64) -> Vec<(f64, f64)> {
        let crosses = |((a, b), (c, d)): ((f64, f64), (f64, f64))| ((b > y) != (d > y)).then(|| a + (y - b) / (d - b) * (c - a));
        let mut at: Vec<f64> = self.sides().filter_map(crosses).collect();
        at.sort_by(f64::total_cmp);
        at.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect()
    }

    fn breaks_m(&self) -> Vec<f64> {
        self.corners.iter().map(|c| c.1).collect()
    }
}

pub(super) fn make(sizes: &[f64]) -> MadeShape {
    ensure!(sizes.len().is_multiple_of(2), format!("it has {} lengths, expected pairs of x and y", sizes.len()));
    Ok(Box::new(Polygon::new(sizes.chunks_exact(2).map(|c| (c[0], c[1])).collect())?))
}
