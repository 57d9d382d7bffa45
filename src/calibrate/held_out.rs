//! Baselines that no gain and no image is fitted to. How well they are predicted shows whether a self-calibration is to be believed.
//!
//! A self-calibration fits image and gains to the same data, so the fit to these data always improves, and so does the dynamic range. A
//! baseline that was left out is independent: image and gains of the other baselines predict it, and they predict it well only if both are
//! right. Its misfit is the sum of w |V - g1 conj(g2) M|^2 over the sum of w |V|^2, without the part of both that is noise.
//!
//! # Reference
//! Stone 1974, J. R. Stat. Soc. B 36, 111 (cross-validation); Wilcoxon 1945, Biometrics Bull. 1, 80 (signed ranks).

use super::apply::{ApplyOptions, Direction, GainApplier};
use super::model::ModelVisibilities;
use super::over_ranks::{Numbers, of_all};
use crate::memory::MemoryBudget;
use crate::random::stream;
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, Ranks, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block, found_shared};
use ndarray::{ArrayView3, Axis};
use num_complex::{Complex32, Complex64};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// How a self-calibration is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgeOptions {
    /// Fraction of the baselines that is held out; 0 for no judgement.
    pub fraction: f64,
    /// Fraction of its baselines that each antenna keeps at least.
    pub kept: f64,
    /// Seed of the choice of baselines.
    pub seed: u64,
    /// Standard deviations by which the held-out baselines must be predicted better.
    pub sigmas: f64,
    /// Largest misfit of the held-out baselines with which gains are accepted. A model that leaves more unexplained says nothing about gains.
    pub largest_misfit: f64,
    /// The fall of the misfit over the fall that gains of this size imply, if they are right: at least and at most. It does not count for a
    /// model with a misfit below `enough`, which is right itself.
    pub explained: (f64, f64),
    /// A candidate with a smaller misfit is good enough: no other one is tried.
    pub enough: f64,
    /// Take the best round even if the held-out baselines do not support it.
    pub force: bool,
}

impl Default for JudgeOptions {
    fn default() -> Self {
        Self { fraction: 0.15, kept: 0.7, seed: 1, sigmas: 2.3, largest_misfit: 0.4, explained: (0.25, 2.0), enough: 0.05, force: false }
    }
}

/// Fewer units than these allow no judgement.
const FEWEST: usize = 7;
/// Held-out rows that one thread compares with their prediction at a time.
const PART: usize = 256;
/// Units into which the held-out data are divided, if the set has several times.
const UNITS: usize = 12;

fn pair_of(ant1: u32, ant2: u32) -> (u32, u32) {
    (ant1.min(ant2), ant1.max(ant2))
}

/// The baselines that are held out.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    pairs: BTreeSet<(u32, u32)>,
    /// Number of baselines of the set.
    of: usize,
    /// First time, and length of the parts into which the times are divided, days.
    first_jd: f64,
    part_days: f64,
}

impl HeldOut {
    /// Choose baselines of the set at random, so that each antenna keeps at least `least` of its own; `None` where too few remain to judge
    /// by.
    ///
    /// # Errors
    /// The data cannot be read.
    pub fn draw(data: &mut dyn VisibilitySource, options: &JudgeOptions, least: usize) -> Result<Option<Self>> {
        if options.fraction == 0.0 {
            return Ok(None);
        }
        let mut seen: BTreeSet<(u32, u32)> = BTreeSet::new();
        let (mut first_jd, mut last_jd) = (f64::INFINITY, f64::NEG_INFINITY);
        let own = for_each_block(data, MemoryBudget::default().block(), |_, block| -> Result<()> {
            for row in 0..block.n_rows() {
                let (a, b) = (block.coverage.ant1[row], block.coverage.ant2[row]);
                let (_, n_chan, n_pol) = block.vis.dim();
                if a != b && (0..n_chan).any(|c| (0..n_pol).any(|p| block.usable_weight(row, c, p) > 0.0)) {
                    seen.insert(pair_of(a, b));
                    first_jd = first_jd.min(block.coverage.time_jd[row]);
                    last_jd = last_jd.max(block.coverage.time_jd[row]);
                }
            }
            Ok(())
        });
        let found = [first_jd, last_jd].into_iter().chain(seen.iter().flat_map(|(a, b)| [f64::from(*a), f64::from(*b)]));
        for numbers in of_all(&*data.ranks(), own.map(|()| found.collect()))? {
            let mut numbers = Numbers::of(&numbers);
            if let Some([first, last]) = numbers.next() {
                (first_jd, last_jd) = (first_jd.min(first), last_jd.max(last));
            }
            while let Some([a, b]) = numbers.next() {
                seen.insert((a as u32, b as u32));
            }
        }
        let mut degree: BTreeMap<u32, usize> = BTreeMap::new();
        for (a, b) in &seen {
            *degree.entry(*a).or_default() += 1;
            *degree.entry(*b).or_default() += 1;
        }
        let least: BTreeMap<u32, usize> =
            degree.iter().map(|(a, n)| (*a, ((options.kept * *n as f64).ceil() as usize).max(least))).collect();
        let mut order: Vec<(u32, u32)> = seen.iter().copied().collect();
        order.shuffle(&mut stream(options.seed, "held-out baselines", 0));
        let wanted = ((options.fraction * order.len() as f64).ceil() as usize).max(UNITS);
        let mut pairs = BTreeSet::new();
        for (a, b) in order {
            if pairs.len() < wanted && degree[&a] > least[&a] && degree[&b] > least[&b] {
                for ant in [a, b] {
                    degree.entry(ant).and_modify(|n| *n -= 1);
                }
                pairs.insert((a, b));
            }
        }
        if pairs.is_empty() {
            return Ok(None);
        }
        let parts = UNITS.div_ceil(pairs.len()) as f64;
        let held = Self { pairs, of: seen.len(), first_jd, part_days: ((last_jd - first_jd) / parts).max(f64::MIN_POSITIVE) };
        let units = held.pairs.len() * if last_jd > first_jd { parts as usize } else { 1 };
        Ok((units >= FEWEST).then_some(held))
    }

    /// Number of baselines.
    #[must_use]
    pub fn n_baselines(&self) -> usize {
        self.pairs.len()
    }

    /// The fraction of the baselines that is held out. It exceeds the fraction that was asked for where the set has few baselines.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        self.pairs.len() as f64 / self.of as f64
    }

    /// The rows that are held out.
    fn rows_of(&self, coverage: &UvCoverage) -> Vec<usize> {
        let held = |row: &usize| self.pairs.contains(&pair_of(coverage.ant1[*row], coverage.ant2[*row]));
        found_shared(0..coverage.n_rows(), 1, |rows, list| list.extend(rows.filter(held)))
    }

    /// Baseline and part of the time of a row.
    fn unit(&self, block: &VisibilityBlock, row: usize) -> (u32, u32, i64) {
        let (a, b) = pair_of(block.coverage.ant1[row], block.coverage.ant2[row]);
        (a, b, ((block.coverage.time_jd[row] - self.first_jd) / self.part_days).min(UNITS as f64) as i64)
    }
}

/// A set in which the held-out baselines are flagged.
pub struct Without<'a> {
    inner: &'a mut dyn VisibilitySource,
    held: Option<&'a HeldOut>,
}

impl<'a> Without<'a> {
    /// Flag the held-out rows of `inner`, if any are held out, as they are read.
    pub fn new(inner: &'a mut dyn VisibilitySource, held: Option<&'a HeldOut>) -> Self {
        Self { inner, held }
    }
}

impl VisibilitySource for Without<'_> {
    fn header(&self) -> &VisibilityHeader {
        self.inner.header()
    }

    fn n_rows(&self) -> usize {
        self.inner.n_rows()
    }

    fn ranks(&self) -> std::sync::Arc<dyn cittert_arrays::Ranks> {
        self.inner.ranks()
    }

    fn read_rows(&mut self, range: Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
        let mut block = self.inner.read_rows(range)?;
        for row in self.held.map_or_else(Vec::new, |h| h.rows_of(&block.coverage)) {
            block.flags.index_axis_mut(Axis(0), row).fill(true);
        }
        Ok(block)
    }
}

/// Sums over one baseline in one part of the time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sums {
    /// w |V - G M|^2.
    misfit: f64,
    /// w |V|^2.
    power: f64,
    /// w |G M - M|^2: the part of the prediction that the gains make.
    change: f64,
    /// Number of visibilities.
    samples: f64,
}

impl Sums {
    fn plus(self, b: &Self) -> Self {
        Self {
            misfit: self.misfit + b.misfit,
            power: self.power + b.power,
            change: self.change + b.change,
            samples: self.samples + b.samples,
        }
    }
}

/// Some rows of a block.
fn of_rows(block: &VisibilityBlock, rows: &[usize]) -> Result<VisibilityBlock> {
    Ok(VisibilityBlock {
        coverage: block.coverage.select(rows)?,
        vis: block.vis.select(Axis(0), rows),
        weights: block.weights.select(Axis(0), rows),
        flags: block.flags.select(Axis(0), rows),
        nsamples: block.nsamples.select(Axis(0), rows),
    })
}

/// The sums of each unit: baseline and part of the time.
type Units = BTreeMap<(u32, u32, i64), Sums>;

/// How an image and gains predict the held-out baselines.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    units: Units,
    /// Variance of the data over that of the weights.
    noise: f64,
}

impl Prediction {
    /// Predict the held-out baselines of `data` with a model and gains, or with the model alone. `noise` is the variance of the data over
    /// that of the weights, 0 where it is not known.
    ///
    /// # Errors
    /// The model cannot be evaluated, the gains do not belong to the set, or no held-out datum can be used.
    pub fn of(
        data: &mut dyn VisibilitySource,
        held: &HeldOut,
        model: &mut dyn ModelVisibilities,
        gains: Option<&GainTable>,
        apply: ApplyOptions,
        noise: f64,
    ) -> Result<Self> {
        let header = data.header().clone();
        let corrupt = ApplyOptions { direction: Direction::Corrupt, flag_unsolved: true, ..apply };
        let applier = gains.map(|g| GainApplier::new(g, &header, corrupt)).transpose()?;
        let mut units = Units::new();
        let seen: Vec<bool> = header.polarizations.iter().map(|pol| super::model::sees_unpolarized(*pol)).collect();
        let of_part = |block: &VisibilityBlock, clean: ArrayView3<'_, Complex32>, rows: &[usize]| -> Result<Units> {
            let block = of_rows(block, rows)?;
            let mut predicted = VisibilityBlock { vis: clean.to_owned(), ..block.clone() };
            if let Some(applier) = &applier {
                applier.apply(&mut predicted)?;
            }
            let (_, n_chan, n_pol) = block.vis.dim();
            let wide = |v: Complex32| Complex64::new(f64::from(v.re), f64::from(v.im));
            let mut units = Units::new();
            for row in 0..rows.len() {
                let sums = units.entry(held.unit(&block, row)).or_default();
                for at in (0..n_chan).flat_map(|c| (0..n_pol).map(move |p| (row, c, p))) {
                    let weight = f64::from(block.usable_weight(at.0, at.1, at.2));
                    let (v, m, p) = (wide(block.vis[at]), wide(clean[at]), wide(predicted.vis[at]));
                    if weight > 0.0 && seen[at.2] && !predicted.flags[at] && m.is_finite() && p.is_finite() {
                        sums.misfit += weight * (v - p).norm_sqr();
                        sums.power += weight * v.norm_sqr();
                        sums.change += weight * (p - m).norm_sqr();
                        sums.samples += 1.0;
                    }
                }
            }
            Ok(units)
        };
        let own = for_each_block(data, MemoryBudget::default().block(), |first, block| -> Result<()> {
            let rows = held.rows_of(&block.coverage);
            let clean = model.predict_some(&header, (first, &block.coverage), &rows)?;
            let parts = rows.par_chunks(PART).zip(clean.axis_chunks_iter(Axis(0), PART).into_par_iter());
            let parts: Vec<Result<Units>> = parts.map(|(rows, clean)| of_part(&block, clean, rows)).collect();
            for part in parts {
                for (unit, more) in part? {
                    let sums = units.entry(unit).or_default();
                    *sums = sums.plus(&more);
                }
            }
            Ok(())
        });
        let mut units = Self::units_of_all(&*data.ranks(), own.map(|()| units))?;
        units.retain(|_, s| s.power > 0.0);
        if units.is_empty() {
            return Err(ChainError::NoData("no held-out baseline can be predicted: its antennas have no gains".into()));
        }
        Ok(Self { units, noise })
    }

    /// The units over the rows of all processes, from those over the rows of this one.
    fn units_of_all(ranks: &dyn Ranks, own: Result<Units>) -> Result<Units> {
        if ranks.size() == 1 {
            return own;
        }
        let numbers = |((a, b, part), s): (&(u32, u32, i64), &Sums)| {
            [f64::from(*a), f64::from(*b), *part as f64, s.misfit, s.power, s.change, s.samples]
        };
        let mut all = Units::new();
        for told in of_all(ranks, own.map(|units| units.iter().flat_map(numbers).collect()))? {
            let mut told = Numbers::of(&told);
            while let Some([a, b, part, misfit, power, change, samples]) = told.next() {
                let sums = all.entry((a as u32, b as u32, part as i64)).or_default();
                *sums = sums.plus(&Sums { misfit, power, change, samples });
            }
        }
        Ok(all)
    }

    fn total(&self) -> Sums {
        self.units.values().fold(Sums::default(), |a, b| a.plus(b))
    }

    /// Power of the noise in the sums: a visibility of weight 1/sigma^2 has 2 sigma^2.
    fn noise_power(&self, s: &Sums) -> f64 {
        2.0 * self.noise * s.samples
    }

    /// Fraction of the power beyond noise that is not predicted.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        let t = self.total();
        let noise = self.noise_power(&t).min(0.999 * t.power);
        (t.misfit - noise).max(0.0) / (t.power - noise)
    }

    /// Standard deviation that the noise of the data gives to [`Prediction::misfit`]; 0 where the noise is not known.
    #[must_use]
    pub fn misfit_sigma(&self) -> f64 {
        let t = self.total();
        let noise = self.noise_power(&t);
        // The squared modulus of a complex Gaussian number has a standard deviation equal to its mean.
        noise / t.samples.max(1.0).sqrt() / (t.power - noise.min(0.999 * t.power))
    }

    /// Misfit that `self` leaves over the misfit that noise alone would leave; infinite where the noise is not known.
    #[must_use]
    pub fn over_noise(&self) -> f64 {
        let t = self.total();
        let noise = self.noise_power(&t);
        if noise > 0.0 { t.misfit / noise } else { f64::INFINITY }
    }

    /// Fraction of the power beyond noise that the gains change.
    #[must_use]
    pub fn change(&self) -> f64 {
        let t = self.total();
        let noise = self.noise_power(&t).min(0.999 * t.power);
        t.change / (t.power - noise)
    }

    /// Standard deviations by which `self` predicts better than `other`, from the signed ranks of the units that both predict.
    #[must_use]
    pub fn better_than(&self, other: &Self) -> f64 {
        let pair = |(k, a): (&(u32, u32, i64), &Sums)| other.units.get(k).map(|b| b.misfit - a.misfit);
        signed_ranks(self.units.iter().filter_map(pair).collect())
    }
}

/// The statistic of Wilcoxon's signed-rank test in standard deviations; positive if the differences are mostly positive.
fn signed_ranks(mut differences: Vec<f64>) -> f64 {
    differences.retain(|d| d.is_finite() && *d != 0.0);
    differences.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let sum: f64 = differences.iter().enumerate().map(|(k, d)| (k + 1) as f64 * d.signum()).sum();
    let n = differences.len() as f64;
    if n > 0.0 { sum / (n * (n + 1.0) * (2.0 * n + 1.0) / 6.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::signed_ranks;

    #[test]
    fn signed_ranks_are_those_of_the_textbook() {
        // Ten positive differences: the sum of ranks 55 over its standard deviation sqrt(385).
        let all: Vec<f64> = (1..=10).map(f64::from).collect();
        assert!((signed_ranks(all.clone()) - 55.0 / 385.0_f64.sqrt()).abs() < 1e-12);
        assert!((signed_ranks(all.iter().map(|d| -d).collect()) + 55.0 / 385.0_f64.sqrt()).abs() < 1e-12);
        // One large negative difference takes away its rank of 10 twice; zeros and numbers that are not finite do not count.
        let mixed = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, -100.0, 0.0, f64::NAN];
        assert!((signed_ranks(mixed.to_vec()) - 35.0 / 385.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(signed_ranks(Vec::new()), 0.0);
    }
}
