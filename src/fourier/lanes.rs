//! The innermost loops: they spread a batch of visibilities onto the cells of a tile, or predict the batch from the tile. The tile is in cache.
//!
//! A tile is stored as \[row, plane, cell, re | im\], so that a visibility adds to `L` neighbouring cells of one row, `D` = 2 `L` numbers, at the
//! same time. The loops use small fixed arrays. They are compiled for any machine, for AVX2 with fused multiply-add, and for AVX-512; each call
//! checks once which one the machine supports. The last two give the same bytes. They use indices instead of chains of iterators, which the
//! compiler does not always inline when it divides a crate into units.

use super::batch::{BATCH, Batch, Frame};
use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::{Real, fused, wide};
use super::sort::{Chunk, Run, Segment, TilePlace};
use super::wplanes::WBasis;
use crate::{ChainError, Result};
use num_complex::Complex;

/// Numbers in a tile: rows, planes, cells, two parts.
pub(crate) fn tile_len<T: Real>(plan: &Plan<T>) -> usize {
    (TILE + plan.table.support) * plan.slab_depth() * 2 * (TILE + plan.table.lanes)
}

/// One direction of the transform: what happens to a tile before and after its runs, and where predictions are stored.
pub(crate) trait Work<T: Real> {
    /// Load the buffer at the start of a tile. For gridding it is 0 everywhere.
    fn begin(&mut self, place: TilePlace, tile: &mut [T]);
    /// Finish a tile, of which gridding has reached the first `planes`.
    fn end(&mut self, place: TilePlace, tile: &mut [T], planes: usize);
    /// True for gridding, false for prediction.
    const GRID: bool;
    /// Store predicted nodes that follow each other in a chunk.
    fn store(&mut self, chunk: usize, first: usize, values: &[Complex<T>]) -> Result<()>;
}

/// Add a line, times the kernel along v, to the lines of one plane.
///
/// # Safety
/// The last of these lines must lie within the tile.
#[inline(always)]
unsafe fn add_lines<T: Real, const D: usize, const FUSED: bool>(cells: *mut T, row_len: usize, line: &[T; D], kernel_v: &[T]) {
    for (y, kv) in kernel_v.iter().enumerate() {
        // SAFETY: the caller promises it.
        let cells = unsafe { &mut *cells.add(y * row_len).cast::<[T; D]>() };
        for j in 0..D {
            cells[j] = line[j].fma::<FUSED>(*kv, cells[j]);
        }
    }
}

/// The sum of the lines of one plane, each times the kernel along v.
///
/// # Safety
/// As for [`add_lines`].
#[inline(always)]
unsafe fn sum_lines<T: Real, const D: usize, const FUSED: bool>(cells: *const T, row_len: usize, kernel_v: &[T]) -> [T; D] {
    let mut sum = [T::default(); D];
    for (y, kv) in kernel_v.iter().enumerate() {
        // SAFETY: the caller promises it.
        let cells = unsafe { &*cells.add(y * row_len).cast::<[T; D]>() };
        for j in 0..D {
            sum[j] = cells[j].fma::<FUSED>(*kv, sum[j]);
        }
    }
    sum
}

/// The first number of the tile that a visibility of a batch reaches in its first plane.
#[inline(always)]
fn first_number<T: Real, const D: usize>((plan, frame): (&Plan<T>, &Frame), (batch, k): (&Batch<T, D>, usize), tile: usize) -> usize {
    let (first, planes) = (batch.at[k] as usize, batch.planes[k] as usize);
    debug_assert!(first + (plan.table.support - 1) * frame.row_len + (planes - 1) * frame.stride + D <= tile);
    first
}

/// Add the visibilities of a batch to the tile. Returns how many of its planes they reach at most.
#[inline(always)]
fn spread<T: Real, const L: usize, const D: usize, const FUSED: bool>(
    plan: &Plan<T>,
    frame: &Frame,
    batch: &mut Batch<T, D>,
    tile: &mut [T],
) -> usize {
    let support = plan.table.support;
    batch.place(plan, frame);
    batch.turn(true);
    for k in 0..batch.n {
        let ku = plan.table.eval::<L, FUSED>(batch.z[0][k]);
        let kv = plan.table.eval::<L, FUSED>(batch.z[1][k]);
        let (re, im, t) = (batch.re[k], batch.im[k], batch.t[k]);
        let mut line = [T::default(); D];
        for j in 0..D {
            line[j] = ku[j / 2] * if j % 2 == 0 { re } else { im };
        }
        let first = first_number((plan, frame), (batch, k), tile.len());
        // SAFETY: `run_task` has checked the length of the tile. A batch puts the first cell below TILE along u and v and the first plane below
        // SLAB, the kernel along v has `support` values, a visibility has no more planes than the basis, and a line has TILE + L cells, so the
        // last cell lies within the tile.
        let cells = tile.as_mut_ptr().wrapping_add(first);
        match &plan.w.basis {
            WBasis::Powers { .. } => {
                for q in 0..batch.planes[k] as usize {
                    // SAFETY: as above.
                    unsafe { add_lines::<T, D, FUSED>(cells.wrapping_add(q * frame.stride), frame.row_len, &line, &kv[..support]) };
                    // Plane q takes t^q.
                    for x in &mut line {
                        *x *= t;
                    }
                }
            }
            WBasis::Planes { table, .. } => {
                let along_w = table.eval::<16, FUSED>(t);
                for (q, c) in along_w.iter().enumerate().take(table.support) {
                    let mut own = line;
                    for x in &mut own {
                        *x *= *c;
                    }
                    // SAFETY: as above.
                    unsafe { add_lines::<T, D, FUSED>(cells.wrapping_add(q * frame.stride), frame.row_len, &own, &kv[..support]) };
                }
            }
        }
    }
    let reached = batch.planes[..batch.n].iter().copied().max().unwrap_or(0) as usize;
    batch.n = 0;
    match &plan.w.basis {
        WBasis::Powers { .. } => reached,
        WBasis::Planes { .. } => plan.slab_depth(),
    }
}

/// Predict the visibilities of a batch from the tile: each is the sum of its line.
#[inline(always)]
fn predict<T: Real, const L: usize, const D: usize, const FUSED: bool>(plan: &Plan<T>, frame: &Frame, batch: &mut Batch<T, D>, tile: &[T]) {
    let support = plan.table.support;
    batch.place(plan, frame);
    for k in 0..batch.n {
        let ku = plan.table.eval::<L, FUSED>(batch.z[0][k]);
        let kv = plan.table.eval::<L, FUSED>(batch.z[1][k]);
        let t = batch.t[k];
        let first = first_number((plan, frame), (batch, k), tile.len());
        let cells = tile.as_ptr().wrapping_add(first);
        let mut sum = [T::default(); D];
        match &plan.w.basis {
            WBasis::Powers { .. } => {
                for q in (0..batch.planes[k] as usize).rev() {
                    // SAFETY: as in `spread`.
                    let own: [T; D] =
                        unsafe { sum_lines::<T, D, FUSED>(cells.wrapping_add(q * frame.stride), frame.row_len, &kv[..support]) };
                    // Plane q takes t^q.
                    for j in 0..D {
                        sum[j] = sum[j].fma::<FUSED>(t, own[j]);
                    }
                }
            }
            WBasis::Planes { table, .. } => {
                let along_w = table.eval::<16, FUSED>(t);
                for (q, c) in along_w.iter().enumerate().take(table.support) {
                    // SAFETY: as in `spread`.
                    let own: [T; D] =
                        unsafe { sum_lines::<T, D, FUSED>(cells.wrapping_add(q * frame.stride), frame.row_len, &kv[..support]) };
                    for j in 0..D {
                        sum[j] = own[j].fma::<FUSED>(*c, sum[j]);
                    }
                }
            }
        }
        for j in 0..D {
            batch.line[k][j] = sum[j] * ku[j / 2];
        }
    }
}

/// Number of runs after which a row or its nodes are needed that are asked for now.
const AHEAD: usize = 3;

/// Ask the processor to load an element into its cache.
#[inline(always)]
pub(super) fn ask_for<V>(values: &[V], at: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(value) = values.get(at) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: only a hint, for an element that exists.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, at);
}

/// Visibilities of a batch that follow each other in the nodes of a chunk.
#[derive(Default, Clone, Copy)]
struct Part {
    chunk: usize,
    first: usize,
    n: usize,
    conjugate: bool,
}

/// The parts of a batch: each has at least one of its visibilities.
struct Parts {
    all: [Part; BATCH],
    n: usize,
}

/// Hand the predicted visibilities of a batch over.
#[inline(always)]
fn store<T: Real, W: Work<T>, const D: usize>(batch: &mut Batch<T, D>, parts: &mut Parts, work: &mut W) -> Result<()> {
    let mut values = [Complex::new(T::default(), T::default()); BATCH];
    batch.sums(&mut values);
    let mut rest = &mut values[..];
    for part in &parts.all[..std::mem::take(&mut parts.n)] {
        let (own, after) = rest.split_at_mut(part.n);
        if part.conjugate {
            own.iter_mut().for_each(|v| *v = v.conj());
        }
        work.store(part.chunk, part.first, own)?;
        rest = after;
    }
    batch.n = 0;
    Ok(())
}

#[inline(always)]
fn segments<T: Real, W: Work<T>, const L: usize, const D: usize, const FUSED: bool>(
    plan: &Plan<T>,
    (chunks, nodes): (&[Chunk], &[&[Complex<T>]]),
    task: &[Segment],
    (tile, work): (&mut [T], &mut W),
) -> Result<()> {
    let (mut batch, mut parts) = (Batch::<T, D>::new(), Parts { all: [Part::default(); BATCH], n: 0 });
    for same in task.chunk_by(|a, b| a.key == b.key) {
        let place = TilePlace::of(plan, same[0].key);
        let frame = Frame::of(plan, place, L);
        work.begin(place, tile);
        let mut reached = 0;
        for segment in same {
            let chunk = &chunks[segment.chunk];
            let runs = &chunk.runs[segment.runs.clone()];
            for (k, Run { row, lo, hi, .. }) in runs.iter().enumerate() {
                let row = &chunk.rows[*row as usize];
                let (lo, hi) = (*lo as usize, *hi as usize);
                // The runs of a tile belong to rows far apart, which the processor cannot foresee.
                if let Some(far) = runs.get(k + 2 * AHEAD) {
                    ask_for(&chunk.rows, far.row as usize);
                }
                if W::GRID
                    && let Some(near) = runs.get(k + AHEAD)
                {
                    ask_for(nodes[segment.chunk], chunk.rows[near.row as usize].node(near.lo as usize));
                }
                let freq = &plan.channels.classes[row.class].freq_hz[lo..hi];
                let mut done = 0;
                while done < freq.len() {
                    if W::GRID {
                        let nodes = &nodes[segment.chunk][row.node(lo)..row.node(hi)];
                        done += batch.take(row, &freq[done..], &nodes[done..]);
                        if batch.n == BATCH {
                            reached = reached.max(spread::<T, L, D, FUSED>(plan, &frame, &mut batch, tile));
                        }
                        continue;
                    }
                    let n = batch.take_places(row, &freq[done..]);
                    parts.all[parts.n] = Part { chunk: segment.chunk, first: row.node(lo) + done, n, conjugate: row.conjugate };
                    parts.n += 1;
                    done += n;
                    if batch.n == BATCH {
                        predict::<T, L, D, FUSED>(plan, &frame, &mut batch, tile);
                        store(&mut batch, &mut parts, work)?;
                    }
                }
            }
        }
        if W::GRID {
            reached = reached.max(spread::<T, L, D, FUSED>(plan, &frame, &mut batch, tile));
        } else {
            predict::<T, L, D, FUSED>(plan, &frame, &mut batch, tile);
            store(&mut batch, &mut parts, work)?;
        }
        work.end(place, tile, reached);
    }
    Ok(())
}

/// Rows and their nodes. Prediction does not read the nodes.
pub(crate) type Input<'a, T> = (&'a [Chunk], &'a [&'a [Complex<T>]]);

/// [`segments`] for one set of instructions.
macro_rules! compiled_for {
    ($name:ident, $features:literal) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = $features)]
        fn $name<T: Real, W: Work<T>, const L: usize, const D: usize>(
            plan: &Plan<T>,
            input: Input<'_, T>,
            task: &[Segment],
            buffers: (&mut [T], &mut W),
        ) -> Result<()> {
            segments::<T, W, L, D, true>(plan, input, task, buffers)
        }
    };
}
compiled_for!(segments_avx2, "avx2,fma");
compiled_for!(segments_avx512, "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma");

fn on_lanes<T: Real, W: Work<T>, const L: usize, const D: usize>(
    plan: &Plan<T>,
    input: Input<'_, T>,
    task: &[Segment],
    buffers: (&mut [T], &mut W),
) -> Result<()> {
    #[cfg(target_arch = "x86_64")]
    if W::GRID && wide() {
        // Prediction stores nothing and gains nothing from wider vectors.
        // SAFETY: `wide` has found that the machine has these instructions.
        return unsafe { segments_avx512::<T, W, L, D>(plan, input, task, buffers) };
    }
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: `fused` has found that the machine has AVX2 and FMA.
        return unsafe { segments_avx2::<T, W, L, D>(plan, input, task, buffers) };
    }
    segments::<T, W, L, D, false>(plan, input, task, buffers)
}

/// Grid or predict all runs of a task, tile by tile. The tile needs [`tile_len`] numbers.
pub(crate) fn run_task<T: Real, W: Work<T>>(
    plan: &Plan<T>,
    input: Input<'_, T>,
    task: &[Segment],
    buffers: (&mut [T], &mut W),
) -> Result<()> {
    if buffers.0.len() != tile_len(plan) {
        return Err(ChainError::Internal(format!("a tile has {} numbers, expected {}", buffers.0.len(), tile_len(plan))));
    }
    match plan.table.lanes {
        4 => on_lanes::<T, W, 4, 8>(plan, input, task, buffers),
        8 => on_lanes::<T, W, 8, 16>(plan, input, task, buffers),
        _ => on_lanes::<T, W, 16, 32>(plan, input, task, buffers),
    }
}
