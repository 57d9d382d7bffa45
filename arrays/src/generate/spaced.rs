//! Points that keep a least distance, sorted into square cells so that a new point is compared with its neighbours only.

use super::shape::Point;
use std::collections::HashMap;

/// Points of a disc of diameter 1 around the origin.
pub struct Spaced {
    least: f64,
    /// Cells are as wide as the least distance.
    cells: HashMap<[i64; 2], Vec<Point>>,
    pub points: Vec<Point>,
}

impl Spaced {
    pub fn new(least: f64) -> Self {
        Self { least, cells: HashMap::new(), points: Vec::new() }
    }

    /// A distance of 0 asks for different points only.
    fn cell(&self, p: Point) -> [i64; 2] {
        p.map(|v| (v / self.least.max(1e-6)).floor() as i64)
    }

    /// True where the point lies in the disc and keeps the distance from all others.
    pub fn fits(&self, p: Point) -> bool {
        let inside = p[0] * p[0] + p[1] * p[1] <= 0.25;
        let [x, y] = self.cell(p);
        let near = |q: &Point| (q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1]) < (self.least * self.least).max(1e-18);
        inside && !(-1..=1).any(|i| (-1..=1).any(|j| self.cells.get(&[x + i, y + j]).is_some_and(|c| c.iter().any(near))))
    }

    pub fn push(&mut self, p: Point) {
        self.cells.entry(self.cell(p)).or_default().push(p);
        self.points.push(p);
    }
}

/// The largest number of points with a least distance (over the diameter of the disc) that any arrangement can have: discs of that diameter
/// cover at most pi / sqrt 12 of the plane (Thue 1910), here of the disc that they may reach into.
pub fn most_points(least: f64) -> f64 {
    std::f64::consts::PI / libm::sqrt(12.0) * (1.0 + 1.0 / least) * (1.0 + 1.0 / least)
}
