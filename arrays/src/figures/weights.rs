//! Weights of baselines by the density of the u-v plane, as in imaging.
//!
//! # Reference
//! Briggs 1995, PhD thesis, New Mexico Tech, ch. 3.

use crate::Weighting;
use std::collections::HashMap;

/// The weight of each baseline (u, v in wavelengths), with the sum 1. Let W be the number of baselines in a cell, where a baseline and its
/// opposite are one:
/// natural 1; uniform 1 / W; Briggs 1 / (1 + W f^2) with f^2 = (5 10^-R)^2 / (sum of W^2 over cells / number of baselines).
pub(super) fn of(uv: &[[f64; 2]], weighting: Weighting, robust: f64, cell: f64) -> Vec<f64> {
    let keys: Vec<[i64; 2]> = uv.iter().map(|p| folded(p.map(|v| (v / cell).round() as i64))).collect();
    let mut density: HashMap<[i64; 2], f64> = HashMap::new();
    keys.iter().for_each(|k| *density.entry(*k).or_default() += 1.0);
    // In the order of the baselines: the order of the cells of a hash map changes from run to run, and with it the rounding.
    let squares: f64 = keys.iter().map(|k| density[k]).sum();
    let f2 = (5.0 * 10_f64.powf(-robust)).powi(2) / (squares / uv.len() as f64);
    let weight = |k: &[i64; 2]| match weighting {
        Weighting::Natural => 1.0,
        Weighting::Uniform => 1.0 / density[k],
        Weighting::Briggs => 1.0 / (1.0 + density[k] * f2),
    };
    let weights: Vec<f64> = keys.iter().map(weight).collect();
    let total: f64 = weights.iter().sum();
    weights.iter().map(|w| w / total).collect()
}

/// The same cell for a baseline and its opposite.
fn folded([u, v]: [i64; 2]) -> [i64; 2] {
    if v < 0 || (v == 0 && u < 0) { [-u, -v] } else { [u, v] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_squares_over_cells_is_the_sum_of_densities_over_baselines() {
        // Three baselines in one cell (one of them the opposite way), one alone.
        let uv = [[10.1, 0.2], [-10.2, 0.1], [9.9, -0.3], [0.0, 25.0]];
        assert_eq!(of(&uv, Weighting::Natural, 0.0, 1.0), [0.25; 4]);
        let uniform = of(&uv, Weighting::Uniform, 0.0, 1.0);
        assert!((uniform[3] - 0.5).abs() < 1e-15 && (uniform[0] - 1.0 / 6.0).abs() < 1e-15, "{uniform:?}");
        // Sum of W^2 is 9 + 1, so f^2 = 25 / 2.5 = 10 at R = 0: weights 1 / 31 and 1 / 11.
        let briggs = of(&uv, Weighting::Briggs, 0.0, 1.0);
        assert!((briggs[3] / briggs[0] - 31.0 / 11.0).abs() < 1e-12, "{briggs:?}");
        for (robust, like) in [(-9.0, uniform), (9.0, vec![0.25; 4])] {
            let briggs = of(&uv, Weighting::Briggs, robust, 1.0);
            assert!(briggs.iter().zip(&like).all(|(a, b)| (a - b).abs() < 1e-12), "{briggs:?} {like:?}");
        }
    }
}
