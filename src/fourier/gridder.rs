//! Visibilities onto the grid and the grid into an image, block after block of rows.

use super::GridOptions;
use super::channels::ChannelClass;
use super::fft::{PlaneRows, planes_to_image};
use super::lanes::{Work, fused, run_task, tile_len};
use super::plan::{Plan, TILE, UvwExtent};
use super::real::Real;
use super::sort::{Chunk, Segment, TilePlace, shares, tasks};
use super::wplanes::SLAB;
use crate::Result;
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::PoisonError;

/// Planes up to this size stay in memory from the first block to the last; more are transformed for every block.
pub(super) const PLANES_BYTES: usize = 900 << 20;

/// Sums weighted visibilities of many blocks into one image.
///
/// The image is the real part of the sum of `w V exp(-2 pi i (u l + v m + w (n - 1)))` over everything added, \[m, l\], to a relative
/// error of `epsilon`. Memory is that of the planes and of one block.
#[derive(Debug)]
pub struct Gridder<T: Real> {
    plan: Plan<T>,
    groups: Vec<Range<usize>>,
    resident: Option<PlaneRows<T>>,
    image: Array2<f64>,
}

/// Slabs of w in groups whose planes fit into memory together.
pub(super) fn plane_groups<T: Real>(plan: &Plan<T>, budget: usize) -> Vec<Range<usize>> {
    let slabs = plan.slabs();
    let overlap = plan.slab_depth().saturating_sub(SLAB);
    let fits = |n: usize| slabs == 1 || PlaneRows::<T>::bytes(plan.n_rows, n * SLAB + overlap, plan.nu) <= budget;
    let step = (1..=slabs).rev().find(|n| fits(*n)).unwrap_or(1);
    (0..slabs).step_by(step).map(|s| s..(s + step).min(slabs)).collect()
}

/// Number of planes of a group of slabs.
pub(super) fn planes_of<T: Real>(plan: &Plan<T>, group: &Range<usize>) -> usize {
    if plan.slabs() == 1 { plan.slab_depth() } else { (group.len() - 1) * SLAB + plan.slab_depth() }
}

impl<T: Real> Gridder<T> {
    /// A gridder for an image, channels and a range of uvw.
    ///
    /// # Errors
    /// An epsilon that no kernel reaches, frequencies that are not positive.
    pub fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions) -> Result<Self> {
        let plan = Plan::new(grid, freq_hz, extent, opts)?;
        let groups = plane_groups(&plan, PLANES_BYTES);
        let resident = (groups.len() == 1).then(|| PlaneRows::zeros(plan.n_rows, planes_of(&plan, &groups[0]), plan.nu));
        let image = Array2::zeros((grid.n_m, grid.n_l));
        Ok(Self { plan, groups, resident, image })
    }

    /// Add rows: uvw in m \[row, 3\] and weighted visibilities \[row, chan\]. What must not count is 0.
    ///
    /// # Errors
    /// Shapes that do not fit, uvw that are not finite or outside the announced extent.
    pub fn add(&mut self, uvw_m: ArrayView2<'_, f64>, weighted: ArrayView2<'_, Complex<T>>) -> Result<()> {
        self.plan.check_rows(uvw_m, weighted.dim())?;
        let weighted = weighted.as_standard_layout();
        let plan = &self.plan;
        let fill = |r: usize, class: usize, nodes: &mut [Complex<T>]| {
            if let Some(vis) = weighted.row(r).as_slice() {
                compress(&plan.channels.classes[class], vis, nodes);
            }
        };
        let chunks: Vec<Chunk<T>> =
            shares(uvw_m.nrows()).into_par_iter().map(|range| Chunk::new(plan, uvw_m, range, |r, row, n| fill(r, row.class, n))).collect();
        let tasks = tasks(&chunks);
        if let Some(planes) = &self.resident {
            grid_tasks(plan, &chunks, tasks, (planes, 0));
            return Ok(());
        }
        for group in &self.groups {
            let planes = PlaneRows::zeros(plan.n_rows, planes_of(plan, group), plan.nu);
            grid_tasks(plan, &chunks, within(plan, &tasks, group), (&planes, group.start * SLAB));
            planes_to_image(plan, planes, group.start * SLAB, &mut self.image);
        }
        Ok(())
    }

    /// The image \[m, l\] of everything added.
    #[must_use]
    pub fn finish(mut self) -> Array2<f64> {
        if let Some(planes) = self.resident.take() {
            planes_to_image(&self.plan, planes, 0, &mut self.image);
        }
        self.image
    }
}

/// The segments of the slabs of a group.
pub(super) fn within<T: Real>(plan: &Plan<T>, tasks: &[Vec<Segment>], group: &Range<usize>) -> Vec<Vec<Segment>> {
    let inside = |s: &&Segment| group.contains(&TilePlace::of(plan, s.key).slab);
    tasks.iter().map(|t| t.iter().filter(inside).cloned().collect::<Vec<_>>()).filter(|t| !t.is_empty()).collect()
}

pub(super) fn grid_tasks<T: Real>(
    plan: &Plan<T>,
    chunks: &[Chunk<T>],
    tasks: Vec<Vec<Segment>>,
    (planes, first_plane): (&PlaneRows<T>, usize),
) {
    tasks.into_par_iter().for_each_init(
        || vec![T::default(); tile_len(plan)],
        |tile, task| run_task(plan, chunks, &task, (tile, &mut Flush { plan, planes, first_plane })),
    );
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn compress_avx2<T: Real>(class: &ChannelClass<T>, vis: &[Complex<T>], nodes: &mut [Complex<T>]) {
    class.compress::<true>(vis, nodes);
}

pub(super) fn compress<T: Real>(class: &ChannelClass<T>, vis: &[Complex<T>], nodes: &mut [Complex<T>]) {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        unsafe { compress_avx2(class, vis, nodes) };
        return;
    }
    class.compress::<false>(vis, nodes);
}

/// Adds finished tiles to the planes, one stripe of rows locked at a time.
struct Flush<'a, T: Real> {
    plan: &'a Plan<T>,
    planes: &'a PlaneRows<T>,
    first_plane: usize,
}

/// Row of the half grid that a row of a tile is; `None` for the empty rows past the last.
pub(super) fn grid_row<T: Real>(plan: &Plan<T>, tile_v: usize, row: usize) -> Option<usize> {
    let r = tile_v * TILE + row;
    if r < plan.n_rows { Some(r) } else { r.checked_sub(plan.nv).filter(|r| *r < plan.n_rows) }
}

impl<T: Real> Work<T> for Flush<'_, T> {
    const GRID: bool = true;

    fn begin(&mut self, _place: TilePlace, tile: &mut [T]) {
        tile.fill(T::default());
    }

    fn end(&mut self, place: TilePlace, tile: &mut [T]) {
        let (plan, nu) = (self.plan, self.plan.nu);
        let stride = TILE + plan.table.lanes;
        let depth = plan.slab_depth();
        let first_plane = if plan.slabs() == 1 { 0 } else { place.slab * SLAB - self.first_plane };
        let cells = TILE + plan.table.support;
        let mut held = None;
        for (k, line) in tile.chunks_exact(depth * 2 * stride).enumerate() {
            let Some(r) = grid_row(plan, place.v, k) else { continue };
            let stripe = r / TILE;
            if held.as_ref().is_none_or(|(s, _)| *s != stripe) {
                drop(held.take());
                held = Some((stripe, self.planes.stripes[stripe].lock().unwrap_or_else(PoisonError::into_inner)));
            }
            let Some((_, rows)) = held.as_mut() else { continue };
            for (p, plane) in line.chunks_exact(2 * stride).enumerate() {
                let at = ((r % TILE) * self.planes.planes + first_plane + p) * nu;
                let row = &mut rows[at..at + nu];
                let (re, im) = plane.split_at(stride);
                let first = place.u * TILE;
                if first + cells <= nu {
                    for ((g, re), im) in row[first..first + cells].iter_mut().zip(re).zip(im) {
                        g.re += *re;
                        g.im += *im;
                    }
                } else {
                    for (i, (re, im)) in re.iter().zip(im).take(cells).enumerate() {
                        let g = &mut row[(first + i) % nu];
                        g.re += *re;
                        g.im += *im;
                    }
                }
            }
        }
    }

    fn store(&mut self, _chunk: usize, _first: usize, _values: &[Complex<T>]) {}
}
