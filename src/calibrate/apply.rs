//! Applying gains: V = V_corrupt / (g1 conj(g2)), or its inverse, block by block.
//!
//! The weights change too. Division by a product of gains divides the noise by its modulus, so the weight is multiplied by the square of
//! the modulus. Leakages mix the four products of a row; they change no weights.

use super::apply_leakage::LeakageApplier;
use super::lookup::{interval_of, known, nearest_channel};
use super::reach::Reach;
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, SpectralWindow, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource, for_each_block};
use ndarray::{Array3, Axis, Slice};
use num_complex::{Complex, Complex32, Complex64};
use rayon::prelude::*;

/// Whether gains are removed from the data or applied to them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Divide by g1 conj(g2): corrupted data become calibrated.
    Calibrate,
    /// Multiply by g1 conj(g2): true visibilities become corrupted.
    Corrupt,
}

/// The gain between the middles of solution intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Interpolation {
    /// That of the interval that holds the time, or of the nearest one.
    Nearest,
    /// Amplitude and phase linear in time, the phase along the shorter way round; constant before the first and after the last.
    Linear,
}

/// How gains are applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ApplyOptions {
    /// Calibrate or corrupt.
    pub direction: Direction,
    /// Between solution intervals.
    pub interpolation: Interpolation,
    /// Flag data without a gain; otherwise they pass unchanged.
    pub flag_unsolved: bool,
    /// Apply the gains also far from the times and frequencies for which they were solved.
    pub anywhere: bool,
}

impl Default for ApplyOptions {
    fn default() -> Self {
        Self { direction: Direction::Calibrate, interpolation: Interpolation::Nearest, flag_unsolved: true, anywhere: false }
    }
}

/// Counts of the samples that were changed and flagged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ApplyCounts {
    /// Samples multiplied or divided by gains.
    pub applied: u64,
    /// Samples flagged because a gain is missing, flagged or zero.
    pub flagged: u64,
}

impl ApplyCounts {
    fn plus(self, more: Self) -> Self {
        Self { applied: self.applied + more.applied, flagged: self.flagged + more.flagged }
    }
}

/// A gain table matched to the rows of one set.
#[derive(Debug, Clone)]
pub struct GainApplier<'a> {
    table: &'a GainTable,
    options: ApplyOptions,
    /// Antenna of the table for each antenna of the set.
    antenna: Vec<Option<usize>>,
    /// Channel of the table for each channel of the set.
    channel: Vec<usize>,
    /// Feeds of the table for each polarisation of the set.
    feeds: Vec<(usize, usize)>,
    /// Intervals in order of time.
    order: Vec<usize>,
    /// Times for which the gains may serve; `None` for all times.
    reach: Option<Reach>,
    /// Leakages, where the table has any.
    leakages: Option<LeakageApplier<'a>>,
}

/// About so many samples and gains are worked on together.
const AT_ONCE: usize = 1 << 20;

/// Rows that are worked on together, and the gains at each of their times.
#[derive(Default)]
struct Batch {
    rows: Vec<Row>,
    times: Vec<Vec<Option<Complex64>>>,
}

/// The antennas of a row, and the index of its time.
struct Row {
    antennas: [usize; 2],
    time: usize,
}

impl<'a> GainApplier<'a> {
    /// Match a table to a set: antennas by name, channels by frequency, feeds by name.
    ///
    /// # Errors
    /// The shapes within the table do not agree; the table and the set have no antenna in common; the feeds do not match the polarisations
    /// of the set; there is a gain for each feed but the set has Stokes parameters; or the gains are those of another band.
    pub fn new(table: &'a GainTable, header: &VisibilityHeader, options: ApplyOptions) -> Result<Self> {
        table.check()?;
        let antenna: Vec<Option<usize>> = header.layout.antennas().iter().map(|a| table.layout.index_of(&a.name)).collect();
        if antenna.iter().all(Option::is_none) {
            return Err(ChainError::Incompatible(format!(
                "no antenna of the set ({}, ...) is in the gain table ({}, ...)",
                header.layout.antennas()[0].name,
                table.layout.antennas()[0].name
            )));
        }
        let channel = header.spectrum.freq_hz().iter().map(|f| nearest_channel(table, *f)).collect();
        let mut order: Vec<usize> = (0..table.time_jd.len()).collect();
        order.sort_by(|a, b| table.time_jd[*a].total_cmp(&table.time_jd[*b]));
        let reach = if options.anywhere { None } else { Some(Reach::new(table, &header.spectrum)?) };
        let feeds = match_feeds(table, header)?;
        let leakages = LeakageApplier::new(table, header)?;
        Ok(Self { table, options, antenna, channel, feeds, order, reach, leakages })
    }

    /// Apply the gains to a block in place.
    ///
    /// # Errors
    /// A block of another shape than the set's, an antenna that the set does not have, or a time far from those of the gains.
    pub fn apply(&self, block: &mut VisibilityBlock) -> Result<ApplyCounts> {
        let (_, n_chan, n_pol) = block.vis.dim();
        if (n_chan, n_pol) != (self.channel.len(), self.feeds.len()) {
            return Err(ChainError::Incompatible(format!(
                "a block of {n_chan} channels and {n_pol} polarisations, the gains were matched to {} and {}",
                self.channel.len(),
                self.feeds.len()
            )));
        }
        // The values of a row are worked on as slices.
        in_order(&mut block.vis);
        in_order(&mut block.weights);
        in_order(&mut block.flags);
        let mut counts = ApplyCounts::default();
        let mut first = 0;
        while first < block.n_rows() {
            let batch = self.batch(block, first)?;
            let rows = first..first + batch.rows.len();
            first = rows.end;
            let leak = |block: &mut VisibilityBlock| -> u64 {
                let Some(leakages) = &self.leakages else { return 0 };
                let how = (self.options.direction == Direction::Calibrate, self.options.flag_unsolved);
                let of_row =
                    |(row, r): (usize, &Row)| leakages.apply(block, row, (r.antennas.map(|a| self.antenna[a]), &self.channel), how);
                rows.clone().zip(&batch.rows).map(of_row).sum()
            };
            if self.options.direction == Direction::Corrupt {
                counts.flagged += leak(block);
            }
            let part = Slice::from(rows.clone());
            let mut vis = block.vis.slice_axis_mut(Axis(0), part);
            let mut weights = block.weights.slice_axis_mut(Axis(0), part);
            let mut flags = block.flags.slice_axis_mut(Axis(0), part);
            let data = vis.axis_iter_mut(Axis(0)).into_par_iter().zip(weights.axis_iter_mut(Axis(0))).zip(flags.axis_iter_mut(Axis(0)));
            let done = data.zip(&batch.rows).map_init(Vec::new, |factors, (((vis, weights), flags), row)| {
                let slices = (vis.into_slice(), weights.into_slice(), flags.into_slice());
                let (Some(vis), Some(weights), Some(flags)) = slices else {
                    return Err(ChainError::Internal("a row whose values are not in one piece".into()));
                };
                Ok(self.apply_to_row((row.antennas, &batch.times[row.time]), factors, (vis, weights, flags)))
            });
            counts = counts.plus(done.try_reduce(ApplyCounts::default, |a, b| Ok(a.plus(b)))?);
            if self.options.direction == Direction::Calibrate {
                counts.flagged += leak(block);
            }
        }
        Ok(counts)
    }

    /// The gains for some rows from row `first` on.
    fn batch(&self, block: &VisibilityBlock, first: usize) -> Result<Batch> {
        let of_row = self.channel.len() * self.feeds.len();
        let (mut batch, mut time_jd, mut work) = (Batch::default(), f64::NAN, 0);
        for row in first..block.n_rows() {
            let antennas = [block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize];
            let largest = antennas[0].max(antennas[1]);
            if largest >= self.antenna.len() {
                return Err(ChainError::Incompatible(format!("a row names antenna {largest}, the array has {}", self.antenna.len())));
            }
            let time = block.coverage.time_jd[row];
            self.reach.map_or(Ok(()), |r| r.check(time))?;
            if time != time_jd {
                if work > AT_ONCE {
                    break;
                }
                time_jd = time;
                let gains = self.gains_at(time);
                work += gains.len();
                batch.times.push(gains);
            }
            work += of_row;
            batch.rows.push(Row { antennas, time: batch.times.len() - 1 });
        }
        Ok(batch)
    }

    /// Apply gains to the values \[chan, pol\] of a row. `factors` is memory for the products of the gains of each polarisation.
    fn apply_to_row(
        &self,
        (antennas, gains): ([usize; 2], &[Option<Complex64>]),
        factors: &mut Vec<Option<(Complex64, f64)>>,
        (vis, weights, flags): (&mut [Complex32], &mut [f32], &mut [bool]),
    ) -> ApplyCounts {
        let (_, _, n_chan, n_feed) = self.table.gains.dim();
        let gain = |ant: usize, from: usize, feed: usize| gains[(ant * n_chan + from) * n_feed + feed];
        let factor = |from: usize, (f1, f2): (usize, usize)| {
            let product = gain(antennas[0], from, f1)? * gain(antennas[1], from, f2)?.conj();
            let factor = if self.options.direction == Direction::Calibrate { product.inv() } else { product };
            Some((factor, factor.norm_sqr()))
        };
        let mut counts = ApplyCounts::default();
        let mut of = None;
        let n_pol = self.feeds.len().max(1);
        let channels = vis.chunks_exact_mut(n_pol).zip(weights.chunks_exact_mut(n_pol)).zip(flags.chunks_exact_mut(n_pol));
        for (((vis, weights), flags), from) in channels.zip(&self.channel) {
            if of != Some(*from) {
                factors.clear();
                factors.extend(self.feeds.iter().map(|feeds| factor(*from, *feeds)));
                of = Some(*from);
            }
            for (((v, w), flag), factor) in vis.iter_mut().zip(weights).zip(flags).zip(&*factors) {
                let Some((factor, squared)) = factor else {
                    if self.options.flag_unsolved {
                        *flag = true;
                        counts.flagged += 1;
                    }
                    continue;
                };
                let new = Complex64::new(f64::from(v.re), f64::from(v.im)) * factor;
                *v = Complex::new(new.re as f32, new.im as f32);
                *w = (f64::from(*w) / squared) as f32;
                counts.applied += 1;
            }
        }
        counts
    }

    /// The gains at a time \[ant of the set, chan of the table, feed\]; `None` where there is no gain.
    fn gains_at(&self, time_jd: f64) -> Vec<Option<Complex64>> {
        let (_, _, n_chan, n_feed) = self.table.gains.dim();
        let mut all = vec![None; self.antenna.len() * n_chan * n_feed];
        let nearest = interval_of(self.table, time_jd);
        for (ant, place) in self.antenna.iter().enumerate() {
            let Some(a) = place else { continue };
            for c in 0..n_chan {
                for f in 0..n_feed {
                    all[(ant * n_chan + c) * n_feed + f] = match self.options.interpolation {
                        Interpolation::Nearest => known(self.table, (nearest, *a, c, f)),
                        Interpolation::Linear => self.between(time_jd, *a, c, f),
                    };
                }
            }
        }
        all
    }

    /// Linear between the nearest unflagged gains before and after.
    fn between(&self, time_jd: f64, a: usize, c: usize, f: usize) -> Option<Complex64> {
        let times = &self.table.time_jd;
        let split = self.order.partition_point(|t| times[*t] <= time_jd);
        let pick = |t: &usize| known(self.table, (*t, a, c, f)).map(|g| (times[*t], g));
        let before = self.order[..split].iter().rev().find_map(pick);
        let after = self.order[split..].iter().find_map(pick);
        match (before, after) {
            (Some((t0, g0)), Some((t1, g1))) => {
                let x = (time_jd - t0) / (t1 - t0);
                let amplitude = g0.norm() + x * (g1.norm() - g0.norm());
                Some(Complex64::from_polar(amplitude, g0.arg() + x * (g1 * g0.conj()).arg()))
            }
            (one, other) => one.or(other).map(|(_, g)| g),
        }
    }
}

/// Bring the values of an array into the order \[blt, chan, pol\], if they are in another one.
fn in_order<T: Clone>(values: &mut Array3<T>) {
    if !values.is_standard_layout() {
        *values = values.as_standard_layout().into_owned();
    }
}

/// Largest number of gains in a file of a table that is spread over channels: half a gigabyte.
const MOST_SPREAD: usize = 1 << 25;

/// The channels of a file of gains for data on `spectrum`, and for each of them the channel of the table whose gains it holds: the nearest, as
/// in [`GainApplier`]. Programs that apply tables channel by channel need a gain for each channel of the data. A table that would become
/// too large keeps its own channels.
#[must_use]
pub fn spread_channels(table: &GainTable, spectrum: &SpectralWindow) -> (SpectralWindow, Vec<usize>) {
    let (n_time, n_ant, n_chan, n_feed) = table.gains.dim();
    if table.spectrum == *spectrum || n_time * n_ant * n_feed * spectrum.n_chan() > MOST_SPREAD {
        return (table.spectrum.clone(), (0..n_chan).collect());
    }
    (spectrum.clone(), spectrum.freq_hz().iter().map(|f| nearest_channel(table, *f)).collect())
}

/// Feeds of the table for each polarisation of the set.
fn match_feeds(table: &GainTable, header: &VisibilityHeader) -> Result<Vec<(usize, usize)>> {
    if table.feeds.len() == 1 && !is_hand(&table.feeds[0]) {
        return Ok(vec![(0, 0); header.polarizations.len()]);
    }
    let find = |letter: char| table.feeds.iter().position(|f| f.eq_ignore_ascii_case(&letter.to_string()));
    header
        .polarizations
        .iter()
        .map(|p| {
            let mut letters = p.name().chars();
            let pair = letters.next().zip(letters.next()).and_then(|(a, b)| find(a).zip(find(b)));
            pair.ok_or_else(|| {
                ChainError::Incompatible(format!(
                    "polarisation {p} needs gains of its feeds, the table has gains of {}: solve with joined feeds, or convert the set",
                    table.feeds.join(", ")
                ))
            })
        })
        .collect()
}

fn is_hand(name: &str) -> bool {
    matches!(name.to_ascii_uppercase().as_str(), "R" | "L" | "X" | "Y")
}

/// Read a set, apply gains, write it. The sink is not finished.
///
/// # Errors
/// As [`GainApplier::new`], errors of source and sink, or [`ChainError::Cancelled`].
pub fn apply(
    source: &mut dyn VisibilitySource,
    table: &GainTable,
    options: ApplyOptions,
    sink: &mut dyn VisibilitySink,
    observer: &dyn Observer,
) -> Result<ApplyCounts> {
    let header = source.header().clone();
    let applier = GainApplier::new(table, &header, options)?;
    let mut total = ApplyCounts::default();
    observer.event(Event::Phase { name: "applying gains", total: Some(source.n_rows() as u64), unit: "rows" });
    for_each_block(source, MemoryBudget::default().block(), |_, mut block| {
        if observer.cancelled() {
            return Err(ChainError::Cancelled);
        }
        let counts = applier.apply(&mut block)?;
        total = total.plus(counts);
        sink.write_block(&block)?;
        observer.event(Event::Advance(block.n_rows() as u64));
        Ok(())
    })?;
    observer.event(Event::Done);
    Ok(total)
}

/// A set whose rows are calibrated (or corrupted) as they are read. Nothing is stored.
pub struct CalibratedSource<'a> {
    source: &'a mut dyn VisibilitySource,
    applier: GainApplier<'a>,
}

impl<'a> CalibratedSource<'a> {
    /// Apply `table` to the rows of `source`.
    ///
    /// # Errors
    /// As [`GainApplier::new`].
    pub fn new(source: &'a mut dyn VisibilitySource, table: &'a GainTable, options: ApplyOptions) -> Result<Self> {
        let applier = GainApplier::new(table, source.header(), options)?;
        Ok(Self { source, applier })
    }
}

impl VisibilitySource for CalibratedSource<'_> {
    fn header(&self) -> &VisibilityHeader {
        self.source.header()
    }

    fn n_rows(&self) -> usize {
        self.source.n_rows()
    }

    fn ranks(&self) -> std::sync::Arc<dyn cittert_arrays::Ranks> {
        self.source.ranks()
    }

    fn read_rows(&mut self, range: std::ops::Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
        let mut block = self.source.read_rows(range)?;
        self.applier.apply(&mut block).map_err(|e| cittert_arrays::ArrayError::Stream(Box::new(e)))?;
        Ok(block)
    }

    fn read_runs(&mut self, runs: &[std::ops::Range<usize>]) -> cittert_arrays::Result<Vec<VisibilityBlock>> {
        let mut blocks = self.source.read_runs(runs)?;
        for block in &mut blocks {
            self.applier.apply(block).map_err(|e| cittert_arrays::ArrayError::Stream(Box::new(e)))?;
        }
        Ok(blocks)
    }
}

#[cfg(test)]
#[path = "apply_tests.rs"]
mod tests;
