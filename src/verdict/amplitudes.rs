//! What the amplitudes of antennas explain of the residuals.
//!
//! Where the gains of antennas p and q have amplitudes 1 + a_p and 1 + a_q, a visibility of the model M is (1 + a_p + a_q) M to first order, and the
//! residual is (a_p + a_q) M. The a of each integration follow by least squares from the residuals along the model. A common amplitude of all antennas is no
//! error of calibration: the image has the wrong flux. What it explains is not counted.

use super::samples::{Sample, Samples};
use crate::linalg::{Cholesky, Matrix};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// An integration is left out if it has fewer baselines for each antenna.
const FEWEST_BASELINES: usize = 2;
/// The part of the mean diagonal that is added to it, so that antennas without a signal have no amplitude.
const RIDGE: f64 = 1e-6;

/// What amplitudes of antennas explain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amplitudes {
    /// The part that they explain of the power of the residuals beyond noise.
    pub share: f64,
    /// Their standard deviation.
    pub sigma: f64,
}

/// Sums over one integration, or over several.
#[derive(Default, Clone, Copy)]
struct Explained {
    power: f64,
    squares: f64,
    antennas: usize,
}

impl Amplitudes {
    /// From samples whose residuals have so much power beyond noise, in the unit of [`Sample::misfit`].
    pub(super) fn of(samples: &Samples, beyond_noise: f64) -> Self {
        let integrations: Vec<&[Sample]> = samples.iter().flat_map(|list| integrations(list)).collect();
        let of_all: Vec<Explained> = integrations.par_iter().map(|samples| explained(samples)).collect();
        let sum = of_all.iter().fold(Explained::default(), |a, b| Explained {
            power: a.power + b.power,
            squares: a.squares + b.squares,
            antennas: a.antennas + b.antennas,
        });
        if sum.antennas == 0 || !(beyond_noise > 0.0) {
            return Self::default();
        }
        Self { share: sum.power / beyond_noise, sigma: (sum.squares / sum.antennas as f64).sqrt() }
    }
}

/// Samples in the order of time, cut where a baseline comes again.
fn integrations(list: &[Sample]) -> Vec<&[Sample]> {
    let (mut all, mut met, mut start, mut end) = (Vec::new(), BTreeSet::new(), 0, 0);
    for row in list.chunk_by(|a, b| a.pair == b.pair) {
        if !met.insert(row[0].pair) {
            all.push(&list[start..end]);
            met = BTreeSet::from([row[0].pair]);
            start = end;
        }
        end += row.len();
    }
    all.push(&list[start..end]);
    all
}

/// What the amplitudes of one integration explain, beyond a common one and beyond chance.
fn explained(samples: &[Sample]) -> Explained {
    let mut baselines: BTreeMap<[u32; 2], [f64; 2]> = BTreeMap::new();
    // The samples of a row follow each other.
    for row in samples.chunk_by(|a, b| a.pair == b.pair) {
        let [model, along] = baselines.entry(row[0].pair).or_default();
        *model += row.iter().map(|s| s.weight * s.model2).sum::<f64>();
        *along += row.iter().map(|s| s.weight * s.along).sum::<f64>();
    }
    let antennas: Vec<u32> = baselines.keys().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let n = antennas.len();
    if baselines.len() < FEWEST_BASELINES * n {
        return Explained::default();
    }
    let (mut matrix, mut right) = (Matrix::zeros(n, n), vec![0.0; n]);
    let place = |antenna: u32| antennas.binary_search(&antenna).unwrap_or(0);
    let mut whole = [0.0; 2];
    for (pair, [model, along]) in &baselines {
        let [p, q] = pair.map(place);
        for (i, j) in [(p, p), (q, q), (p, q), (q, p)] {
            matrix[(i, j)] += model;
        }
        right[p] += along;
        right[q] += along;
        whole = [whole[0] + model, whole[1] + along];
    }
    let ridge = RIDGE * 2.0 * whole[0] / n as f64;
    (0..n).for_each(|k| matrix[(k, k)] += ridge);
    let Some(factor) = Cholesky::new(&matrix) else { return Explained::default() };
    let amplitudes = factor.solve(&right);
    let mean = 0.5 * whole[1] / whole[0];
    // Misfits are half of weighted squares.
    let common = mean * whole[1];
    let own = 0.5 * amplitudes.iter().zip(&right).map(|(a, b)| a * b).sum::<f64>() - common;
    // Each number that is fitted explains by chance as much as each of the real and imaginary parts has left.
    let left = samples.iter().map(Sample::misfit).sum::<f64>() - common - own;
    let by_chance = left.max(0.0) / (2 * samples.len() - n) as f64;
    let power = own - (n - 1) as f64 * by_chance;
    Explained { power, squares: amplitudes.iter().map(|a| (a - mean).powi(2)).sum(), antennas: n }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// A sample of unit weight of this model and data.
    fn sample(pair: [u32; 2], model: Complex64, data: Complex64) -> Sample {
        let left = data - model;
        Sample {
            pair,
            length2: 1.0,
            weight: 1.0,
            left2: left.norm_sqr(),
            data2: data.norm_sqr(),
            model2: model.norm_sqr(),
            along: (left * model.conj()).re,
            off: 0.0,
        }
    }

    /// Twelve antennas at three times; `gain` is that of an antenna at a time.
    fn samples(noise: f64, gain: impl Fn(u32, u32) -> Complex64) -> (Samples, f64) {
        let mut random = crate::fixtures::Noise(11);
        let mut all = Vec::new();
        for t in 0..3 {
            for p in 0..12 {
                for q in p + 1..12 {
                    let model = Complex64::from_polar(10.0, f64::from(p * q + t));
                    let off = Complex64::new(random.next(), random.next()) * noise;
                    all.push(sample([p, q], model, gain(p, t) * gain(q, t).conj() * model + off));
                }
            }
        }
        let misfit = all.iter().map(Sample::misfit).sum::<f64>() - noise * noise * all.len() as f64;
        (vec![all], misfit)
    }

    #[test]
    fn amplitudes_are_told_from_a_wrong_flux_phases_and_noise() {
        let of = |noise: f64, gain: &dyn Fn(u32, u32) -> Complex64| {
            let (samples, beyond) = samples(noise, gain);
            Amplitudes::of(&samples, beyond)
        };
        let errors = |p: u32, t: u32| Complex64::from(1.0 + 0.1 * f64::from((7 * p + 5 * t) % 12) / 12.0);
        let found = of(0.0, &errors);
        assert!(found.share > 0.1 && found.share < 1.0 && (found.sigma - 0.0288).abs() < 0.003, "{found:?}");
        // Their mean is a wrong flux, which the image can have.
        let centered = |p: u32, t: u32| errors(p, t) - 0.0458;
        let found = of(0.0, &centered);
        assert!(found.share > 0.98 && found.share < 1.02, "{found:?}");
        assert!(of(0.0, &|_, _| Complex64::from(1.2)).share < 1e-3);
        assert!(of(0.0, &|p, t| Complex64::from_polar(1.0, 0.3 * errors(p, t).re * f64::from(p % 5))).share < 0.3);
        assert!(of(0.1, &centered).share > 0.9);
        assert!(of(1.0, &|_, _| Complex64::from(1.0)).sigma < 0.05);
    }

    #[test]
    fn an_integration_ends_where_a_baseline_comes_again() {
        let (samples, _) = samples(0.0, |_, _| Complex64::from(1.0));
        let found = integrations(&samples[0]);
        assert_eq!(found.iter().map(|part| part.len()).collect::<Vec<_>>(), [66; 3]);
    }
}
