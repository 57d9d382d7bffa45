//! Visibilities onto the grid and the grid into an image, block after block of rows.

use super::GridOptions;
use super::channels::ChannelClass;
use super::degridder::{Degridder, expand};
use super::fft::{PlaneRows, planes_to_image};
use super::lanes::{Work, fused, run_task, tile_len};
use super::plan::{Plan, TILE, UvwExtent};
use super::real::Real;
use super::sort::{Segment, SortedRows, TilePlace};
use super::wplanes::SLAB;
use crate::{ChainError, Result};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};
use std::sync::{Arc, PoisonError};

/// Planes up to this size stay in memory from the first block to the last; more are transformed for every block.
pub(super) const PLANES_BYTES: usize = 900 << 20;

/// Sums weighted visibilities of many blocks into one image.
///
/// The image is the real part of the sum of `w V exp(-2 pi i (u l + v m + w (n - 1)))` over everything added, \[m, l\], to a relative
/// error of `epsilon`. Memory is that of the planes and of one block.
#[derive(Debug)]
pub struct Gridder<T: Real> {
    plan: Arc<Plan<T>>,
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
        Ok(Self::on(Arc::new(Plan::new(grid, freq_hz, extent, opts, None)?)))
    }

    pub(super) fn on(plan: Arc<Plan<T>>) -> Self {
        let groups = plane_groups(&plan, PLANES_BYTES);
        let resident = (groups.len() == 1).then(|| {
            let mut planes = plan.pool.take_planes(plan.n_rows, planes_of(&plan, &groups[0]), plan.nu);
            planes.clear();
            planes
        });
        let image = Array2::zeros((plan.grid.n_m, plan.grid.n_l));
        Self { plan, groups, resident, image }
    }

    /// Add rows: uvw in m \[row, 3\] and weighted visibilities \[row, chan\]. What must not count is 0.
    ///
    /// # Errors
    /// Shapes that do not fit, uvw that are not finite or outside the announced extent.
    pub fn add(&mut self, uvw_m: ArrayView2<'_, f64>, weighted: ArrayView2<'_, Complex<T>>) -> Result<()> {
        self.plan.check_rows(uvw_m, weighted.dim())?;
        let rows = SortedRows::new(&self.plan, uvw_m)?;
        self.add_sorted(&rows, |row, vis| vis.iter_mut().zip(weighted.row(row)).for_each(|(v, w)| *v = *w))
    }

    /// Add rows that were sorted by the transform of this gridder: `values` puts the weighted visibilities of a row into a slice \[chan\].
    ///
    /// # Errors
    /// Rows that another transform sorted.
    pub fn add_sorted(&mut self, rows: &SortedRows, values: impl Fn(usize, &mut [Complex<T>]) + Sync) -> Result<()> {
        rows.check(&self.plan)?;
        let plan = &self.plan;
        let fill = |chunk: &super::sort::Chunk| {
            let mut nodes = plan.pool.take(chunk.n_nodes);
            let mut vis = vec![Complex::default(); plan.n_chan()];
            for (r, row) in chunk.range.clone().zip(&chunk.rows) {
                let class = &plan.channels.classes[row.class];
                values(r, &mut vis);
                compress(class, &vis, &mut nodes[row.offset..row.offset + class.n_nodes()]);
            }
            nodes
        };
        let nodes: Vec<Vec<Complex<T>>> = rows.chunks.par_iter().map(fill).collect();
        self.spread(rows, &nodes);
        self.plan.pool.give(nodes);
        Ok(())
    }

    /// Predict rows from a model, let `turn` make of the predicted visibilities \[chan\] of each row what is to be gridded, and add that.
    /// What `turn` returns is summed up. The visibilities never exist all at once.
    ///
    /// # Errors
    /// Rows or a model of another transform.
    pub fn add_residual<S: Default + AddAssign + Send>(
        &mut self,
        rows: &SortedRows,
        model: &Degridder<T>,
        turn: impl Fn(usize, &mut [Complex<T>]) -> S + Sync,
    ) -> Result<S> {
        rows.check(&self.plan)?;
        if model.plan.id != self.plan.id {
            return Err(ChainError::Incompatible("a model of one transform was given to the gridder of another".into()));
        }
        let plan = &self.plan;
        let mut nodes = model.nodes(rows);
        let change = |(chunk, nodes): (&super::sort::Chunk, &mut Vec<Complex<T>>)| {
            let mut vis = vec![Complex::default(); plan.n_chan()];
            let mut sum = S::default();
            for (r, row) in chunk.range.clone().zip(&chunk.rows) {
                let class = &plan.channels.classes[row.class];
                let nodes = &mut nodes[row.offset..row.offset + class.n_nodes()];
                expand(class, nodes, &mut vis);
                sum += turn(r, &mut vis);
                compress(class, &vis, nodes);
            }
            sum
        };
        let sums: Vec<S> = rows.chunks.par_iter().zip(&mut nodes).map(change).collect();
        self.spread(rows, &nodes);
        self.plan.pool.give(nodes);
        Ok(sums.into_iter().fold(S::default(), |mut total, s| {
            total += s;
            total
        }))
    }

    /// Nodes onto the planes.
    fn spread(&mut self, rows: &SortedRows, nodes: &[Vec<Complex<T>>]) {
        let plan = &self.plan;
        if let Some(planes) = &self.resident {
            grid_tasks(plan, (rows, nodes), &rows.tasks, (planes, 0));
            return;
        }
        for group in &self.groups {
            let planes = PlaneRows::zeros(plan.n_rows, planes_of(plan, group), plan.nu);
            grid_tasks(plan, (rows, nodes), &within(plan, &rows.tasks, group), (&planes, group.start * SLAB));
            planes_to_image(plan, planes, group.start * SLAB, &mut self.image);
        }
    }

    /// The image \[m, l\] of everything added.
    #[must_use]
    pub fn finish(mut self) -> Array2<f64> {
        if let Some(planes) = self.resident.take() {
            let planes = planes_to_image(&self.plan, planes, 0, &mut self.image);
            self.plan.pool.give_planes(planes);
        }
        self.image
    }
}

/// The segments of the slabs of a group.
pub(super) fn within<T: Real>(plan: &Plan<T>, tasks: &[Vec<Segment>], group: &Range<usize>) -> Vec<Vec<Segment>> {
    let inside = |s: &&Segment| group.contains(&TilePlace::of(plan, s.key).slab);
    tasks.iter().map(|t| t.iter().filter(inside).cloned().collect::<Vec<_>>()).filter(|t| !t.is_empty()).collect()
}

fn grid_tasks<T: Real>(
    plan: &Plan<T>,
    (rows, nodes): (&SortedRows, &[Vec<Complex<T>>]),
    tasks: &[Vec<Segment>],
    (planes, first_plane): (&PlaneRows<T>, usize),
) {
    tasks.par_iter().for_each_init(
        || vec![T::default(); tile_len(plan)],
        |tile, task| run_task(plan, (&rows.chunks, nodes), task, (tile, &mut Flush { plan, planes, first_plane })),
    );
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn compress_avx2<T: Real>(class: &ChannelClass<T>, vis: &[Complex<T>], nodes: &mut [Complex<T>]) {
    class.compress::<true>(vis, nodes);
}

fn compress<T: Real>(class: &ChannelClass<T>, vis: &[Complex<T>], nodes: &mut [Complex<T>]) {
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
                    let (row, re, im) = (&mut row[first..first + cells], &re[..cells], &im[..cells]);
                    for k in 0..cells {
                        row[k].re += re[k];
                        row[k].im += im[k];
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
