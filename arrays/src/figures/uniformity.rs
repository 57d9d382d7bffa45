//! How evenly baselines are spread over distances and over directions.
//!
//! With c baselines in each of K bins the figure is (sum of c)^2 / (K sum of c^2): 1 where all bins hold the same number, and 1 / K where one bin
//! holds all. M baselines at random places reach about 1 / (1 + K / M).
//!
//! # Reference
//! Jain, Chiu & Hawe 1984, DEC-TR-301 (the index).

use super::plane::Plane;
use std::f64::consts::PI;

/// Rings of equal area within the longest baseline.
const RINGS: usize = 10;
/// Sectors of 10 degrees over half a turn, as each baseline has its opposite.
const SECTORS: usize = 18;

/// Evenness over rings of equal area: 1 for a u-v disc of uniform density.
pub(super) fn radial(plane: &Plane) -> f64 {
    let area = plane.longest().powi(2);
    evenness::<RINGS>(plane.pairs().map(|[u, v]| (u * u + v * v) / area))
}

/// Evenness over directions.
pub(super) fn azimuthal(plane: &Plane) -> f64 {
    evenness::<SECTORS>(plane.pairs().filter(|p| *p != [0.0; 2]).map(|[u, v]| v.atan2(u).rem_euclid(PI) / PI))
}

/// Evenness of numbers from 0 to 1 over `K` bins.
fn evenness<const K: usize>(parts: impl Iterator<Item = f64>) -> f64 {
    let mut counts = [0.0; K];
    parts.for_each(|p| counts[((p * K as f64) as usize).min(K - 1)] += 1.0);
    let (sum, squares) = counts.iter().fold((0.0, 0.0), |(s, q), c| (s + c, q + c * c));
    sum * sum / (K as f64 * squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_is_1_for_equal_bins_and_1_over_k_for_one() {
        assert!((evenness::<10>((0..1000).map(|k| f64::from(k) / 1000.0)) - 1.0).abs() < 1e-12);
        assert!((evenness::<10>((0..1000).map(|_| 0.31)) - 0.1).abs() < 1e-12);
        // A line has one direction.
        let line = Plane { views: vec![(0..9).map(|k| [f64::from(k) - 4.0, 0.0]).collect()] };
        assert!((azimuthal(&line) - 1.0 / 18.0).abs() < 1e-12);
    }

    #[test]
    fn a_ring_covers_all_directions_and_crowds_at_the_edge() {
        let ring: Vec<[f64; 2]> = (0..36).map(|k| [(f64::from(k) * PI / 18.0).cos(), (f64::from(k) * PI / 18.0).sin()]).collect();
        let plane = Plane { views: vec![ring] };
        assert!(azimuthal(&plane) > 0.98, "{}", azimuthal(&plane));
        // Of the chords of a circle of diameter 1 the fraction 2 / pi asin(d) is shorter than d: most are short or long.
        let within = |k: usize| 2.0 / PI * (k as f64 / 10.0).sqrt().asin();
        let expected = 1.0 / (10.0 * (0..10).map(|k| (within(k + 1) - within(k)).powi(2)).sum::<f64>());
        assert!((radial(&plane) / expected - 1.0).abs() < 0.05, "{} {expected}", radial(&plane));
    }
}
