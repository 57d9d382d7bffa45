//! What errors of antennas explain of the residuals.
//!
//! Where the gains of antennas p and q are 1 + a_p + i f_p and 1 + a_q + i f_q, a visibility of the model M is (1 + a_p + a_q + i (f_p - f_q)) M to first order. The residuals along
//! the model tell the amplitudes a, and those across it the phases f, of each integration, by least squares. A common amplitude of all antennas is no error of
//! calibration: the image has the wrong flux. What it explains is not counted.

use super::samples::{Sample, Samples};
use crate::linalg::{Cholesky, Matrix, dot};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// An integration is left out if it has fewer baselines for each antenna.
const FEWEST_BASELINES: usize = 2;
/// The part of the mean diagonal that is added to it, so that antennas without a signal have no error, and a common phase is 0.
const RIDGE: f64 = 1e-6;

/// What errors of antennas explain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AntennaErrors {
    /// Their amplitudes.
    pub amplitudes: Explained,
    /// Their phases, rad.
    pub phases: Explained,
}

/// What errors of one kind explain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Explained {
    /// The part that they explain of the power of the residuals beyond noise.
    pub share: f64,
    /// Their standard deviation.
    pub sigma: f64,
}

/// Sums of one kind of errors over one integration, or over several.
#[derive(Default, Clone, Copy)]
struct Sums {
    power: f64,
    squares: f64,
    antennas: usize,
}

impl AntennaErrors {
    /// From samples whose residuals have so much power beyond noise, in the unit of [`Sample::misfit`].
    pub(super) fn of(samples: &Samples, beyond_noise: f64) -> Self {
        let integrations: Vec<&[Sample]> = samples.iter().flat_map(|list| integrations(list)).collect();
        let of_each: Vec<[Sums; 2]> = integrations.par_iter().map(|samples| explained(samples)).collect();
        let [amplitudes, phases] = [0, 1].map(|kind| {
            let sum = of_each.iter().map(|sums| sums[kind]).fold(Sums::default(), |a, b| Sums {
                power: a.power + b.power,
                squares: a.squares + b.squares,
                antennas: a.antennas + b.antennas,
            });
            if sum.antennas == 0 || !(beyond_noise > 0.0) {
                return Explained::default();
            }
            Explained { share: sum.power / beyond_noise, sigma: (sum.squares / sum.antennas as f64).sqrt() }
        });
        Self { amplitudes, phases }
    }

    /// The part that both explain of the power of the residuals beyond noise.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.amplitudes.share + self.phases.share
    }
}

/// Samples in the order of time, cut where a baseline comes again.
fn integrations(list: &[Sample]) -> Vec<&[Sample]> {
    let (mut all, mut met, mut start, mut end) = (Vec::new(), BTreeSet::new(), 0, 0);
    // The samples of a row follow each other.
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

/// What amplitudes and phases of one integration explain, beyond a common one and beyond chance.
fn explained(samples: &[Sample]) -> [Sums; 2] {
    // Of each baseline the power of the model, and the residuals along the model and across it.
    let mut baselines: BTreeMap<[u32; 2], [f64; 3]> = BTreeMap::new();
    for row in samples.chunk_by(|a, b| a.pair == b.pair) {
        let sums = baselines.entry(row[0].pair).or_default();
        for s in row {
            sums.iter_mut().zip([s.model2, s.along, s.across]).for_each(|(sum, v)| *sum += s.weight * v);
        }
    }
    let antennas: Vec<u32> = baselines.keys().flatten().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let n = antennas.len();
    if baselines.len() < FEWEST_BASELINES * n {
        return Default::default();
    }
    let place = |antenna: u32| antennas.binary_search(&antenna).unwrap_or(0);
    let baselines: Vec<([usize; 2], [f64; 3])> = baselines.into_iter().map(|(pair, sums)| (pair.map(place), sums)).collect();
    // A phase of the second antenna counts the other way.
    let Some([amplitudes, phases]) = solved(&baselines, n, (1, 1.0)).zip(solved(&baselines, n, (2, -1.0))).map(|(a, f)| [a, f]) else {
        return Default::default();
    };
    let total = |k: usize| baselines.iter().map(|(_, sums)| sums[k]).sum::<f64>();
    let mean = 0.5 * total(1) / total(0);
    let common = mean * total(1);
    // Misfits are half of weighted squares.
    let own = [0.5 * amplitudes.1 - common, 0.5 * phases.1];
    // Each number that is fitted explains by chance as much as each of the real and imaginary parts has left.
    let left = samples.iter().map(Sample::misfit).sum::<f64>() - common - own[0] - own[1];
    let by_chance = left.max(0.0) / (2 * samples.len() - (2 * n - 1)) as f64;
    let sums = |own: f64, errors: &[f64], mean: f64| Sums {
        power: own - (n - 1) as f64 * by_chance,
        squares: errors.iter().map(|e| (e - mean).powi(2)).sum(),
        antennas: n,
    };
    [sums(own[0], &amplitudes.0, mean), sums(own[1], &phases.0, 0.0)]
}

/// The errors of one kind of `n` antennas, and twice the misfit that they explain. `of` is the place of the residuals among the sums of a baseline, and `sign` that of
/// the second antenna.
fn solved(baselines: &[([usize; 2], [f64; 3])], n: usize, (of, sign): (usize, f64)) -> Option<(Vec<f64>, f64)> {
    let (mut matrix, mut right, mut whole) = (Matrix::zeros(n, n), vec![0.0; n], 0.0);
    for ([p, q], sums) in baselines {
        let (model, left) = (sums[0], sums[of]);
        matrix[(*p, *p)] += model;
        matrix[(*q, *q)] += model;
        matrix[(*p, *q)] += sign * model;
        matrix[(*q, *p)] += sign * model;
        right[*p] += left;
        right[*q] += sign * left;
        whole += model;
    }
    let ridge = RIDGE * 2.0 * whole / n as f64;
    (0..n).for_each(|k| matrix[(k, k)] += ridge);
    let errors = Cholesky::new(&matrix)?.solve(&right);
    let explained = dot(&errors, &right);
    Some((errors, explained))
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
            model2: model.norm_sqr(),
            along: (left * model.conj()).re,
            across: (left * model.conj()).im,
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
    fn amplitudes_and_phases_are_told_from_each_other_and_from_a_wrong_flux() {
        let of = |noise: f64, gain: &dyn Fn(u32, u32) -> Complex64| {
            let (samples, beyond) = samples(noise, gain);
            AntennaErrors::of(&samples, beyond)
        };
        let spread = |p: u32, t: u32| 0.1 * f64::from((7 * p + 5 * t) % 12) / 12.0;
        let found = of(0.0, &|p, t| Complex64::from(1.0 + spread(p, t))).amplitudes;
        assert!(found.share > 0.1 && found.share < 1.0 && (found.sigma - 0.0288).abs() < 0.003, "{found:?}");
        // Their mean is a wrong flux, which the image can have.
        let centered = |p: u32, t: u32| Complex64::from(1.0 + spread(p, t) - 0.0458);
        let found = of(0.0, &centered);
        assert!((found.amplitudes.share - 1.0).abs() < 0.02 && found.phases.share.abs() < 0.01, "{found:?}");
        assert!(of(0.0, &|_, _| Complex64::from(1.2)).share() < 1e-3);
        let phases = |p: u32, t: u32| Complex64::from_polar(1.0, spread(p, t));
        let found = of(0.0, &phases);
        assert!((found.phases.share - 1.0).abs() < 0.02 && (found.phases.sigma - 0.0288).abs() < 0.001, "{found:?}");
        assert!(found.amplitudes.share.abs() < 0.01, "{found:?}");
        for found in [of(0.1, &centered).amplitudes, of(0.1, &phases).phases] {
            assert!((found.share - 1.0).abs() < 0.1, "{found:?}");
        }
        let none = of(1.0, &|_, _| Complex64::from(1.0));
        assert!(none.amplitudes.sigma < 0.05 && none.phases.sigma < 0.05, "{none:?}");
    }

    /// A source that the model lacks is not taken for errors of antennas.
    #[test]
    fn a_missing_source_is_no_error_of_antennas() {
        let (mut all, _) = samples(0.0, |_, _| Complex64::from(1.0));
        for s in &mut all[0] {
            let [p, q] = s.pair.map(f64::from);
            let model = Complex64::new(s.model2.sqrt(), 0.0);
            let missing = Complex64::from_polar(3.0, (p * p - q * q) * 0.71 + 0.4 * (p - q));
            *s = sample(s.pair, model, model + missing);
        }
        let power = all[0].iter().map(Sample::misfit).sum();
        let found = AntennaErrors::of(&all, power);
        assert!(found.share() < 0.4, "{found:?}");
    }

    #[test]
    fn an_integration_ends_where_a_baseline_comes_again() {
        let (samples, _) = samples(0.0, |_, _| Complex64::from(1.0));
        let found = integrations(&samples[0]);
        assert_eq!(found.iter().map(|part| part.len()).collect::<Vec<_>>(), [66; 3]);
    }
}
