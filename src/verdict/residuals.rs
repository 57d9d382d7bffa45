//! The residual visibilities of a fit, and how they are distributed over antennas and samples.

use super::antenna_errors::AntennaErrors;
use super::samples::{Sample, Samples, look, rows_looked_at};
use crate::Result;
use crate::calibrate::ModelVisibilities;
use crate::mem::HandsNoise;
use cittert_arrays::VisibilitySource;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A sample is an outlier if its squared residual exceeds the median of its baseline by this factor. Noise, whose squared modulus is
/// distributed exponentially, does so with a probability of 2^-50.
pub(super) const OUTLIER: f64 = 50.0;
/// Baselines with fewer samples have no median that one sample could be compared with.
const FEWEST: usize = 8;
/// The median of an exponential distribution with mean 1.
const MEDIAN: f64 = std::f64::consts::LN_2;

/// Statistics of residual visibilities. Squares are in units of the noise, w |V - M|^2 / 2, if the noise is known, and else in units of the
/// weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Number of visibilities. Two parallel hands count as one.
    pub samples: usize,
    /// True if the noise is known: 1 is then the expected value of the squares.
    pub noise_known: bool,
    /// Mean square.
    pub mean: f64,
    /// Mean square that the median suggests. Few outliers do not change it.
    pub typical: f64,
    /// Fraction of the power of the data, beyond noise where that is known, that the model leaves.
    pub unexplained: f64,
    /// Power of the data over that of the noise, or infinite where the noise is not known.
    pub signal: f64,
    /// Fraction of the samples that stand out of their baseline.
    pub outliers: f64,
    /// Typical square of the baselines of each antenna in terms of other baselines of about their length, largest first \[antenna, ratio\].
    pub antennas: Vec<(usize, f64)>,
    /// Mean amplitude of the data, in their unit.
    pub mean_amplitude: f64,
    /// Amplitude of the data on the shortest baselines without noise, and that of the model there, in the unit of the data.
    pub shortest: (f64, f64),
    /// Lengths in wavelengths of the shortest baselines, and slope of ln |V|^2 against the squared length there.
    pub decay: (f64, f64),
    /// What one spectral index of all sources explains of the residuals.
    pub spectrum: Spectrum,
    /// What amplitudes and phases of the antennas explain of the residuals.
    pub errors: AntennaErrors,
}

/// The spectral index of a model whose fluxes are those of the middle of the band, as the residuals tell it: V - M = index M (nu - nu0) / nu0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// The index: fluxes grow as nu^index.
    pub index: f64,
    /// The part that it explains of the power of the residuals beyond noise.
    pub share: f64,
    /// Number of channels of the set.
    pub channels: usize,
}

impl Residuals {
    /// About so many rows of a set are looked at, of `per_row` visibilities each.
    #[must_use]
    pub fn rows(n_rows: usize, per_row: usize) -> usize {
        rows_looked_at(n_rows, per_row)
    }

    /// Compare a set with a model. Where the weights are only counts of samples, the noise comes from the difference of two parallel hands,
    /// if there are two. `None` if no visibility can be compared, and in all processes that share the set but the first.
    ///
    /// # Errors
    /// The data cannot be read, or the model cannot be evaluated.
    pub fn measure(data: &mut dyn VisibilitySource, model: &mut dyn ModelVisibilities) -> Result<Option<Self>> {
        let n_chan = data.header().spectrum.n_chan();
        let (mut samples, hands) = look(data, model)?;
        let HandsNoise { factor, weights_are_counts } = hands.noise();
        let noise = if weights_are_counts { factor.filter(|f| *f > 0.0) } else { Some(1.0) };
        if let Some(noise) = noise {
            samples.iter_mut().flatten().for_each(|s| s.weight /= noise);
        }
        Ok((!samples.is_empty()).then(|| Self::of(&samples, noise.is_some(), n_chan)))
    }

    /// Amplitude at zero spacing of a Gaussian that decays over the shortest baselines as the data do, in their unit.
    #[must_use]
    pub fn zero_spacing(&self) -> f64 {
        let (length, slope) = self.decay;
        self.shortest.0 * (-0.5 * slope * length * length).exp()
    }

    fn of(samples: &Samples, noise_known: bool, n_chan: usize) -> Self {
        let count: usize = samples.iter().map(Vec::len).sum();
        let n = count as f64;
        let sum = |f: fn(&Sample) -> f64| samples.iter().flatten().map(f).sum::<f64>();
        let ((antennas, outliers), ((shortest, decay), typical)) = rayon::join(
            || by_antenna(samples),
            || {
                let squares = || median(&mut listed(samples, count, Sample::misfit));
                rayon::join(|| short_baselines((samples, count), noise_known), squares)
            },
        );
        let (misfit, power) = rayon::join(|| sum(Sample::misfit), || sum(|s| 0.5 * s.weight * s.data2()));
        let floor = if noise_known { n.min(0.999 * power) } else { 0.0 };
        let (along, across) =
            rayon::join(|| sum(|s| 0.5 * s.weight * s.along * s.off), || sum(|s| 0.5 * s.weight * s.model2 * s.off * s.off));
        let spectrum = Spectrum {
            index: if across > 0.0 { along / across } else { 0.0 },
            share: if across > 0.0 && misfit > floor { along * along / across / (misfit - floor) } else { 0.0 },
            channels: n_chan,
        };
        Self {
            samples: count,
            noise_known,
            mean: misfit / n,
            typical: typical / MEDIAN,
            unexplained: ((misfit - floor).max(0.0) / (power - floor)).min(1e9),
            signal: if noise_known { (power / n - 1.0).max(0.0) } else { f64::INFINITY },
            outliers: outliers as f64 / n,
            antennas,
            mean_amplitude: sum(|s| s.data2().sqrt()) / n,
            shortest,
            decay,
            spectrum,
            errors: AntennaErrors::of(samples, misfit - floor),
        }
    }
}

/// The squares of a baseline.
struct Baseline {
    pair: [u32; 2],
    /// Mean of the squared lengths, wavelengths.
    length2: f64,
    squares: Vec<f64>,
}

/// The squares of antennas over those of the other antennas, largest first, and the number of samples that stand out of their baseline.
fn by_antenna(samples: &Samples) -> (Vec<(usize, f64)>, usize) {
    let mut baselines: BTreeMap<[u32; 2], (f64, Vec<f64>)> = BTreeMap::new();
    // The samples of a row follow each other, and belong to one baseline.
    for row in samples.iter().flat_map(|list| list.chunk_by(|a, b| a.pair == b.pair)) {
        let (length2, squares) = baselines.entry(row[0].pair).or_default();
        *length2 += row.iter().map(|s| s.length2).sum::<f64>();
        squares.extend(row.iter().map(Sample::misfit));
    }
    let mean = |(pair, (sum, squares)): ([u32; 2], (f64, Vec<f64>))| Baseline { pair, length2: sum / squares.len() as f64, squares };
    let mut baselines: Vec<Baseline> = baselines.into_iter().map(mean).collect();
    baselines.sort_by(|a, b| a.length2.total_cmp(&b.length2));
    let medians: Vec<(f64, usize)> = baselines
        .par_iter_mut()
        .map(|Baseline { squares, .. }| {
            let median = median(squares);
            let apart = if squares.len() >= FEWEST { squares.iter().filter(|x| **x > OUTLIER * median).count() } else { 0 };
            (median, apart)
        })
        .collect();
    let pairs: Vec<[u32; 2]> = baselines.iter().map(|b| b.pair).collect();
    let mut of_antenna: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (k, pair) in pairs.iter().enumerate() {
        pair.iter().for_each(|antenna| of_antenna.entry(*antenna).or_default().push(k));
    }
    let ratio = |antenna: u32, own: &[usize]| {
        let others = |k: usize| median(&mut alike(&pairs, antenna, k).map(|other| medians[other].0).collect::<Vec<_>>());
        median(&mut own.iter().map(|k| medians[*k].0 / others(*k)).filter(|ratio| ratio.is_finite()).collect::<Vec<_>>())
    };
    let compared: Vec<(u32, Vec<usize>)> = of_antenna.into_iter().filter(|(_, own)| own.len() > 3).collect();
    let ratios = compared.par_iter().map(|(antenna, own)| (*antenna as usize, ratio(*antenna, own)));
    let mut antennas: Vec<(usize, f64)> = ratios.filter(|(_, ratio)| ratio.is_finite()).collect();
    antennas.sort_by(|a, b| b.1.total_cmp(&a.1));
    (antennas, medians.iter().map(|m| m.1).sum())
}

/// Baselines that one is compared with on either side of its length. What an image does not hold leaves more on long baselines than on short ones, or the other
/// way round, and is no fault of an antenna that has only the one or the other.
const ALIKE: usize = 12;

/// The baselines without an antenna whose lengths lie next to that of baseline `at`. The baselines are in the order of their lengths.
fn alike(pairs: &[[u32; 2]], antenna: u32, at: usize) -> impl Iterator<Item = usize> {
    let without = move |k: &usize| !pairs[*k].contains(&antenna);
    (0..at).rev().filter(without).take(ALIKE).chain((at + 1..pairs.len()).filter(without).take(ALIKE))
}

/// What `of` gives of each of `count` samples.
fn listed<'s, T>(samples: &'s Samples, count: usize, of: impl Fn(&'s Sample) -> T) -> Vec<T> {
    let mut all = Vec::with_capacity(count);
    all.extend(samples.iter().flatten().map(of));
    all
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { f64::NAN } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Amplitudes of data and model on the shortest twentieth of the samples, and how the data decay from there to the shortest fifth.
fn short_baselines((samples, count): (&Samples, usize), noise_known: bool) -> ((f64, f64), (f64, f64)) {
    let mut order = listed(samples, count, |s| s);
    let part = (order.len() / 20).max(1);
    // Only what lies below these ranks is needed, in any order.
    let mut known = order.len();
    for rank in [4 * part, 3 * part, part].into_iter().filter(|rank| *rank < count) {
        order[..known].select_nth_unstable_by(rank, |a, b| a.length2.total_cmp(&b.length2));
        known = rank;
    }
    // The noise adds 2 / weight to the squared amplitude.
    let noise = |s: &&Sample| if noise_known { 2.0 / s.weight } else { 0.0 };
    let mean = |of: &[&Sample], f: &dyn Fn(&&Sample) -> f64| of.iter().map(f).sum::<f64>() / of.len() as f64;
    let squared = |of: &[&Sample]| mean(of, &|s| s.data2() - noise(s)).max(0.0);
    let near = &order[..part];
    let far = &order[(3 * part).min(order.len() - 1)..(4 * part).clamp(1, order.len())];
    let (length2, further) = (mean(near, &|s| s.length2), if far.is_empty() { f64::NAN } else { mean(far, &|s| s.length2) });
    let shortest = (squared(near).sqrt(), mean(near, &|s| s.model2).sqrt());
    let slope = if far.is_empty() || further <= length2 { 0.0 } else { (squared(far) / squared(near)).ln() / (further - length2) };
    (shortest, (length2.sqrt(), slope))
}
