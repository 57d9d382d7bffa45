//! A dirty image that is made while the set is read for the first time.
//!
//! With natural weights a visibility counts as much as its own weight says, so that it can be gridded as soon as it is known. The visibilities need
//! not be kept, and a large set is not read again. Every other weighting needs the density of all rows first.
//!
//! Several processes each hold a part of the planes. They read blocks of rows side by side, and after each block they give its nodes to the processes that grid them.

use super::ImagingOptions;
use super::over_ranks::{SMALL_PLANES, summed};
use super::places_of_rows::finite_uvw;
use super::pol::DataCounts;
use super::reduction::{ReducedBlock, Reduction};
use super::session::LONG;
use super::weights::ImageWeights;
use crate::fourier::{GridOptions, Gridder, SampleOfRows, SetNodes, SharedGridder, Transform, UvwExtent, in_precision};
use crate::{ChainError, Result};
use cittert_arrays::{PartSource, Ranks, SkyGrid, UvCoverage, VisUnit, VisibilitySource};
use ndarray::Array2;
use num_complex::Complex32;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};

/// The image of a set that is read.
pub(super) struct OnePass {
    pub(super) grid: SkyGrid,
    freq_hz: Vec<f64>,
    options: GridOptions,
    /// Number of visibilities of this process, used or not.
    n_vis: u64,
    at_work: Option<(Transform<f32>, Planes)>,
    ranks: Arc<dyn Ranks>,
    /// Blocks that are still to be read, by the process that has most of them.
    rounds: usize,
    /// Weights are divided by this number. It is a power of two, so that it changes no digit of the image, whichever row is read first.
    scale: OnceLock<f64>,
    /// True where the processes have the same scale.
    agreed: bool,
    /// True where a weight over the scale is so large that the sums could leave single precision.
    overflows: AtomicBool,
}

/// The planes of an image.
#[derive(Debug)]
enum Planes {
    /// All of them, for the rows of this process.
    Whole(Gridder<f32>),
    /// A part, for the rows of all processes.
    Shared(SharedGridder<f32>),
}

/// Largest weight over the scale. Sums over 1e12 visibilities, and over the pixels of a plane, then stay within single precision.
const MOST: f32 = 1e9;

impl OnePass {
    /// `None` where the image depends on more than each visibility by itself and the grid that the options give.
    pub(super) fn of(source: &mut dyn VisibilitySource, options: &ImagingOptions) -> Result<Option<Self>> {
        let header = source.header();
        // The background of elements with a pattern is found from all visibilities.
        let has_background = header.unit == VisUnit::KelvinSr && !header.layout.pattern.is_none() && header.pedestal_k.is_none();
        let far = options.surface_of(&header.near_field)?.is_none();
        let (Some(size), Some(cell), [center]) = (options.size, options.cell, header.phase_centers.as_slice()) else { return Ok(None) };
        if options.channels_out != 1 || has_background || !far || !options.grid_options().single_precision_suffices() {
            return Ok(None);
        }
        let grid = SkyGrid::new(size.columns, size.rows, cell.si(), SkyGrid::frame_of(center))?;
        if !ImageWeights::will_be_those_of_the_data(options) {
            return Ok(None);
        }
        let (freq_hz, ranks) = (source.header().spectrum.freq_hz().to_vec(), source.ranks());
        let n_vis = (source.n_rows() * freq_hz.len()) as u64;
        Ok(Some(Self {
            grid,
            freq_hz,
            options: options.grid_options(),
            n_vis,
            at_work: None,
            ranks,
            rounds: 0,
            scale: OnceLock::new(),
            agreed: false,
            overflows: AtomicBool::new(false),
        }))
    }

    /// Begin with the rows of all processes: their extent, and some rows of this process. Where the planes do not fit into the memory together, the image is not
    /// made here.
    pub(super) fn begin(&mut self, extent: UvwExtent, sample: SampleOfRows<'_>) -> Result<()> {
        let mut n_vis = [self.n_vis as f64];
        self.ranks.sum(&mut n_vis);
        let transform = Transform::new(&self.grid, &self.freq_hz, extent, &self.options, (n_vis[0] as u64).min(LONG))?;
        let planes = if self.ranks.size() > 1 && transform.plane_bytes() > SMALL_PLANES {
            transform.shared_gridder(sample, &*self.ranks)?.map(Planes::Shared)
        } else {
            // The groups follow from the memory of this process.
            let mut groups = [transform.groups_of_planes() as f64];
            self.ranks.largest(&mut groups);
            (groups[0] == 1.0).then(|| Planes::Whole(transform.gridder()))
        };
        let mut rounds = [sample.block.1 as f64];
        self.ranks.largest(&mut rounds);
        self.rounds = rounds[0] as usize;
        self.at_work = planes.map(|planes| (transform, planes));
        Ok(())
    }

    /// True if the rows that are read now are gridded.
    pub(super) fn has_begun(&self) -> bool {
        self.at_work.is_some()
    }

    /// Read rows with this coverage and `chans` channels, and grid them. The block has no visibilities.
    pub(super) fn read(
        &mut self,
        reduction: &Reduction,
        (coverage, chans): (&UvCoverage, usize),
        read: (&mut dyn PartSource, Range<usize>),
    ) -> Result<(ReducedBlock, DataCounts)> {
        let Some((transform, planes)) = &mut self.at_work else {
            return Err(ChainError::Internal("rows were read for an image that was not begun".into()));
        };
        let uvw_m = finite_uvw(coverage)?;
        let limits = (&self.scale, &self.overflows);
        match planes {
            Planes::Whole(gridder) => {
                let rows = transform.sort(uvw_m.view())?;
                drop(uvw_m);
                let mut nodes = transform.nodes(&rows);
                let parts = nodes.in_parts(&rows, reduction.step(chans))?;
                let reduced = fill(&parts, limits, reduction, (coverage, chans), read)?;
                gridder.add_nodes(&rows, &nodes)?;
                Ok(reduced)
            }
            Planes::Shared(gridder) => {
                let rows = transform.fold(uvw_m.view())?;
                drop(uvw_m);
                let mut letters = gridder.letters(rows)?;
                let reduced = fill(&letters.in_parts(reduction.step(chans)), limits, reduction, (coverage, chans), read)?;
                let factor = common_scale((&mut self.scale, &mut self.agreed), &*self.ranks);
                gridder.add(Some((letters, factor)), &*self.ranks)?;
                self.rounds = self.rounds.saturating_sub(1);
                Ok(reduced)
            }
        }
    }

    /// Grid what other processes still read, after the last block of this one.
    pub(super) fn finish_rounds(&mut self) -> Result<()> {
        if let Some((_, Planes::Shared(gridder))) = &mut self.at_work {
            for _ in 0..std::mem::take(&mut self.rounds) {
                common_scale((&mut self.scale, &mut self.agreed), &*self.ranks);
                gridder.add(None, &*self.ranks)?;
            }
            gridder.grid_last(&*self.ranks)?;
        }
        let mut failed = [f64::from(u8::from(self.has_failed()))];
        self.ranks.largest(&mut failed);
        self.overflows.fetch_or(failed[0] > 0.0, Relaxed);
        Ok(())
    }

    /// True if the image is of no use, because the weight that was met first is far smaller than others. The visibilities must then be read again.
    pub(super) fn has_failed(&self) -> bool {
        self.overflows.load(Relaxed)
    }

    /// The sum over all visibilities of their images, each times its weight over the scale, and the scale.
    pub(super) fn finish(self) -> Result<Option<(f64, Array2<f32>)>> {
        let Self { at_work, ranks, mut scale, mut agreed, overflows, .. } = self;
        let Some((_, planes)) = at_work.filter(|_| !overflows.into_inner()) else { return Ok(None) };
        let image = match planes {
            Planes::Whole(gridder) if ranks.size() == 1 => gridder.finish(),
            Planes::Whole(gridder) => {
                let (mut image, factor): (Array2<f64>, f32) = (gridder.finish(), common_scale((&mut scale, &mut agreed), &*ranks));
                image *= f64::from(factor);
                summed(&*ranks, &mut image);
                in_precision(image)
            }
            Planes::Shared(gridder) => gridder.finish(&*ranks)?,
        };
        Ok(Some((scale.get().copied().unwrap_or(1.0), image)))
    }
}

/// Make the scale of all processes the largest of them, and say by what the values over the scale of this process must be multiplied. A process that has met no weight yet
/// takes the scale of the others. Once they agree, they need not ask each other.
fn common_scale((scale, agreed): (&mut OnceLock<f64>, &mut bool), ranks: &dyn Ranks) -> f32 {
    if *agreed {
        return 1.0;
    }
    let own = scale.get().copied();
    let mut largest = [own.unwrap_or(0.0)];
    ranks.largest(&mut largest);
    if largest[0] > 0.0 {
        (*scale, *agreed) = (OnceLock::from(largest[0]), true);
    }
    own.map_or(1.0, |own| (own / largest[0]) as f32)
}

/// Read rows, and set the nodes to those of their visibilities, times weights over the scale. `overflows` becomes true where such a weight is too large.
fn fill(
    parts: &impl SetNodes<f32>,
    (scale, overflows): (&OnceLock<f64>, &AtomicBool),
    reduction: &Reduction,
    shape: (&UvCoverage, usize),
    read: (&mut dyn PartSource, Range<usize>),
) -> Result<(ReducedBlock, DataCounts)> {
    let take = |rows: Range<usize>, vis: &[Complex32], weights: &[f32]| {
        if put((parts, rows), (vis, weights), scale) > MOST {
            overflows.store(true, Relaxed);
        }
    };
    reduction.reduce_parts(shape, read, Some(&take))
}

/// Set the nodes of rows to those of their visibilities, times weights over the scale \[row, chan\]. Returns the largest of these weights.
fn put((parts, rows): (&impl SetNodes<f32>, Range<usize>), (vis, weights): (&[Complex32], &[f32]), scale: &OnceLock<f64>) -> f32 {
    let chans = vis.len() / rows.len().max(1);
    // Without a weight that counts, all values are 0 by any scale.
    let first = weights.iter().find(|w| **w > 0.0);
    let inverse = first.map_or(1.0, |w| *scale.get_or_init(|| power_of_two_below(*w))).recip() as f32;
    parts.set(rows, |r, out| {
        let of_row = r * chans..(r + 1) * chans;
        for ((out, v), w) in out.iter_mut().zip(&vis[of_row.clone()]).zip(&weights[of_row]) {
            *out = v.scale(*w * inverse);
        }
    });
    largest(weights) * inverse
}

/// The largest of these weights; 0 without any.
fn largest(weights: &[f32]) -> f32 {
    const LANES: usize = 16;
    let (whole, rest) = weights.as_chunks::<LANES>();
    let mut most = [0.0_f32; LANES];
    for weights in whole {
        most.iter_mut().zip(weights).for_each(|(most, w)| *most = most.max(*w));
    }
    most.iter().chain(rest).fold(0.0, |most, w| most.max(*w))
}

/// The largest power of two that is not above a weight, so that weights over it are near 1. Its inverse has an exact value in single precision.
fn power_of_two_below(weight: f32) -> f64 {
    f64::from(weight).log2().floor().clamp(-126.0, 126.0).exp2()
}
