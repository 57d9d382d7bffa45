//! The largest circle of the u-v plane without a baseline.

use super::plane::Plane;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The diameter is found to this fraction of itself.
const TOLERANCE: f64 = 1e-3;

/// Diameter, in wavelengths, of the largest circle that lies within the disc of the longest baseline and contains no baseline and no opposite
/// of one. The zero spacing does not count as measured.
///
/// The radius of the largest such circle around a point changes at most as fast as the point moves. So a square whose middle has a radius r
/// cannot contain a point of a radius above r + half its diagonal: squares are divided, the most promising first, until none can hold more.
pub(super) fn diameter(plane: &Plane) -> f64 {
    let longest = plane.longest();
    let points: Vec<[f64; 2]> = plane.pairs().flat_map(|[u, v]| [[u / longest, v / longest], [-u / longest, -v / longest]]).collect();
    let samples = Samples::new(&points);
    let radius = |x: f64, y: f64| (1.0 - x.hypot(y)).min(samples.nearest(x, y));
    let square = |x: f64, y: f64, half: f64| {
        let r = radius(x, y);
        Square { bound: r + half * std::f64::consts::SQRT_2, r, x, y, half }
    };
    // The coverage is symmetric about the origin: the half with y > 0 is enough.
    let mut heap = BinaryHeap::from([square(-0.5, 0.5, 0.5), square(0.5, 0.5, 0.5)]);
    let mut best = 0.0_f64;
    while let Some(s) = heap.pop() {
        best = best.max(s.r);
        if s.bound <= best * (1.0 + TOLERANCE) {
            break;
        }
        let q = s.half / 2.0;
        for (dx, dy) in [(-q, -q), (q, -q), (-q, q), (q, q)] {
            let part = square(s.x + dx, s.y + dy, q);
            best = best.max(part.r);
            if part.bound > best * (1.0 + TOLERANCE) {
                heap.push(part);
            }
        }
    }
    2.0 * best * longest
}

#[derive(Clone, Copy)]
struct Square {
    /// No point of the square has a larger radius.
    bound: f64,
    r: f64,
    x: f64,
    y: f64,
    half: f64,
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Square {}

/// Points of the square from -1 to 1 in square cells, so that the nearest is found among few.
struct Samples {
    /// Number of cells along each side.
    side: usize,
    /// The points cell by cell, and the place of the first point of each cell (and of the end).
    points: Vec<[f64; 2]>,
    first: Vec<usize>,
}

impl Samples {
    fn new(points: &[[f64; 2]]) -> Self {
        // About as many cells as points.
        let side = (points.len() as f64).sqrt().ceil() as usize;
        let cells: Vec<usize> = points.iter().map(|p| cell(p[1], side) * side + cell(p[0], side)).collect();
        let mut first = vec![0; side * side + 1];
        cells.iter().for_each(|c| first[c + 1] += 1);
        for c in 0..side * side {
            first[c + 1] += first[c];
        }
        let (mut next, mut sorted) = (first.clone(), vec![[0.0; 2]; points.len()]);
        for (c, p) in cells.iter().zip(points) {
            sorted[next[*c]] = *p;
            next[*c] += 1;
        }
        Self { side, points: sorted, first }
    }

    /// Distance of the nearest point.
    fn nearest(&self, x: f64, y: f64) -> f64 {
        let (i, j, side) = (cell(x, self.side) as i64, cell(y, self.side) as i64, self.side as i64);
        let width = 2.0 / self.side as f64;
        let mut best = f64::INFINITY;
        for ring in 0..side {
            // Points in the cells of this ring are at least ring - 1 cells away.
            if best <= (ring - 1) as f64 * width {
                break;
            }
            let mut look = |i: i64, j: i64| {
                if (0..side).contains(&i) && (0..side).contains(&j) {
                    let c = (j * side + i) as usize;
                    for p in &self.points[self.first[c]..self.first[c + 1]] {
                        best = best.min((p[0] - x).hypot(p[1] - y));
                    }
                }
            };
            for k in -ring..=ring {
                look(i + k, j - ring);
                if ring > 0 {
                    look(i + k, j + ring);
                    if k.abs() < ring {
                        look(i - ring, j + k);
                        look(i + ring, j + k);
                    }
                }
            }
        }
        best
    }
}

/// The cell of a coordinate from -1 to 1.
fn cell(v: f64, side: usize) -> usize {
    (((v + 1.0) / 2.0 * side as f64).max(0.0) as usize).min(side - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hole_of_one_baseline_is_the_whole_disc() {
        // Two antennas, baseline b: circles within the disc of b beside the line of the two samples. The largest touches both samples and the
        // opposite side: it has the middle (0, y) with b - y = sqrt(b^2 + y^2), so y = 0 and the radius b.
        let pair = Plane { views: vec![vec![[0.0, 0.0], [3.0, 0.0]]] };
        assert!((diameter(&pair) - 6.0).abs() < 0.01, "{}", diameter(&pair));
    }

    #[test]
    fn no_point_of_a_fine_grid_has_a_larger_hole() {
        let plane = Plane { views: vec![(0..12).map(|k| [f64::from(k * k * 7 % 23), f64::from(k * 5 % 17) * 1.3]).collect()] };
        let found = diameter(&plane) / 2.0;
        let (longest, n) = (plane.longest(), 300);
        let mut best = 0.0_f64;
        for i in -n..=n {
            for j in 0..=n {
                let (x, y) = (f64::from(i) / f64::from(n) * longest, f64::from(j) / f64::from(n) * longest);
                let nearest =
                    plane.pairs().flat_map(|[u, v]| [(u - x).hypot(v - y), (u + x).hypot(v + y)]).fold(longest - x.hypot(y), f64::min);
                best = best.max(nearest);
            }
        }
        // Grid points lie within 0.7 of a step of the best place.
        assert!(found >= best * (1.0 - 1.1e-3) && found <= best + 0.75 * longest / f64::from(n), "{found} {best}");
    }
}
