//! The data as an imager sees them: one product, weights of 0 for what must not count, block after block.
//!
//! The first pass reads the source, counts and measures. Where the reduced data fit into the cache they are kept, so that weights,
//! beam, image and every major cycle read the file once; where not, every pass reads it again in the same small memory.

use super::ahead::for_each_block_ahead;
use super::pol::{DataCounts, PolSelector};
use crate::fourier::UvwExtent;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::Array2;
use num_complex::Complex32;
use rayon::prelude::*;

/// Bytes of a block of file rows: where what is needed of all of them is kept, and where every pass reads them anew beside the planes of its
/// grid. Two blocks are in memory at once.
const BLOCK_BYTES: [usize; 2] = [96 << 20, 48 << 20];
/// Reduced rows handed to the gridder at once where they come from the cache are whole blocks of the file.
const REDUCED_BYTES: usize = 16;

/// Rows reduced to one product.
#[derive(Debug, Clone)]
pub struct ReducedBlock {
    /// Index of the first row in the source.
    pub first_row: usize,
    /// uvw, m \[row, 3\]; 0 where they were not finite.
    pub uvw_m: Array2<f64>,
    /// Visibilities \[row, chan\]; 0 where they must not count.
    pub vis: Array2<Complex32>,
    /// Weights of the data, 1/sigma^2 \[row, chan\]; 0 where they must not count.
    pub weight: Array2<f32>,
    /// Weights of the image \[row, chan\]; see [`super::weights`].
    pub imaging: Array2<f32>,
}

/// What the first pass found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// What became of the data.
    pub counts: DataCounts,
    /// Reach of the rows that have any weight.
    pub extent: UvwExtent,
    /// Shortest and longest projected baseline of used rows over all channels, wavelengths.
    pub uv_range_wl: (f64, f64),
    /// Sum of the weights of the data in each channel \[chan\].
    pub channel_weight: Vec<f64>,
    /// Middle of the first and last time, Julian date.
    pub time_jd: Option<f64>,
    /// Index of the phase centre of the rows.
    pub phase_center: usize,
}

/// A source of reduced blocks.
pub struct Data<'a> {
    source: &'a mut dyn VisibilitySource,
    selector: PolSelector,
    unit_weights: bool,
    cache: Option<Vec<ReducedBlock>>,
    survey: Survey,
}

impl std::fmt::Debug for Data<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Data").field("survey", &self.survey).finish_non_exhaustive()
    }
}

impl<'a> Data<'a> {
    /// Read the source once: count, measure, and keep what fits into `cache_bytes`.
    ///
    /// # Errors
    /// A source that cannot be read, rows of several phase centres, no datum that may be used.
    pub fn open(
        source: &'a mut dyn VisibilitySource,
        selector: PolSelector,
        (unit_weights, cache_bytes): (bool, usize),
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (n_rows, spectrum) = (source.n_rows(), source.header().spectrum.clone());
        let fits = n_rows.saturating_mul(spectrum.n_chan()).saturating_mul(REDUCED_BYTES) <= cache_bytes;
        let mut survey = Survey { channel_weight: vec![0.0; spectrum.n_chan()], uv_range_wl: (f64::INFINITY, 0.0), ..Survey::default() };
        let (mut cache, mut center, mut times) = (Vec::new(), None, (f64::INFINITY, f64::NEG_INFINITY));
        let (f_lo, f_hi) = spectrum.range_hz();
        observer.event(Event::Phase { name: "reading", total: Some((n_rows * spectrum.n_chan()) as u64), unit: "vis" });
        for_each_block_ahead(source, BLOCK_BYTES[usize::from(!fits)], |first, block| {
            if observer.cancelled() {
                return Err(ChainError::Cancelled);
            }
            let first_center = block.coverage.phase_center.first().copied();
            if center.is_none() {
                center = first_center;
            }
            if block.coverage.phase_center.iter().any(|p| Some(*p) != center) {
                let message = "the rows have several phase centres: split the set and image one field at a time";
                return Err(ChainError::Incompatible(message.into()));
            }
            let (reduced, counts) = reduce(&selector, unit_weights, first, &block);
            survey.counts = survey.counts.plus(counts);
            times = block.coverage.time_jd.iter().filter(|t| t.is_finite()).fold(times, |(a, b), t| (a.min(*t), b.max(*t)));
            survey.extent = survey.extent.union(UvwExtent::of(reduced.uvw_m.view()));
            for (uvw, weights) in reduced.uvw_m.rows().into_iter().zip(reduced.weight.rows()) {
                if weights.iter().any(|w| *w > 0.0) {
                    let length = uvw[0].hypot(uvw[1]) / SPEED_OF_LIGHT_M_S;
                    survey.uv_range_wl = (survey.uv_range_wl.0.min(length * f_lo), survey.uv_range_wl.1.max(length * f_hi));
                    weights.iter().zip(&mut survey.channel_weight).for_each(|(w, sum)| *sum += f64::from(*w));
                }
            }
            observer.event(Event::Advance(reduced.vis.len() as u64));
            if fits {
                cache.push(reduced);
            }
            Ok(())
        })?;
        observer.event(Event::Done);
        if times.0 <= times.1 {
            survey.time_jd = Some(0.5 * (times.0 + times.1));
        }
        survey.phase_center = usize::from(center.unwrap_or(0_u16));
        report(&survey.counts, selector.target.name(), observer)?;
        Ok(Self { source, selector, unit_weights, cache: fits.then_some(cache), survey })
    }

    /// What the first pass found.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// What all rows share.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        self.source.header()
    }

    /// Hand every block to `work`, in order. Changes to the weights of the image last only where the data are in the cache:
    /// `prepare` makes them for blocks that are read anew.
    ///
    /// # Errors
    /// The first error of the source or of `work`.
    pub fn for_each(
        &mut self,
        observer: &dyn Observer,
        prepare: impl Fn(&mut ReducedBlock),
        mut work: impl FnMut(&mut ReducedBlock) -> Result<()>,
    ) -> Result<()> {
        let stop = || if observer.cancelled() { Err(ChainError::Cancelled) } else { Ok(()) };
        if let Some(blocks) = &mut self.cache {
            for block in blocks {
                stop()?;
                work(block)?;
                observer.event(Event::Advance(block.vis.len() as u64));
            }
            return Ok(());
        }
        let (selector, unit) = (&self.selector, self.unit_weights);
        for_each_block_ahead(self.source, BLOCK_BYTES[1], |first, block| {
            stop()?;
            let (mut reduced, _) = reduce(selector, unit, first, &block);
            drop(block);
            prepare(&mut reduced);
            work(&mut reduced)?;
            observer.event(Event::Advance(reduced.vis.len() as u64));
            Ok(())
        })
    }

    /// True where the data are in memory and weights of the image last.
    #[must_use]
    pub fn is_cached(&self) -> bool {
        self.cache.is_some()
    }
}

fn reduce(selector: &PolSelector, unit: bool, first_row: usize, block: &VisibilityBlock) -> (ReducedBlock, DataCounts) {
    let (rows, chans) = (block.vis.shape()[0], block.vis.shape()[1]);
    // Memory that is fresh is zero already: the threads that fill it are the first to touch it.
    let mut vis: Vec<Complex32> = bytemuck::zeroed_vec(rows * chans);
    let (mut weight, mut imaging) = (vec![0.0; rows * chans], vec![0.0; rows * chans]);
    let counts = vis
        .par_chunks_exact_mut(chans.max(1))
        .zip(weight.par_chunks_exact_mut(chans.max(1)))
        .zip(imaging.par_chunks_exact_mut(chans.max(1)))
        .enumerate()
        .map(|(r, ((v, w), imaging))| {
            let counts = selector.row(block, r, unit, (v, w));
            imaging.copy_from_slice(w);
            counts
        })
        .reduce(DataCounts::default, DataCounts::plus);
    let mut uvw_m = block.coverage.uvw_m.clone();
    for mut row in uvw_m.rows_mut() {
        if !row.iter().all(|x| x.is_finite()) {
            row.fill(0.0);
        }
    }
    (ReducedBlock { first_row, uvw_m, vis: shaped(vis, chans), weight: shaped(weight, chans), imaging: shaped(imaging, chans) }, counts)
}

/// Whole rows of `chans` values as \[row, chan\].
fn shaped<T: Default>(values: Vec<T>, chans: usize) -> Array2<T> {
    let rows = values.len() / chans.max(1);
    Array2::from_shape_vec((rows, chans), values).unwrap_or_else(|_| Array2::default((rows, chans)))
}

/// Say what was left out; nothing left is an error.
fn report(c: &DataCounts, name: &str, observer: &dyn Observer) -> Result<()> {
    let left_out = format!(
        "{} of {} visibilities of {name} are flagged, {} have a weight that is not positive and finite, {} are not finite",
        c.flagged, c.total, c.bad_weight, c.not_finite
    );
    if c.used == 0 {
        return Err(ChainError::NoData(format!("no usable visibility: {left_out}")));
    }
    if c.used < c.total {
        observer.event(Event::Note(&format!("{left_out}; none of these counts")));
    }
    if c.one_hand > 0 {
        observer.event(Event::Note(&format!("{} visibilities of {name} have one usable hand, which is taken for both", c.one_hand)));
    }
    Ok(())
}
