//! Prediction: the visibilities of an image, block by block.

use super::channels::expand;
use super::fft::{corrected, image_to_planes};
use super::grid_options::GridOptions;
use super::lanes::{Work, run_task, tile_len};
use super::plan::{Plan, UvwExtent};
use super::plane_groups::{grid_row, in_group, plane_groups, reaches};
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use super::sort::{Segment, TilePlace};
use super::sorted_rows::SortedRows;
use crate::finite::all_finite;
use crate::{ChainError, Result};
use cittert_arrays::{ArrayError, SkyGrid};
use ndarray::{Array2, ArrayView2, ArrayViewMut2, Axis};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, PoisonError};

/// Predicts the visibilities of one image for many blocks of rows.
///
/// `V = sum of I exp(+2 pi i (u l + v m + w (n - 1)))` over the pixels, to a relative error of `epsilon`. The transformed planes are kept
/// between blocks if they fit into their share of the memory budget. Otherwise they are made again for every block.
#[derive(Debug)]
pub struct Degridder<T: Real> {
    pub(super) plan: Arc<Plan<T>>,
    groups: Vec<Range<usize>>,
    resident: Option<PlaneRows<T>>,
    /// The corrected image, where the planes are made again for every block.
    image: Array2<T>,
}

impl<T: Real> Degridder<T> {
    /// A predictor of the image `plane` \[m, l\] for channels, a range of uvw, and about `n_vis` visibilities in all, if their number is known:
    /// a small set needs less memory.
    ///
    /// # Errors
    /// The image has another shape than the grid, a pixel is not finite, no kernel reaches epsilon, or a frequency is not positive.
    pub fn new(
        grid: &SkyGrid,
        plane: ArrayView2<'_, f64>,
        freq_hz: &[f64],
        extent: UvwExtent,
        opts: &GridOptions,
        n_vis: Option<u64>,
    ) -> Result<Self> {
        Self::on(Arc::new(Plan::new(grid, freq_hz, extent, opts, n_vis)?), plane)
    }

    pub(super) fn on<P: Real>(plan: Arc<Plan<T>>, plane: ArrayView2<'_, P>) -> Result<Self> {
        check_image(&plan, plane)?;
        let groups = plane_groups(&plan, plan.plane_bytes);
        let one = groups.len() == 1;
        let resident = one.then(|| image_to_planes(&plan, plane, (true, 0..plan.planes())));
        let image = if one { Array2::zeros((0, 0)) } else { corrected(&plan, plane) };
        Ok(Self { plan, groups, resident, image })
    }

    /// Write the visibilities of rows with these uvw in m \[row, 3\] into `out` \[row, chan\].
    ///
    /// # Errors
    /// The shapes differ, or a uvw is not finite or lies outside the extent that was given to the constructor.
    pub fn predict(&self, uvw_m: ArrayView2<'_, f64>, out: ArrayViewMut2<'_, Complex<T>>) -> Result<()> {
        self.predict_as(uvw_m, out, |v| v)
    }

    /// The same, with each value changed by `convert`.
    pub(crate) fn predict_as<O: Send>(
        &self,
        uvw_m: ArrayView2<'_, f64>,
        out: ArrayViewMut2<'_, O>,
        convert: impl Fn(Complex<T>) -> O + Sync,
    ) -> Result<()> {
        self.plan.check_rows(uvw_m, out.dim())?;
        self.predict_sorted(&SortedRows::new(&self.plan, uvw_m)?, out, convert)
    }

    /// Write the visibilities of sorted rows into `out` \[row, chan\], each changed by `convert`.
    pub(super) fn predict_sorted<O: Send>(
        &self,
        rows: &SortedRows,
        out: ArrayViewMut2<'_, O>,
        convert: impl Fn(Complex<T>) -> O + Sync,
    ) -> Result<()> {
        let plan = &self.plan;
        let nodes = self.nodes(rows)?;
        let mut rest = out;
        let mut parts = Vec::with_capacity(rows.chunks.len());
        for chunk in &rows.chunks {
            let (part, after) = rest.split_at(Axis(0), chunk.range.len());
            parts.push(part);
            rest = after;
        }
        parts.into_par_iter().zip(&rows.chunks).zip(&nodes).for_each(|((mut part, chunk), nodes)| {
            let (mut buffer, mut parts) = (vec![Complex::default(); plan.n_chan()], Vec::new());
            for (mut to, row) in part.rows_mut().into_iter().zip(&chunk.rows) {
                let class = &plan.channels.classes[row.class];
                let nodes = &nodes[row.offset..row.offset + class.n_nodes()];
                expand(class, (nodes, &mut parts), &mut buffer);
                to.iter_mut().zip(&buffer).for_each(|(t, b)| *t = convert(*b));
            }
        });
        plan.pool.give(nodes);
        Ok(())
    }

    /// The predicted nodes of sorted rows, one list for each chunk.
    pub(super) fn nodes(&self, rows: &SortedRows) -> Result<Vec<Vec<Complex<T>>>> {
        let plan = &self.plan;
        let mut nodes: Vec<Vec<Complex<T>>> = rows.chunks.par_iter().map(|c| plan.pool.take(c.n_nodes)).collect();
        if let Some(planes) = &self.resident {
            degrid_units(plan, (rows, 0..plan.tiles_v()), (planes, 0..plan.planes()), &mut nodes)?;
        } else {
            // A buffer may hold anything, and each group adds its part.
            nodes.iter_mut().for_each(|n| n.fill(Complex::default()));
            for group in &self.groups {
                let planes = image_to_planes(plan, self.image.view(), (false, group.clone()));
                degrid_units(plan, (rows, 0..plan.tiles_v()), (&planes, group.clone()), &mut nodes)?;
            }
        }
        Ok(nodes)
    }
}

impl<T: Real> Drop for Degridder<T> {
    fn drop(&mut self) {
        if let Some(planes) = self.resident.take() {
            self.plan.pool.give_planes(planes);
        }
    }
}

/// Check the shape and the pixels of an image to predict.
pub(super) fn check_image<T: Real, P: Real>(plan: &Plan<T>, plane: ArrayView2<'_, P>) -> Result<()> {
    let grid = &plan.grid;
    if plane.dim() != (grid.n_m, grid.n_l) {
        let found = plane.shape().to_vec();
        return Err(ArrayError::ShapeMismatch { what: "image to predict", expected: vec![grid.n_m, grid.n_l], found }.into());
    }
    if !all_finite(&plane, P::to64)
        && let Some(((m, l), v)) = plane.indexed_iter().find(|(_, v)| !v.to64().is_finite())
    {
        let what = format!("pixel (column {l}, row {m}) of the image to predict");
        return Err(ArrayError::BadValue { what, value: v.to64().to_string(), expected: "a finite number" }.into());
    }
    Ok(())
}

/// Predict what a group of planes contributes to those `nodes` that lie in some rows of tiles. All planes replace what the nodes hold, and a part of them adds to it.
pub(super) fn degrid_units<T: Real>(
    plan: &Plan<T>,
    (rows, band): (&SortedRows, Range<usize>),
    (planes, group): (&PlaneRows<T>, Range<usize>),
    nodes: &mut [Vec<Complex<T>>],
) -> Result<()> {
    let targets: Vec<Target<T>> = nodes.iter_mut().map(|n| Target { first: n.as_mut_ptr(), len: n.len() }).collect();
    let inside = rows.colours.iter().flatten().filter(|u| band.contains(&u.v) && reaches(plan, u.slab, &group));
    let pieces: Vec<&[Segment]> = inside.flat_map(|u| &u.pieces).map(Vec::as_slice).collect();
    pieces.par_iter().with_max_len(1).try_for_each_init(
        || plan.pool.tile(tile_len(plan)),
        |tile, piece| run_task(plan, (&rows.chunks, &[]), piece, (tile, &mut Load { plan, planes, group: &group, targets: &targets })),
    )
}

/// The nodes of one chunk. Several threads write them at the same time.
struct Target<T> {
    first: *mut Complex<T>,
    len: usize,
}

// SAFETY: every node belongs to exactly one run, every run to exactly one segment and every segment to exactly one piece of a unit, so no two
// threads ever write the same node, and no thread reads them before all pieces have ended.
unsafe impl<T: Send> Sync for Target<T> {}

/// Fills tiles from the planes.
struct Load<'a, T: Real> {
    plan: &'a Plan<T>,
    planes: &'a PlaneRows<T>,
    group: &'a Range<usize>,
    targets: &'a [Target<T>],
}

impl<T: Real> Work<T> for Load<'_, T> {
    const GRID: bool = false;

    fn begin(&mut self, place: TilePlace, tile: &mut [T]) {
        let (plan, width) = (self.plan, self.planes.width);
        let stride = TILE + plan.table.lanes;
        let depth = plan.slab_depth();
        for (k, line) in tile.chunks_exact_mut(depth * 2 * stride).enumerate() {
            let Some(r) = grid_row(plan, place.v, k) else {
                line.fill(T::default());
                continue;
            };
            let rows = self.planes.stripes[r / TILE].lock().unwrap_or_else(PoisonError::into_inner);
            for (p, plane) in line.chunks_exact_mut(2 * stride).enumerate() {
                let Some(p) = in_group(place.slab, p, self.group) else {
                    plane.fill(T::default());
                    continue;
                };
                let at = ((r % TILE) * self.planes.planes + p) * width;
                let row = &rows[at..at + width];
                let plane: &mut [Complex<T>] = bytemuck::cast_slice_mut(plane);
                let first = place.u * TILE;
                if let Some(cells) = row.get(first..first + stride) {
                    plane.copy_from_slice(cells);
                    continue;
                }
                for (i, cell) in plane.iter_mut().enumerate() {
                    *cell = row[(first + i) % width];
                }
            }
        }
    }

    fn end(&mut self, _place: TilePlace, _tile: &mut [T], _planes: usize) {}

    fn store(&mut self, chunk: usize, first: usize, values: &[Complex<T>]) -> Result<()> {
        let target = &self.targets[chunk];
        if first + values.len() > target.len {
            return Err(ChainError::Internal(format!("a run ends at node {}, but its chunk has {}", first + values.len(), target.len)));
        }
        // SAFETY: in bounds by the check above, and no other thread writes these nodes (see `Target`).
        let nodes = unsafe { std::slice::from_raw_parts_mut(target.first.add(first), values.len()) };
        if self.group.len() == self.plan.planes() {
            nodes.copy_from_slice(values);
        } else {
            nodes.iter_mut().zip(values).for_each(|(n, v)| *n += *v);
        }
        Ok(())
    }
}
