//! A dirty image that is made while the set is read for the first time.
//!
//! With natural weights a visibility counts as much as its own weight says, so that it can be gridded as soon as it is known. The visibilities need
//! not be kept, and a large set is not read again. Every other weighting needs the density of all rows first.

use super::ImagingOptions;
use super::pol::DataCounts;
use super::reduction::{ReducedBlock, Reduction, finite_uvw};
use super::session::LONG;
use super::weights::ImageWeights;
use crate::fourier::{GridOptions, Gridder, NodeParts, Transform, UvwExtent};
use crate::{ChainError, Result};
use cittert_arrays::{PartSource, SkyGrid, UvCoverage, VisUnit, VisibilitySource};
use ndarray::Array2;
use num_complex::Complex32;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The image of a set that is read.
#[derive(Debug)]
pub(super) struct OnePass {
    pub(super) grid: SkyGrid,
    freq_hz: Vec<f64>,
    options: GridOptions,
    /// Number of visibilities, used or not.
    n_vis: u64,
    at_work: Option<(Transform<f32>, Gridder<f32>)>,
    /// Weights are divided by this number. It is a power of two, so that it changes no digit of the image, whichever row is read first.
    scale: OnceLock<f64>,
    /// True where a weight over the scale is so large that the sums could leave single precision.
    overflows: AtomicBool,
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
        if !ImageWeights::will_be_those_of_the_data(options) || source.ranks().size() > 1 {
            return Ok(None);
        }
        let freq_hz = source.header().spectrum.freq_hz().to_vec();
        let n_vis = (source.n_rows() * freq_hz.len()) as u64;
        Ok(Some(Self {
            grid,
            freq_hz,
            options: options.grid_options(),
            n_vis,
            at_work: None,
            scale: OnceLock::new(),
            overflows: AtomicBool::new(false),
        }))
    }

    /// Begin with rows of this extent. Where their planes do not fit into the memory together, the image is not made here.
    pub(super) fn begin(&mut self, extent: UvwExtent) -> Result<()> {
        let transform = Transform::new(&self.grid, &self.freq_hz, extent, &self.options, self.n_vis.min(LONG))?;
        if transform.groups_of_planes() == 1 {
            let gridder = transform.gridder();
            self.at_work = Some((transform, gridder));
        }
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
        let Some((transform, gridder)) = &mut self.at_work else {
            return Err(ChainError::Internal("rows were read for an image that was not begun".into()));
        };
        let rows = transform.sort(finite_uvw(coverage)?.view())?;
        let mut nodes = transform.nodes(&rows);
        let reduced = {
            let (parts, scale, overflows) = (nodes.in_parts(&rows, reduction.step(chans))?, &self.scale, &self.overflows);
            let take = |rows: Range<usize>, vis: &[Complex32], weights: &[f32]| {
                if put((&parts, rows), (vis, weights), scale) > MOST {
                    overflows.store(true, Relaxed);
                }
            };
            reduction.reduce_parts((coverage, chans), read, Some(&take))?
        };
        gridder.add_nodes(&rows, &nodes)?;
        Ok(reduced)
    }

    /// True if the image is of no use, because the weight that was met first is far smaller than others. The visibilities must then be read again.
    pub(super) fn has_failed(&self) -> bool {
        self.overflows.load(Relaxed)
    }

    /// The sum over all visibilities of their images, each times its weight over the scale, and the scale.
    pub(super) fn finish(self) -> Option<(f64, Array2<f32>)> {
        let (_, gridder) = self.at_work.filter(|_| !self.overflows.into_inner())?;
        Some((self.scale.get().copied().unwrap_or(1.0), gridder.finish()))
    }
}

/// Set the nodes of rows to those of their visibilities, times weights over the scale \[row, chan\]. Returns the largest of these weights.
fn put((parts, rows): (&NodeParts<'_, f32>, Range<usize>), (vis, weights): (&[Complex32], &[f32]), scale: &OnceLock<f64>) -> f32 {
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
    weights.iter().fold(0.0_f32, |most, w| most.max(*w)) * inverse
}

/// The largest power of two that is not above a weight, so that weights over it are near 1. Its inverse has an exact value in single precision.
fn power_of_two_below(weight: f32) -> f64 {
    f64::from(weight).log2().floor().clamp(-126.0, 126.0).exp2()
}
