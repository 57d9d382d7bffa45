//! The residual visibilities of a fit, and how they are distributed over antennas and samples.

use crate::Result;
use crate::calibrate::{ModelVisibilities, sees_unpolarized};
use crate::mem::{HandsNoise, HandsSum};
use crate::memory::MemoryBudget;
use cittert_arrays::{Polarization, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::Array3;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// About so many visibilities are looked at. A larger set is sampled in runs of rows, so that the verdict costs little beside the fit.
const MOST: usize = 1 << 20;
/// Size in bytes of a visibility, its weight, its number of samples, its flag and its prediction.
const BYTES_PER_SAMPLE: usize = 25;
/// Values whose samples are made together.
const TOGETHER: usize = 1 << 16;
/// Number of runs of rows of a set that is sampled.
const RUNS: usize = 64;
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
    /// Typical square of each antenna in terms of that of all baselines, largest first \[antenna, ratio\].
    pub antennas: Vec<(usize, f64)>,
    /// Mean amplitude of the data, in their unit.
    pub mean_amplitude: f64,
    /// Amplitude of the data on the shortest baselines without noise, and that of the model there, in the unit of the data.
    pub shortest: (f64, f64),
    /// Lengths in wavelengths of the shortest baselines, and slope of ln |V|^2 against the squared length there.
    pub decay: (f64, f64),
    /// What one spectral index of all sources explains of the residuals.
    pub spectrum: Spectrum,
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

/// The visibilities of a set in lists of a few megabytes, which find a place in the memory that the image has left.
type Samples = Vec<Vec<Sample>>;

/// One visibility.
#[derive(Debug, Clone, Copy)]
struct Sample {
    pair: (u32, u32),
    /// Squared length, wavelengths.
    length2: f64,
    weight: f64,
    /// Squared moduli of residual, data and model.
    left2: f64,
    data2: f64,
    model2: f64,
    /// Real part of the residual times the conjugate of the model.
    along: f64,
    /// Offset from the middle of the band, over its frequency.
    off: f64,
}

impl Sample {
    /// The squared residual in units of the noise of a real part, halved: 1 is expected.
    fn misfit(&self) -> f64 {
        0.5 * self.weight * self.left2
    }
}

/// The rows that are looked at.
fn runs(n_rows: usize, per_row: usize, block: usize) -> Vec<Range<usize>> {
    let total = n_rows.saturating_mul(per_row);
    let (count, length) = if total <= MOST { (1, n_rows) } else { (RUNS, (MOST / per_row.max(1) / RUNS).max(1)) };
    let step = n_rows / count;
    (0..count)
        .flat_map(|k| {
            let (from, to) = (k * step, (k * step + length).min(n_rows));
            (from..to).step_by(block.max(1)).map(move |first| first..(first + block.max(1)).min(to))
        })
        .collect()
}

impl Residuals {
    /// About so many rows of a set are looked at, of `per_row` visibilities each.
    #[must_use]
    pub fn rows(n_rows: usize, per_row: usize) -> usize {
        n_rows.min((MOST / per_row.max(1)).max(RUNS))
    }

    /// Compare a set with a model. Where the weights are only counts of samples, the noise comes from the difference of two parallel hands,
    /// if there are two. `None` if no visibility can be compared.
    ///
    /// # Errors
    /// The data cannot be read, or the model cannot be evaluated.
    pub fn measure(data: &mut dyn VisibilitySource, model: &mut dyn ModelVisibilities) -> Result<Option<Self>> {
        let header = data.header().clone();
        let (n_chan, n_pol) = (header.spectrum.n_chan(), header.polarizations.len());
        let rows_at_once = MemoryBudget::default().block() / (n_chan * n_pol * BYTES_PER_SAMPLE).max(1);
        let all = runs(data.n_rows(), n_chan * n_pol, rows_at_once);
        let (mut samples, mut hands) = (Samples::new(), HandsSum::new(&header));
        // Each block has sums of its own, which are added in the order of the blocks.
        let sum_of = |(_, block): &(usize, VisibilityBlock)| {
            let mut sum = HandsSum::new(&header);
            sum.add(block);
            sum
        };
        let mut blocks: Vec<(usize, VisibilityBlock)> = Vec::new();
        let mut rows_held = 0;
        for (k, rows) in all.iter().enumerate() {
            let block = data.read_rows(rows.clone())?;
            blocks.push((rows.start, block));
            rows_held += rows.len();
            let next = all.get(k + 1).map_or(usize::MAX, Range::len);
            if rows_held.saturating_add(next) > rows_at_once {
                let sums: Vec<HandsSum> = blocks.par_iter().map(sum_of).collect();
                sums.iter().for_each(|sum| hands.include(sum));
                add(&mut samples, &header, &blocks, model)?;
                blocks.clear();
                rows_held = 0;
            }
        }
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
        let (misfit, power) = rayon::join(|| sum(Sample::misfit), || sum(|s| 0.5 * s.weight * s.data2));
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
            mean_amplitude: sum(|s| s.data2.sqrt()) / n,
            shortest,
            decay,
            spectrum,
        }
    }
}

/// The squares of antennas over those of all antennas, largest first, and the number of samples that stand out of their baseline.
fn by_antenna(samples: &Samples) -> (Vec<(usize, f64)>, usize) {
    let mut baselines: BTreeMap<(u32, u32), Vec<f64>> = BTreeMap::new();
    // The samples of a row follow each other, and belong to one baseline.
    for row in samples.iter().flat_map(|list| list.chunk_by(|a, b| a.pair == b.pair)) {
        baselines.entry(row[0].pair).or_default().extend(row.iter().map(Sample::misfit));
    }
    let mut baselines: Vec<((u32, u32), Vec<f64>)> = baselines.into_iter().collect();
    let medians: Vec<(f64, usize)> = baselines
        .par_iter_mut()
        .map(|(_, squares)| {
            let median = median(squares);
            let apart = if squares.len() >= FEWEST { squares.iter().filter(|x| **x > OUTLIER * median).count() } else { 0 };
            (median, apart)
        })
        .collect();
    let mut of_antenna: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for ((pair, _), (median, _)) in baselines.iter().zip(&medians) {
        for antenna in [pair.0, pair.1] {
            of_antenna.entry(antenna).or_default().push(*median);
        }
    }
    let all = median(&mut of_antenna.values().flatten().copied().collect::<Vec<_>>());
    let mut antennas: Vec<(usize, f64)> = of_antenna
        .iter_mut()
        .filter(|(_, squares)| squares.len() > 3 && all > 0.0)
        .map(|(a, squares)| (*a as usize, median(squares) / all))
        .collect();
    antennas.sort_by(|a, b| b.1.total_cmp(&a.1));
    (antennas, medians.iter().map(|m| m.1).sum())
}

/// Add the samples of blocks, each with the index of its first row.
fn add(
    samples: &mut Samples,
    header: &VisibilityHeader,
    blocks: &[(usize, VisibilityBlock)],
    model: &mut dyn ModelVisibilities,
) -> Result<()> {
    let runs: Vec<(usize, &UvCoverage)> = blocks.iter().map(|(first, block)| (*first, &block.coverage)).collect();
    let predicted = model.predict_runs(header, &runs)?;
    blocks.iter().zip(&predicted).for_each(|((_, block), predicted)| add_block(samples, header, block, predicted));
    Ok(())
}

/// The other parallel hand of each product, where the set has it.
fn other_hands(polarizations: &[Polarization]) -> Vec<Option<usize>> {
    use Polarization::{LL, RR, XX, YY};
    let other = |p: &Polarization| match p {
        RR => Some(LL),
        LL => Some(RR),
        XX => Some(YY),
        YY => Some(XX),
        _ => None,
    };
    polarizations.iter().map(|p| other(p).and_then(|o| polarizations.iter().position(|q| *q == o))).collect()
}

/// The image is one of total intensity. So two parallel hands make one sample, their mean: what differs between them is polarisation, which such
/// an image does not have to explain.
fn add_block(samples: &mut Samples, header: &VisibilityHeader, block: &VisibilityBlock, predicted: &Array3<Complex32>) {
    let wide = |v: Complex32| Complex64::new(f64::from(v.re), f64::from(v.im));
    let freq_hz = header.spectrum.freq_hz();
    let middle_hz = freq_hz.iter().sum::<f64>() / freq_hz.len().max(1) as f64;
    let others = other_hands(&header.polarizations);
    let weight_of = |at: (usize, usize, usize)| {
        let weight = f64::from(block.usable_weight(at.0, at.1, at.2));
        if weight > 0.0 && predicted[at].is_finite() { weight } else { 0.0 }
    };
    let sample = |row: usize, c: usize, p: usize| {
        let pair = (block.coverage.ant1[row], block.coverage.ant2[row]);
        let own = weight_of((row, c, p));
        if pair.0 == pair.1 || own == 0.0 || !sees_unpolarized(header.polarizations[p]) {
            return None;
        }
        let (v, m) = (wide(block.vis[(row, c, p)]), wide(predicted[(row, c, p)]));
        let (v, m, weight) = match others[p].map(|q| (q, weight_of((row, c, q)))) {
            Some((q, w)) if w > 0.0 => {
                if q < p {
                    return None;
                }
                let mean = |a: Complex64, b: Complex32| 0.5 * (a + wide(b));
                // The mean has a quarter of the sum of the variances.
                (mean(v, block.vis[(row, c, q)]), mean(m, predicted[(row, c, q)]), 4.0 / (own.recip() + w.recip()))
            }
            _ => (v, m, own),
        };
        let uvw = block.coverage.uvw_m.row(row);
        let per_m = freq_hz[c] / cittert_arrays::SPEED_OF_LIGHT_M_S;
        Some(Sample {
            pair: (pair.0.min(pair.1), pair.0.max(pair.1)),
            length2: (uvw[0] * uvw[0] + uvw[1] * uvw[1]) * per_m * per_m,
            weight,
            left2: (v - m).norm_sqr(),
            data2: v.norm_sqr(),
            model2: m.norm_sqr(),
            along: ((v - m) * m.conj()).re,
            off: freq_hz[c] / middle_hz - 1.0,
        })
    };
    let (n_row, n_chan, n_pol) = block.vis.dim();
    let of_row = |row: usize| (0..n_chan).flat_map(move |c| (0..n_pol).map(move |p| (row, c, p)));
    let step = (TOGETHER / (n_chan * n_pol).max(1)).max(1);
    for first in (0..n_row).step_by(step) {
        let rows = first..(first + step).min(n_row);
        let list: Vec<Sample> = rows.into_par_iter().flat_map_iter(of_row).filter_map(|(row, c, p)| sample(row, c, p)).collect();
        samples.extend((!list.is_empty()).then_some(list));
    }
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
    let squared = |of: &[&Sample]| mean(of, &|s| s.data2 - noise(s)).max(0.0);
    let near = &order[..part];
    let far = &order[(3 * part).min(order.len() - 1)..(4 * part).clamp(1, order.len())];
    let (length2, further) = (mean(near, &|s| s.length2), if far.is_empty() { f64::NAN } else { mean(far, &|s| s.length2) });
    let shortest = (squared(near).sqrt(), mean(near, &|s| s.model2).sqrt());
    let slope = if far.is_empty() || further <= length2 { 0.0 } else { (squared(far) / squared(near)).ln() / (further - length2) };
    (shortest, (length2.sqrt(), slope))
}
