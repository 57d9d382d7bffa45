//! Gridding: the image of visibilities that are added block by block.

use super::channels::{compress, expand};
use super::degridder::Degridder;
use super::fft::{correct, planes_to_image};
use super::grid_options::GridOptions;
use super::lanes::{Work, ask_for, run_task, tile_len};
use super::plan::{Plan, UvwExtent};
use super::plane_groups::{grid_row, in_group, plane_groups, reaches};
use super::plane_rows::{PlaneRows, TILE};
use super::pool::TileBuffer;
use super::real::{Real, in_precision};
use super::sort::{Chunk, TilePlace};
use super::sorted_rows::SortedRows;
use super::turns::{Turn, Turns, take_turns};
use super::units::Unit;
use crate::pages::zeros;
use crate::{ChainError, Result};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};
use std::sync::{Arc, Mutex, PoisonError};

/// Sums the weighted visibilities of many blocks into one image.
///
/// The image is the real part of the sum of `w V exp(-2 pi i (u l + v m + w (n - 1)))` over everything added, \[m, l\], to a relative
/// error of `epsilon`. It needs memory for the planes and for one block of rows. Planes that fit into the share of the memory budget stay in
/// memory from the first block to the last. Otherwise they are made and transformed in groups for every block, and the sum over the planes is
/// corrected at the end.
#[derive(Debug)]
pub struct Gridder<T: Real> {
    pub(super) plan: Arc<Plan<T>>,
    groups: Vec<Range<usize>>,
    resident: Option<PlaneRows<T>>,
    /// The sum of the groups of planes that were transformed so far, before its correction.
    image: Option<Array2<T>>,
}

impl<T: Real> Gridder<T> {
    /// A gridder for an image, channels and a range of uvw.
    ///
    /// # Errors
    /// No kernel reaches epsilon, or a frequency is not positive.
    pub fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions) -> Result<Self> {
        Ok(Self::on(Arc::new(Plan::new(grid, freq_hz, extent, opts, None)?)))
    }

    pub(super) fn on(plan: Arc<Plan<T>>) -> Self {
        let groups = plane_groups(&plan, plan.plane_bytes);
        let resident = (groups.len() == 1).then(|| plan.pool.take_empty_planes(plan.n_rows, plan.planes(), plan.columns.with_pixels));
        Self { plan, groups, resident, image: None }
    }

    /// Add rows: uvw in m \[row, 3\] and weighted visibilities \[row, chan\]. A visibility that must not count has the value 0.
    ///
    /// # Errors
    /// The shapes differ, or a uvw is not finite or lies outside the extent that was given to the constructor.
    pub fn add(&mut self, uvw_m: ArrayView2<'_, f64>, weighted: ArrayView2<'_, Complex<T>>) -> Result<()> {
        self.plan.check_rows(uvw_m, weighted.dim())?;
        let rows = SortedRows::new(&self.plan, uvw_m)?;
        self.add_sorted(&rows, |row, vis| vis.iter_mut().zip(weighted.row(row)).for_each(|(v, w)| *v = *w))
    }

    /// Add rows that were sorted by the transform of this gridder. `values` writes the weighted visibilities of a row into a slice \[chan\].
    ///
    /// # Errors
    /// The rows were sorted by another transform.
    pub fn add_sorted(&mut self, rows: &SortedRows, values: impl Fn(usize, &mut [Complex<T>]) + Sync) -> Result<()> {
        rows.check(&self.plan)?;
        let plan = &self.plan;
        let nodes: Vec<Vec<Complex<T>>> = rows.chunks.par_iter().map(|c| fill(plan, c, |_| true, &values)).collect();
        self.spread(rows, &nodes)?;
        self.plan.pool.give(nodes);
        Ok(())
    }

    /// Predict the visibilities of sorted rows from a model, change them with `turn`, and add the result. `turn` receives the predicted
    /// visibilities \[chan\] of one row and replaces them by the values to be gridded. The values that `turn` returns are summed. The
    /// predicted visibilities of all rows are never in memory at the same time.
    ///
    /// # Errors
    /// The rows or the model belong to another transform.
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
        let mut nodes = model.nodes(rows)?;
        let sum = turn_nodes(plan, rows, &mut nodes, turn);
        self.spread(rows, &nodes)?;
        self.plan.pool.give(nodes);
        Ok(sum)
    }

    /// Spread the nodes onto the planes.
    pub(super) fn spread(&mut self, rows: &SortedRows, nodes: &[Vec<Complex<T>>]) -> Result<()> {
        let plan = &self.plan;
        let nodes = &slices(nodes)[..];
        if let Some(planes) = &self.resident {
            return grid_units(plan, (rows, nodes), (planes, 0..plan.planes()), 0..plan.tiles_v());
        }
        let mut kept: Option<PlaneRows<T>> = None;
        for group in &self.groups {
            // Planes of a group of another size are freed before the next ones are made.
            let same = kept.take().filter(|k| k.fits(plan.n_rows, group.len(), plan.columns.with_pixels));
            let mut planes = same.unwrap_or_else(|| PlaneRows::zeros(plan.n_rows, group.len(), plan.columns.with_pixels));
            grid_units(plan, (rows, nodes), (&planes, group.clone()), 0..plan.tiles_v())?;
            let image = self.image.get_or_insert_with(|| zeros((plan.grid.n_m, plan.grid.n_l)));
            planes = planes_to_image(plan, planes, group.start, image);
            planes.clear();
            kept = Some(planes);
        }
        Ok(())
    }

    /// The image \[m, l\] of all visibilities that were added.
    #[must_use]
    pub fn finish<P: Real>(mut self) -> Array2<P> {
        let mut image = self.image.take().unwrap_or_else(|| zeros((self.plan.grid.n_m, self.plan.grid.n_l)));
        if let Some(planes) = self.resident.take() {
            let planes = planes_to_image(&self.plan, planes, 0, &mut image);
            self.plan.pool.give_planes(planes);
        } else {
            correct(&self.plan, &mut image);
        }
        in_precision(image)
    }
}

/// The nodes of those rows of a chunk that are `wanted`, by their place in it. `values` writes the weighted visibilities of a row into a slice \[chan\].
pub(super) fn fill<T: Real>(
    plan: &Plan<T>,
    chunk: &Chunk,
    wanted: impl Fn(usize) -> bool,
    values: impl Fn(usize, &mut [Complex<T>]),
) -> Vec<Complex<T>> {
    let mut nodes = plan.pool.take(chunk.n_nodes);
    let (mut vis, mut parts) = (vec![Complex::default(); plan.n_chan()], Vec::new());
    for (k, row) in chunk.rows.iter().enumerate().filter(|(k, _)| wanted(*k)) {
        let class = &plan.channels.classes[row.class];
        values(chunk.range.start + k, &mut vis);
        compress(class, (&vis, &mut parts), &mut nodes[row.offset..row.offset + class.n_nodes()]);
    }
    nodes
}

/// Replace predicted nodes by those of the values that `turn` makes of the predicted visibilities of each row \[chan\]. What it returns is summed.
pub(super) fn turn_nodes<T: Real, S: Default + AddAssign + Send>(
    plan: &Plan<T>,
    rows: &SortedRows,
    nodes: &mut [Vec<Complex<T>>],
    turn: impl Fn(usize, &mut [Complex<T>]) -> S + Sync,
) -> S {
    let change = |(chunk, nodes): (&Chunk, &mut Vec<Complex<T>>)| {
        let (mut vis, mut parts) = (vec![Complex::default(); plan.n_chan()], Vec::new());
        let mut sum = S::default();
        for (r, row) in chunk.range.clone().zip(&chunk.rows) {
            let class = &plan.channels.classes[row.class];
            let nodes = &mut nodes[row.offset..row.offset + class.n_nodes()];
            expand(class, (nodes, &mut parts), &mut vis);
            sum += turn(r, &mut vis);
            compress(class, (&vis, &mut parts), nodes);
        }
        sum
    };
    let sums: Vec<S> = rows.chunks.par_iter().zip(nodes).map(change).collect();
    sums.into_iter().fold(S::default(), |mut total, s| {
        total += s;
        total
    })
}

/// Some lists as slices.
pub(super) fn slices<V>(lists: &[Vec<V>]) -> Vec<&[V]> {
    lists.iter().map(Vec::as_slice).collect()
}

/// Grid the visibilities of some rows of tiles onto a group of planes. What a cell receives is summed in the order of the colours.
pub(super) fn grid_units<T: Real>(
    plan: &Plan<T>,
    (rows, nodes): (&SortedRows, &[&[Complex<T>]]),
    (planes, group): (&PlaneRows<T>, Range<usize>),
    band: Range<usize>,
) -> Result<()> {
    let input = (rows.chunks.as_slice(), nodes);
    let tile = || plan.pool.tile(tile_len(plan));
    let inside = |u: &&Unit| band.contains(&u.v) && reaches(plan, u.slab, &group);
    let units = rows.colours.iter().enumerate().flat_map(|(colour, units)| units.iter().filter(inside).map(move |u| (colour, u)));
    let units: Vec<Tiles<'_, T>> = units.map(|(colour, unit)| Tiles { colour, unit, sums: Mutex::default() }).collect();
    let tasks: Vec<(&Tiles<'_, T>, usize)> = units.iter().flat_map(|u| (0..u.unit.pieces.len()).map(move |piece| (u, piece))).collect();
    let turns = Turns::new((rows.colours.len(), plan.tiles_v()), tasks.iter().map(|(of, _)| (of.colour, of.unit.v)));
    take_turns(&tasks, tile, |own, (of, piece)| {
        let segments = &of.unit.pieces[*piece];
        let mut flush = Flush { plan, planes, group: &group, turn: turns.of(of.colour, of.unit.v) };
        if of.unit.pieces.len() == 1 {
            return run_task(plan, input, segments, (own, &mut flush));
        }
        let (mut own, mut hold) = (tile(), Hold { planes: 0 });
        run_task(plan, input, segments, (&mut own, &mut hold))?;
        for (mut own, reached) in of.complete(*piece, (own, hold.planes)) {
            flush.end(TilePlace::of(plan, segments[0].key), &mut own, reached);
        }
        Ok(())
    })
}

/// The tiles of a unit while it is gridded.
struct Tiles<'a, T: Real> {
    colour: usize,
    unit: &'a Unit,
    /// The sums of those pieces of a crowded tile that are ready, with their places.
    sums: Mutex<Vec<(usize, Sum<'a, T>)>>,
}

/// The sum of a piece of a tile, and how many planes it reaches.
type Sum<'a, T> = (TileBuffer<'a, T>, usize);

impl<'a, T: Real> Tiles<'a, T> {
    /// Put the sum of a piece to the others. The last one gets all sums, in the order of their pieces.
    fn complete(&self, piece: usize, sum: Sum<'a, T>) -> Vec<Sum<'a, T>> {
        let mut sums = self.sums.lock().unwrap_or_else(PoisonError::into_inner);
        sums.push((piece, sum));
        if sums.len() < self.unit.pieces.len() {
            return Vec::new();
        }
        sums.sort_by_key(|(piece, _)| *piece);
        std::mem::take(&mut *sums).into_iter().map(|(_, sum)| sum).collect()
    }
}

/// Keeps the sum of one tile in its buffer, and how many planes it reaches.
struct Hold {
    planes: usize,
}

impl<T: Real> Work<T> for Hold {
    const GRID: bool = true;

    fn begin(&mut self, _place: TilePlace, _tile: &mut [T]) {}

    fn end(&mut self, _place: TilePlace, _tile: &mut [T], planes: usize) {
        self.planes = self.planes.max(planes);
    }

    fn store(&mut self, _chunk: usize, _first: usize, _values: &[Complex<T>]) -> Result<()> {
        Ok(())
    }
}

/// Bytes that the processor loads at once.
const IN_CACHE_LINE: usize = 64;

/// Adds finished tiles to the planes, from its turn on. It locks one stripe of rows at a time.
struct Flush<'a, T: Real> {
    plan: &'a Plan<T>,
    planes: &'a PlaneRows<T>,
    group: &'a Range<usize>,
    turn: Turn<'a>,
}

impl<T: Real> Work<T> for Flush<'_, T> {
    const GRID: bool = true;

    fn begin(&mut self, _place: TilePlace, _tile: &mut [T]) {}

    fn end(&mut self, place: TilePlace, tile: &mut [T], planes: usize) {
        self.turn.wait();
        let (plan, width) = (self.plan, self.planes.width);
        let stride = TILE + plan.table.lanes;
        let depth = plan.slab_depth();
        let cells = TILE + plan.table.support;
        let lock = |stripe: usize| (stripe, self.planes.stripes[stripe].lock().unwrap_or_else(PoisonError::into_inner));
        let mut held = None;
        for (k, line) in tile.chunks_exact_mut(depth * 2 * stride).enumerate() {
            let line = &mut line[..planes * 2 * stride];
            let Some(r) = grid_row(plan, place.v, k) else {
                line.fill(T::default());
                continue;
            };
            // The lock of the stripe before is released first: two tasks that each wait for the other would stop.
            if held.as_ref().is_some_and(|(stripe, _)| *stripe != r / TILE) {
                held = None;
            }
            let (_, rows) = held.get_or_insert_with(|| lock(r / TILE));
            let first = place.u * TILE;
            // The lines of the planes lie far apart, which the processor cannot foresee.
            if (r + 1) % TILE != 0 {
                for p in (0..planes).filter_map(|p| in_group(place.slab, p, self.group)) {
                    let next = ((r % TILE + 1) * self.planes.planes + p) * width + first;
                    (next..next + cells).step_by(IN_CACHE_LINE / size_of::<Complex<T>>()).for_each(|at| ask_for(rows, at));
                }
            }
            for (p, plane) in line.chunks_exact(2 * stride).enumerate() {
                let Some(p) = in_group(place.slab, p, self.group) else { continue };
                let at = ((r % TILE) * self.planes.planes + p) * width;
                let row = &mut rows[at..at + width];
                let plane: &[Complex<T>] = &bytemuck::cast_slice(plane)[..cells];
                if first + cells <= width {
                    let row = &mut row[first..first + cells];
                    for k in 0..cells {
                        row[k] += plane[k];
                    }
                } else {
                    for (i, cell) in plane.iter().enumerate() {
                        row[(first + i) % width] += *cell;
                    }
                }
            }
            // The next tile starts with 0.
            line.fill(T::default());
        }
    }

    fn store(&mut self, _chunk: usize, _first: usize, _values: &[Complex<T>]) -> Result<()> {
        Ok(())
    }
}
