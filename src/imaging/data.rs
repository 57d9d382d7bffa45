//! The data of an imager: one polarisation product, block by block. A visibility that must not count has weight 0.
//!
//! The first pass reads the source, counts the visibilities and measures the coverage. If the reduced data fit into their share of the memory
//! budget they are kept, and the file is read only once for the weights, the beam, the image and every major cycle. Otherwise every pass reads
//! the file again. A single image with natural weights can be [made in the first pass](super::one_pass).

use super::ahead::for_each_block_ahead;
use super::one_pass::OnePass;
use super::places_of_rows::{Look, refuse_impossible};
use super::pol::{DataCounts, PolSelector};
use super::reduction::{ReducedBlock, Reduction};
use super::survey::Survey;
use super::total_power::TotalPower;
use crate::fourier::UvwExtent;
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{PartSource, Ranks, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource, rows_of_block};
use ndarray::Array1;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Size in bytes of a reduced visibility: the value, its weight and its imaging weight.
pub(super) const REDUCED_BYTES: usize = 16;

/// Fewest rows that several processes read between two exchanges.
const LEAST_ROWS: usize = 1 << 10;

/// Where the rows of a block come from.
enum Reduce<'a> {
    /// A block of all products.
    Block(&'a VisibilityBlock),
    /// Parts that are read now.
    Parts(&'a mut dyn PartSource, Range<usize>),
}

/// A source of reduced blocks.
pub struct Data<'a> {
    source: &'a mut dyn VisibilitySource,
    reduction: Reduction,
    memory: MemoryBudget,
    cache: Option<Vec<ReducedBlock>>,
    survey: Survey,
    /// Whether rows are combined while they are read.
    in_parts: bool,
    /// The weights of every row, where all rows are known to have the same.
    common: Option<Array1<f32>>,
}

impl std::fmt::Debug for Data<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Data").field("survey", &self.survey).finish_non_exhaustive()
    }
}

impl<'a> Data<'a> {
    /// Read the source once: count the visibilities, measure the coverage, and keep the data if they fit into the budget. With `antennas` the blocks hold
    /// those of their rows, and the visibilities stay phased to the focus of the set. With `one_pass` an image is made meanwhile, if it can be; the blocks then have no
    /// visibilities.
    ///
    /// # Errors
    /// The source cannot be read, the rows have several phase centres, or no visibility can be used.
    pub(super) fn open(
        source: &'a mut dyn VisibilitySource,
        selector: PolSelector,
        (unit_weights, antennas, memory): (bool, bool, MemoryBudget),
        mut one_pass: Option<&mut OnePass>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (n_rows, spectrum, ranks) = (source.n_rows(), source.header().spectrum.clone(), source.ranks());
        let focus = source.header().near_field.focus.filter(|f| !antennas && !f.is_on_axis());
        let focus = focus.map(|f| (f, spectrum.freq_hz().to_vec()));
        let reduction = Reduction { selector, unit_weights, antennas, focus };
        let fits = n_rows.saturating_mul(spectrum.n_chan()).saturating_mul(REDUCED_BYTES) <= memory.kept_visibilities();
        let mut survey = Survey::new(spectrum.n_chan(), TotalPower::new(source.header(), reduction.selector.target));
        // The total power is summed from whole blocks.
        let in_parts = survey.total_power.is_empty() && source.in_parts().is_some();
        let (mut cache, mut center, mut times) = (Vec::new(), None, (f64::INFINITY, f64::NEG_INFINITY));
        let band_hz = spectrum.range_hz();
        observer.event(Event::Phase { name: "reading", total: Some((n_rows * spectrum.n_chan()) as u64), unit: "vis" });
        let processes = if one_pass.is_some() { ranks.size() } else { 1 };
        let rows_at_once = rows_of_one_pass(rows_of_block(source.header(), memory.imaging_block(fits)), processes);
        let ranges = (0..n_rows).step_by(rows_at_once).map(|start| start..(start + rows_at_once).min(n_rows));
        let mut ahead = VecDeque::new();
        if let Some(image) = one_pass.as_deref_mut().filter(|_| in_parts) {
            // The transform must know how far all rows reach, and processes what each of them has.
            let look = Look::at(source, ranges.clone(), (ranks.size() > 1, fits))?;
            image.begin(look.extent.shared(&*ranks), look.sample(ranges.len()))?;
            ahead = look.kept;
        }
        // What is done with a block, whichever way it was read.
        let mut take = |survey: &mut Survey, (first_row, coverage): (usize, &UvCoverage), read: Reduce<'_>| -> Result<ReducedBlock> {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            let first_center = coverage.phase_center.first().copied();
            if center.is_none() {
                center = first_center;
            }
            ensure!(coverage.phase_center.par_iter().all(|p| Some(*p) == center), several_centers());
            refuse_impossible(coverage, first_row)?;
            let (reduced, counts) = match read {
                Reduce::Block(block) => {
                    survey.total_power.add(block, &reduction.selector, reduction.unit_weights);
                    reduction.reduce(block)?
                }
                Reduce::Parts(source, range) => match one_pass.as_deref_mut().filter(|image| image.has_begun()) {
                    Some(image) => image.read(&reduction, (coverage, spectrum.n_chan()), (source, range))?,
                    None => reduction.reduce_parts((coverage, spectrum.n_chan()), (source, range), None)?,
                },
            };
            survey.counts = survey.counts.plus(counts);
            let finite = coverage.time_jd.par_iter().filter(|t| t.is_finite()).map(|t| (*t, *t));
            times = finite.reduce(|| times, |a, b| (a.0.min(b.0), a.1.max(b.1)));
            observer.event(Event::Advance(reduced.n_values() as u64));
            Ok(reduced)
        };
        // The weights of the rows so far; none where they differ.
        let mut common: Option<Option<Array1<f32>>> = None;
        let mut note = |survey: &mut Survey, block: ReducedBlock| {
            let same = block.weight.of_every_row().filter(|row| common.as_ref().is_none_or(|c| c.as_ref() == Some(*row)));
            common = Some(same.cloned());
            survey.extent = survey.extent.union(UvwExtent::of(block.uvw_m.view()));
            survey.measure(&block, band_hz);
            if fits {
                cache.push(block);
            }
        };
        if in_parts {
            let mut last = None;
            for range in ranges {
                let start = range.start;
                // One thread reads the coverage of a block, while the others measure the block before.
                let before = || last.take().into_iter().for_each(|block| note(&mut survey, block));
                let next = || ahead.pop_front().map_or_else(|| source.read_coverage(range.clone()), Ok);
                let coverage = rayon::join(next, before).0?;
                let Some(parts) = source.in_parts() else { break };
                last = Some(take(&mut survey, (start, &coverage), Reduce::Parts(parts, range))?);
            }
            last.into_iter().for_each(|block| note(&mut survey, block));
        } else {
            for_each_block_ahead(source, memory.imaging_block(fits), |first, block| {
                let block = take(&mut survey, (first, &block.coverage), Reduce::Block(&block))?;
                note(&mut survey, block);
                Ok(())
            })?;
        }
        observer.event(Event::Done);
        if let Some(image) = one_pass.as_deref_mut() {
            image.finish_rounds()?;
        }
        survey.share(&*ranks, &mut times);
        let center = one_center(center, &*ranks)?;
        if times.0 <= times.1 {
            survey.time_jd = Some(0.5 * (times.0 + times.1));
        }
        report(&survey, reduction.selector.target.name(), observer)?;
        let center = center.ok_or_else(|| ChainError::NoData("the set has no rows".into()))?;
        survey.phase_center = usize::from(center);
        // Blocks of an image that failed have no visibilities.
        let whole = one_pass.is_none_or(|image| !image.has_failed());
        Ok(Self { source, reduction, memory, cache: (fits && whole).then_some(cache), survey, in_parts, common: common.flatten() })
    }

    /// The results of the first pass.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// The header of the set.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        self.source.header()
    }

    /// Call `work` for every block, in order. Blocks in memory keep their imaging weights from pass to pass. Blocks that are read again lose
    /// them; `prepare` is called for these blocks first, to set them again.
    ///
    /// # Errors
    /// The first error of the source or of `work`.
    pub fn for_each(
        &mut self,
        observer: &dyn Observer,
        prepare: impl Fn(&mut ReducedBlock) + Sync,
        mut work: impl FnMut(&mut ReducedBlock) -> Result<()> + Send,
    ) -> Result<()> {
        let stop = || if observer.cancelled() { Err(ChainError::Cancelled) } else { Ok(()) };
        if let Some(blocks) = &mut self.cache {
            for block in blocks {
                stop()?;
                work(block)?;
                observer.event(Event::Advance(block.n_values() as u64));
            }
            return Ok(());
        }
        let reduction = &self.reduction;
        let mut reduced = |mut reduced: ReducedBlock| -> Result<()> {
            prepare(&mut reduced);
            work(&mut reduced)?;
            observer.event(Event::Advance(reduced.n_values() as u64));
            Ok(())
        };
        if !self.in_parts {
            return for_each_block_ahead(self.source, self.memory.imaging_block(false), |_, block| {
                stop()?;
                let (of_block, _) = reduction.reduce(&block)?;
                drop(block);
                reduced(of_block)
            });
        }
        let (n_rows, n_chan) = (self.source.n_rows(), self.source.header().spectrum.n_chan());
        let step = rows_of_block(self.source.header(), self.memory.imaging_block(false));
        for start in (0..n_rows).step_by(step) {
            stop()?;
            let range = start..(start + step).min(n_rows);
            let coverage = self.source.read_coverage(range.clone())?;
            let Some(parts) = self.source.in_parts() else {
                return Err(ChainError::Internal("a set that is no longer read in parts".into()));
            };
            reduced(reduction.reduce_parts((&coverage, n_chan), (parts, range), None)?.0)?;
        }
        Ok(())
    }

    /// [`Data::for_each`] without a look at the visibilities, which the blocks need not have. Where a large set has the same weights in all rows, only the
    /// places of the rows are read again.
    ///
    /// # Errors
    /// As [`Data::for_each`].
    pub fn for_each_weight(
        &mut self,
        observer: &dyn Observer,
        prepare: impl Fn(&mut ReducedBlock) + Sync,
        mut work: impl FnMut(&mut ReducedBlock) -> Result<()> + Send,
    ) -> Result<()> {
        let Some(common) = self.common.as_ref().filter(|_| self.cache.is_none()) else { return self.for_each(observer, prepare, work) };
        let n_rows = self.source.n_rows();
        let step = rows_of_block(self.source.header(), self.memory.imaging_block(false));
        for start in (0..n_rows).step_by(step) {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            let coverage = self.source.read_coverage(start..(start + step).min(n_rows))?;
            let mut block = self.reduction.weights_only(&coverage, common)?;
            prepare(&mut block);
            work(&mut block)?;
            observer.event(Event::Advance(block.n_values() as u64));
        }
        Ok(())
    }

    /// The processes that share the data.
    #[must_use]
    pub fn ranks(&self) -> Arc<dyn Ranks> {
        self.source.ranks()
    }

    /// True if the data are in memory.
    #[must_use]
    pub fn is_cached(&self) -> bool {
        self.cache.is_some()
    }

    /// True if a pass goes through several blocks of rows.
    pub fn has_blocks(&self) -> bool {
        self.cache.as_ref().is_none_or(|blocks| blocks.len() > 1)
    }
}

/// Rows of a block of an image that is made while the set is read, from those that one process would take: what is on its way between processes falls as the rest of
/// their memory.
pub(crate) fn rows_of_one_pass(rows: usize, processes: usize) -> usize {
    if processes == 1 { rows } else { (rows / processes).max(LEAST_ROWS) }
}

fn several_centers() -> ChainError {
    ChainError::Incompatible("the rows have several phase centres: split the set and image one field at a time".into())
}

/// The phase centre of all rows, from that of the rows of this process. A process without rows has none.
fn one_center(own: Option<u16>, ranks: &dyn Ranks) -> Result<Option<u16>> {
    let mut range = own.map_or([f64::NEG_INFINITY; 2], |p| [f64::from(p), -f64::from(p)]);
    ranks.largest(&mut range);
    ensure!(range[0] + range[1] == 0.0 || range[0].is_infinite(), several_centers());
    Ok(range[0].is_finite().then_some(range[0] as u16))
}

/// Report the visibilities that were left out. It is an error if no visibility is left.
fn report(survey: &Survey, name: &str, observer: &dyn Observer) -> Result<()> {
    // Autocorrelations that measure total power are not left out.
    let powers = survey.total_power.used.min(survey.counts.autocorrelations);
    let c = DataCounts { total: survey.counts.total - powers, autocorrelations: survey.counts.autocorrelations - powers, ..survey.counts };
    let left_out = c.left_out(name);
    ensure!(c.used > 0, ChainError::NoData(format!("no usable visibility: {left_out}")));
    if c.used < c.total {
        observer.event(Event::Note(&format!("{left_out}; these are not used")));
    }
    if c.one_hand > 0 {
        observer.event(Event::Note(&format!("{} visibilities of {name} have one usable hand, which is used for both", c.one_hand)));
    }
    Ok(())
}
