//! The innermost loops: they spread one run of visibilities onto the cells of a tile, or predict the run from the tile. The tile is in cache.
//!
//! A tile is stored as \[row, plane, re | im, cell\], so that a visibility adds to `L` neighbouring cells of one row at the same time. The
//! loops use small fixed arrays. They are compiled twice: for any machine, and for AVX2 with fused multiply-add; each call checks once
//! which one the machine supports. They use indices instead of chains of iterators, which the compiler does not always inline when it divides
//! a crate into units.

use super::kernel::KernelTable;
use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::{Real, cis_turns, fused};
use super::sort::{Chunk, Row, Run, Segment, TilePlace, tile_of};
use super::wplanes::{MOST_TERMS, SLAB, WBasis};
use crate::{ChainError, Result};
use num_complex::Complex;

/// Numbers in a tile: rows, planes, two parts, cells.
pub(crate) fn tile_len<T: Real>(plan: &Plan<T>) -> usize {
    (TILE + plan.table.support) * plan.slab_depth() * 2 * (TILE + plan.table.lanes)
}

/// One direction of the transform: what happens to a tile before and after its runs, and where predictions are stored.
pub(crate) trait Work<T: Real> {
    /// Clear or load the buffer at the start of a tile.
    fn begin(&mut self, place: TilePlace, tile: &mut [T]);
    /// Finish a tile.
    fn end(&mut self, place: TilePlace, tile: &mut [T]);
    /// True for gridding, false for prediction.
    const GRID: bool;
    /// Store the predicted nodes of a run.
    fn store(&mut self, chunk: usize, first: usize, values: &[Complex<T>]) -> Result<()>;
}

/// The position of a visibility along one axis: its first cell in the tile, and its distance above the lower end of the kernel.
///
/// The runs were cut so that every visibility lies in its tile to within rounding (`cut` in `sort.rs` checks this). The clamp handles that
/// rounding, and it makes the index safe.
#[inline(always)]
fn place<T: Real>(x: f64, origin: f64, side: usize) -> (usize, T) {
    let a = x - origin;
    // At an exact cell this takes the next cell, where z is 1 instead of 0. The kernel is equally accurate there.
    let i = ((a + 1.0) as i32).clamp(0, side as i32 - 1);
    (i as usize, T::of(f64::from(i) - a))
}

/// Coefficients along w of one visibility. Returns the first plane in the tile, the number of planes, and the phase at the middle of the range
/// of n - 1.
#[inline(always)]
fn along_w<T: Real, const FUSED: bool>(plan: &Plan<T>, slab: usize, w: f64, c: &mut [T; MOST_TERMS + 4]) -> (usize, usize, Complex<T>) {
    match &plan.w.basis {
        WBasis::Powers { inverse_w, enough, .. } => {
            if *inverse_w == 0.0 {
                c[0] = T::one();
                return (0, 1, Complex::new(T::one(), T::default()));
            }
            let t = w * inverse_w;
            let size = t.abs();
            let n = 1 + enough.iter().map(|e| usize::from(size > *e)).sum::<usize>();
            let t = T::of(t);
            let mut power = T::one();
            for c in &mut c[..n] {
                *c = power;
                power *= t;
            }
            (0, n, cis_turns(w * plan.w.nu_mid))
        }
        WBasis::Planes { first, step, table, .. } => {
            let x = (w - first) / step - (slab * SLAB) as f64;
            let (start, z) = place::<T>(x, table.support as f64 / 2.0, SLAB);
            c[..16].copy_from_slice(&eval::<T, 16, FUSED>(table, z));
            (start, table.support, cis_turns(w * plan.w.nu_mid))
        }
    }
}

#[inline(always)]
fn eval<T: Real, const L: usize, const FUSED: bool>(table: &KernelTable<T>, z: T) -> [T; L] {
    table.eval::<L, FUSED>(z)
}

/// The origins of the tile of a run along u and v, in cells.
#[inline(always)]
fn origins<T: Real>(plan: &Plan<T>, row: &Row, f: f64) -> (f64, f64) {
    let half = plan.table.support as f64 / 2.0;
    let (_, u) = tile_of(row.uvw[0] * f, half, 0.0, plan.nu as f64);
    let (_, v) = tile_of(row.uvw[1] * f, half, plan.below() as f64, plan.nv as f64);
    (u, v)
}

#[inline(always)]
fn grid_run<T: Real, const L: usize, const FUSED: bool>(
    plan: &Plan<T>,
    (row, slab): (&Row, usize),
    (freq, nodes): (&[f64], &[Complex<T>]),
    tile: &mut [T],
) {
    let stride = TILE + L;
    let row_len = plan.slab_depth() * 2 * stride;
    let support = plan.table.support;
    let (origin_u, origin_v) = origins(plan, row, freq[0]);
    let mut c = [T::default(); MOST_TERMS + 4];
    for (f, v) in freq.iter().zip(nodes) {
        if v.re == T::default() && v.im == T::default() {
            continue;
        }
        let (i, zu) = place::<T>(row.uvw[0] * f, origin_u, TILE);
        let (j, zv) = place::<T>(row.uvw[1] * f, origin_v, TILE);
        let ku = eval::<T, L, FUSED>(&plan.table, zu);
        let kv = eval::<T, L, FUSED>(&plan.table, zv);
        let (p, n, phase) = along_w::<T, FUSED>(plan, slab, row.uvw[2] * f, &mut c);
        let v = if row.conjugate { v.conj() } else { *v } * phase.conj();
        debug_assert!((j + support - 1) * row_len + (p + n) * 2 * stride <= tile.len() && i + L <= stride);
        for (q, c) in c.iter().enumerate().take(n) {
            // The row of the kernel that all lines of this plane share. The loop over the lines then only loads, adds and stores.
            let (a, b) = (v.re * *c, v.im * *c);
            let (mut row_re, mut row_im) = ([T::default(); L], [T::default(); L]);
            for k in 0..L {
                row_re[k] = ku[k] * a;
                row_im[k] = ku[k] * b;
            }
            for (y, kv) in kv.iter().enumerate().take(support) {
                let at = (j + y) * row_len + (p + q) * 2 * stride + i;
                // SAFETY: `run_task` has checked the length of the tile. j and i are below TILE, y is below the support, p + q is below the
                // depth of a slab and a line has TILE + L cells, so the last cell lies within the tile.
                let (cells_re, cells_im) = unsafe {
                    let cells = tile.as_mut_ptr().add(at);
                    (&mut *cells.cast::<[T; L]>(), &mut *cells.add(stride).cast::<[T; L]>())
                };
                for k in 0..L {
                    cells_re[k] = row_re[k].fma::<FUSED>(*kv, cells_re[k]);
                    cells_im[k] = row_im[k].fma::<FUSED>(*kv, cells_im[k]);
                }
            }
        }
    }
}

#[inline(always)]
fn degrid_run<T: Real, const L: usize, const FUSED: bool>(
    plan: &Plan<T>,
    (row, slab): (&Row, usize),
    (freq, out): (&[f64], &mut Vec<Complex<T>>),
    tile: &[T],
) {
    let stride = TILE + L;
    let row_len = plan.slab_depth() * 2 * stride;
    let support = plan.table.support;
    let (origin_u, origin_v) = origins(plan, row, freq[0]);
    let mut c = [T::default(); MOST_TERMS + 4];
    out.clear();
    for f in freq {
        let (i, zu) = place::<T>(row.uvw[0] * f, origin_u, TILE);
        let (j, zv) = place::<T>(row.uvw[1] * f, origin_v, TILE);
        let ku = eval::<T, L, FUSED>(&plan.table, zu);
        let kv = eval::<T, L, FUSED>(&plan.table, zv);
        let (p, n, phase) = along_w::<T, FUSED>(plan, slab, row.uvw[2] * f, &mut c);
        let (mut re, mut im) = ([T::default(); L], [T::default(); L]);
        debug_assert!((j + support - 1) * row_len + (p + n) * 2 * stride <= tile.len() && i + L <= stride);
        for (q, c) in c.iter().enumerate().take(n) {
            // The sums of the planes are independent of each other, so the multiply-adds of several planes overlap.
            let (mut a, mut b) = ([T::default(); L], [T::default(); L]);
            for (y, kv) in kv.iter().enumerate().take(support) {
                let at = (j + y) * row_len + (p + q) * 2 * stride + i;
                // SAFETY: as in `grid_run`.
                let (cells_re, cells_im) = unsafe {
                    let cells = tile.as_ptr().add(at);
                    (&*cells.cast::<[T; L]>(), &*cells.add(stride).cast::<[T; L]>())
                };
                for k in 0..L {
                    a[k] = cells_re[k].fma::<FUSED>(*kv, a[k]);
                    b[k] = cells_im[k].fma::<FUSED>(*kv, b[k]);
                }
            }
            for k in 0..L {
                re[k] = a[k].fma::<FUSED>(*c, re[k]);
                im[k] = b[k].fma::<FUSED>(*c, im[k]);
            }
        }
        let mut v = Complex::new(T::default(), T::default());
        for k in 0..L {
            v.re += re[k] * ku[k];
            v.im += im[k] * ku[k];
        }
        v *= phase;
        out.push(if row.conjugate { v.conj() } else { v });
    }
}

/// Number of runs after which a row or its nodes are needed that are asked for now.
const AHEAD: usize = 3;

/// Ask the processor to load an element into its cache.
#[inline(always)]
fn ask_for<V>(values: &[V], at: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(value) = values.get(at) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: only a hint, for an element that exists.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, at);
}

#[inline(always)]
fn segments<T: Real, W: Work<T>, const L: usize, const FUSED: bool>(
    plan: &Plan<T>,
    (chunks, nodes): (&[Chunk], &[Vec<Complex<T>>]),
    task: &[Segment],
    (tile, work): (&mut [T], &mut W),
) -> Result<()> {
    let mut out = Vec::new();
    for same in task.chunk_by(|a, b| a.key == b.key) {
        let at = TilePlace::of(plan, same[0].key);
        work.begin(at, tile);
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
                    ask_for(&nodes[segment.chunk], chunk.rows[near.row as usize].offset + near.lo as usize);
                }
                let freq = &plan.channels.classes[row.class].freq_hz[lo..hi];
                if W::GRID {
                    let nodes = &nodes[segment.chunk][row.offset + lo..row.offset + hi];
                    grid_run::<T, L, FUSED>(plan, (row, at.slab), (freq, nodes), tile);
                } else {
                    degrid_run::<T, L, FUSED>(plan, (row, at.slab), (freq, &mut out), tile);
                    work.store(segment.chunk, row.offset + lo, &out)?;
                }
            }
        }
        work.end(at, tile);
    }
    Ok(())
}

/// Rows and their nodes. Prediction does not read the nodes.
pub(crate) type Input<'a, T> = (&'a [Chunk], &'a [Vec<Complex<T>>]);

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn segments_avx2<T: Real, W: Work<T>, const L: usize>(
    plan: &Plan<T>,
    input: Input<'_, T>,
    task: &[Segment],
    buffers: (&mut [T], &mut W),
) -> Result<()> {
    segments::<T, W, L, true>(plan, input, task, buffers)
}

fn on_lanes<T: Real, W: Work<T>, const L: usize>(
    plan: &Plan<T>,
    input: Input<'_, T>,
    task: &[Segment],
    buffers: (&mut [T], &mut W),
) -> Result<()> {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: `fused` has found that the machine has AVX2 and FMA.
        return unsafe { segments_avx2::<T, W, L>(plan, input, task, buffers) };
    }
    segments::<T, W, L, false>(plan, input, task, buffers)
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
        4 => on_lanes::<T, W, 4>(plan, input, task, buffers),
        8 => on_lanes::<T, W, 8>(plan, input, task, buffers),
        _ => on_lanes::<T, W, 16>(plan, input, task, buffers),
    }
}
