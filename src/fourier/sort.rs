//! Cuts the rows of a block into runs of channels that fall into one tile of the grid, and sorts the runs by tile.

use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::{Real, fused};
use super::wplanes::{SLAB, WBasis};
use crate::{ChainError, Result};
use ndarray::ArrayView2;
use std::ops::Range;

/// A row that is folded to v >= 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// Cells along u and v and wavelengths along w, per Hz.
    pub(crate) uvw: [f64; 3],
    /// Index of the class of its channels.
    pub(crate) class: usize,
    /// Index of its first node in the chunk, see [`Row::node`].
    pub(crate) offset: usize,
    /// True if the grid holds the conjugate of the visibility.
    pub(crate) conjugate: bool,
}

impl Row {
    /// A row with this uvw in m.
    #[inline(always)]
    fn of<T: Real>(plan: &Plan<T>, uvw: [f64; 3], offset: usize) -> Self {
        let conjugate = uvw[1] < 0.0;
        let sign = if conjugate { -1.0 } else { 1.0 };
        let class = plan.channels.class_for(plan.turns_per_hz(uvw));
        Self { uvw: [0, 1, 2].map(|k| sign * uvw[k] * plan.scale[k]), class, offset, conjugate }
    }

    /// The index in the chunk of node `k`. Where a chunk has only the last nodes of its first row, the offset has wrapped below 0.
    #[inline(always)]
    pub(crate) fn node(&self, k: usize) -> usize {
        self.offset.wrapping_add(k)
    }
}

/// Nodes `lo..hi` of a row. All of them lie in one tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) row: u32,
    pub(crate) lo: u32,
    pub(crate) hi: u32,
}

/// Some of the rows of a block.
#[derive(Debug)]
pub(crate) struct Chunk {
    pub(crate) range: Range<usize>,
    pub(crate) rows: Vec<Row>,
    /// Number of nodes of all rows.
    pub(crate) n_nodes: usize,
    /// Runs in the order of their tiles.
    pub(crate) runs: Vec<Run>,
}

/// The runs of one chunk in one tile.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    pub(crate) key: u64,
    pub(crate) chunk: usize,
    pub(crate) runs: Range<usize>,
    /// Number of nodes.
    pub(crate) weight: usize,
}

/// Indices of a tile along u and v, and of its slab of w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TilePlace {
    pub(crate) u: usize,
    pub(crate) v: usize,
    pub(crate) slab: usize,
}

impl TilePlace {
    pub(crate) fn of<T: Real>(plan: &Plan<T>, key: u64) -> Self {
        let (nu, nv) = (plan.tiles_u() as u64, plan.tiles_v() as u64);
        Self { u: (key % nu) as usize, v: ((key / nu) % nv) as usize, slab: (key / nu / nv) as usize }
    }
}

/// Index of the tile of the position `x` (in cells) along one axis, and the origin of that tile: the position whose kernel starts at the first
/// cell of the tile.
#[inline(always)]
pub(crate) fn tile_of(x: f64, half_support: f64, below: f64, period: f64) -> (usize, f64) {
    let start = (x - half_support).ceil() + below;
    let wrapped = if start >= 0.0 && start < period { start } else { start - period * (start / period).floor() };
    let tile = (wrapped * (1.0 / TILE as f64)).floor();
    (tile as usize, start - below - (wrapped - tile * TILE as f64) + half_support)
}

/// The part of a range of frequencies in which the frequency over `hz` lies between two positions. A row that stays at 0 has an infinite `hz`.
#[inline(always)]
fn within(range: (f64, f64), hz: f64, (low, high): (f64, f64)) -> (f64, f64) {
    if hz.is_infinite() {
        return range;
    }
    let (a, b) = (low * hz, high * hz);
    (range.0.max(a.min(b)), range.1.min(a.max(b)))
}

/// A run before it is sorted.
#[derive(Debug, Clone, Copy, Default)]
struct Keyed {
    key: u64,
    row: u32,
    lo: u32,
    hi: u32,
}

impl Chunk {
    /// Fold, classify, cut and sort the rows of `range`. Also returns the key of the tile of each run.
    pub(crate) fn new<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>, range: Range<usize>) -> Result<(Self, Vec<u64>)> {
        let (rows, runs, n_nodes) = cut_rows(plan, uvw_m, range.clone())?;
        Ok(Self::sorted(range, rows, runs, n_nodes))
    }

    /// Cut and sort some nodes of rows: their places and nodes, in the order of the rows.
    pub(super) fn of_spans<T: Real>(plan: &Plan<T>, rows: Vec<Row>, n_nodes: usize, spans: &[Span]) -> Result<(Self, Vec<u64>)> {
        let runs = cut_spans(plan, &rows, spans)?;
        Ok(Self::sorted(0..rows.len(), rows, runs, n_nodes))
    }

    fn sorted(range: Range<usize>, rows: Vec<Row>, mut runs: Vec<Keyed>, n_nodes: usize) -> (Self, Vec<u64>) {
        sort_by_key(&mut runs);
        let keys = runs.iter().map(|r| r.key).collect();
        let runs = runs.iter().map(|r| Run { row: r.row, lo: r.lo, hi: r.hi }).collect();
        (Self { range, rows, n_nodes, runs }, keys)
    }

    /// Fold and classify the rows of `range`. They have no runs: other processes cut and sort them.
    pub(super) fn folded<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>, range: Range<usize>) -> Self {
        let mut n_nodes = 0;
        let fold = |r: usize| {
            let row = Row::of(plan, [uvw_m[(r, 0)], uvw_m[(r, 1)], uvw_m[(r, 2)]], n_nodes);
            n_nodes += plan.channels.classes[row.class].n_nodes();
            row
        };
        let rows = range.clone().map(fold).collect();
        Self { range, rows, n_nodes, runs: Vec::new() }
    }

    pub(crate) fn segments(&self, chunk: usize, keys: &[u64]) -> Vec<Segment> {
        let mut out = Vec::with_capacity(keys.chunk_by(|a, b| a == b).count());
        let mut first = 0;
        for same in keys.chunk_by(|a, b| a == b) {
            let runs = first..first + same.len();
            let weight = self.runs[runs.clone()].iter().map(|r| (r.hi - r.lo) as usize).sum();
            first = runs.end;
            out.push(Segment { key: same[0], chunk, runs, weight });
        }
        out
    }
}

/// Rows, their runs in the order of the rows, and the number of their nodes.
type CutRows = (Vec<Row>, Vec<Keyed>, usize);

#[inline(always)]
fn cut_each<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>, range: Range<usize>) -> Result<CutRows> {
    let mut rows = Vec::with_capacity(range.len());
    let (mut runs, mut n_nodes) = (Vec::with_capacity(4 * range.len()), 0);
    for r in range {
        let row = Row::of(plan, [uvw_m[(r, 0)], uvw_m[(r, 1)], uvw_m[(r, 2)]], n_nodes);
        let own = plan.channels.classes[row.class].n_nodes();
        n_nodes += own;
        cut(plan, &row, (rows.len() as u32, 0..own), &mut runs)?;
        rows.push(row);
    }
    Ok((rows, runs, n_nodes))
}

// The machine rounds numbers by an instruction. Without it each rounding is a call.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn cut_avx2<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>, range: Range<usize>) -> Result<CutRows> {
    cut_each(plan, uvw_m, range)
}

/// Fold, classify and cut the rows of `range`.
fn cut_rows<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>, range: Range<usize>) -> Result<CutRows> {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        return unsafe { cut_avx2(plan, uvw_m, range) };
    }
    cut_each(plan, uvw_m, range)
}

/// Some nodes of a row: its place among the rows, the first node and the one after the last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub(super) row: u32,
    pub(super) lo: u32,
    pub(super) hi: u32,
}

impl Span {
    pub(super) fn n_nodes(&self) -> usize {
        (self.hi - self.lo) as usize
    }
}

#[inline(always)]
fn cut_each_span<T: Real>(plan: &Plan<T>, rows: &[Row], spans: &[Span]) -> Result<Vec<Keyed>> {
    let mut runs = Vec::with_capacity(2 * spans.len());
    for Span { row, lo, hi } in spans {
        cut(plan, &rows[*row as usize], (*row, *lo as usize..*hi as usize), &mut runs)?;
    }
    Ok(runs)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn cut_spans_avx2<T: Real>(plan: &Plan<T>, rows: &[Row], spans: &[Span]) -> Result<Vec<Keyed>> {
    cut_each_span(plan, rows, spans)
}

/// Cut some nodes of rows into runs.
fn cut_spans<T: Real>(plan: &Plan<T>, rows: &[Row], spans: &[Span]) -> Result<Vec<Keyed>> {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        return unsafe { cut_spans_avx2(plan, rows, spans) };
    }
    cut_each_span(plan, rows, spans)
}

/// Rounding of a position in cells that is accepted at the edges of a tile.
const ROUNDING_CELLS: f64 = 1e-3;

/// Cut some nodes of a row into runs.
#[inline(always)]
fn cut<T: Real>(plan: &Plan<T>, row: &Row, (index, nodes): (u32, Range<usize>), runs: &mut Vec<Keyed>) -> Result<()> {
    let freq = &plan.channels.classes[row.class].freq_hz[..nodes.end];
    let half = plan.table.support as f64 / 2.0;
    let (nu, nv) = (plan.nu as f64, plan.nv as f64);
    let at = |f: f64, k: usize| row.uvw[k] * f;
    let hz = row.uvw.map(f64::recip);
    let mut lo = nodes.start;
    while lo < freq.len() {
        let f = freq[lo];
        let (u, origin_u) = tile_of(at(f, 0), half, plan.columns.left as f64, nu);
        let (v, origin_v) = tile_of(at(f, 1), half, plan.below() as f64, nv);
        let (slab, origin_w, step) = match &plan.w.basis {
            WBasis::Powers { .. } => (0, 0.0, f64::INFINITY),
            WBasis::Planes { first, step, table, .. } => {
                let start = ((at(f, 2) - first) / step - table.support as f64 / 2.0).ceil().max(0.0) as usize;
                let slab = start / SLAB;
                (slab, first + ((slab * SLAB) as f64 + table.support as f64 / 2.0) * step, *step)
            }
        };
        let offsets = [at(f, 0) - origin_u, at(f, 1) - origin_v, (at(f, 2) - origin_w) / step];
        let outside = |(a, side): (&f64, usize)| !(*a >= -1.0 - ROUNDING_CELLS && *a <= (side - 1) as f64 + ROUNDING_CELLS);
        if offsets.iter().zip([TILE, TILE, SLAB]).any(outside) {
            let message = format!("a visibility at {:?} cells lies outside its tile by {offsets:?}", row.uvw.map(|x| x * f));
            return Err(ChainError::Internal(message));
        }
        // The frequencies at which the row lies in the tile: one comparison for each node instead of three positions.
        let mut inside = (f64::NEG_INFINITY, f64::INFINITY);
        for (k, (origin, (unit, side))) in
            [origin_u, origin_v, origin_w].into_iter().zip([(1.0, TILE), (1.0, TILE), (step, SLAB)]).enumerate()
        {
            inside = within(inside, hz[k], (origin - unit, origin + (side - 1) as f64 * unit));
        }
        let hi = lo + 1 + freq[lo + 1..].iter().take_while(|f| **f >= inside.0 && **f <= inside.1).count();
        let key = ((slab * plan.tiles_v() + v) * plan.tiles_u() + u) as u64;
        runs.push(Keyed { key, row: index, lo: lo as u32, hi: hi as u32 });
        lo = hi;
    }
    Ok(())
}

/// Sort by counting if the keys are few enough, otherwise by comparison.
fn sort_by_key(runs: &mut Vec<Keyed>) {
    let lo = runs.iter().map(|r| r.key).min().unwrap_or(0);
    let hi = runs.iter().map(|r| r.key).max().unwrap_or(0);
    let n = (hi - lo) as usize + 1;
    if n > 4 * runs.len() + 1024 {
        runs.sort_unstable_by_key(|r| (r.key, r.row, r.lo));
        return;
    }
    let mut next = vec![0_usize; n + 1];
    for r in runs.iter() {
        next[(r.key - lo) as usize + 1] += 1;
    }
    for k in 1..=n {
        next[k] += next[k - 1];
    }
    let mut sorted = vec![Keyed::default(); runs.len()];
    for r in runs.iter() {
        let at = &mut next[(r.key - lo) as usize];
        sorted[*at] = *r;
        *at += 1;
    }
    *runs = sorted;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_wrap_around_the_grid_on_both_sides() {
        // A support of 6 on a period of 100: the kernel at 0.5 starts at cell -2, which is cell 98 in tile 6.
        let (tile, origin) = tile_of(0.5, 3.0, 0.0, 100.0);
        assert_eq!((tile, origin), (6, -4.0 + 3.0));
        assert_eq!(tile_of(100.5, 3.0, 0.0, 100.0), (6, 96.0 + 3.0));
        assert_eq!(tile_of(50.0, 3.0, 0.0, 100.0), (2, 32.0 + 3.0));
        assert_eq!(origin, -1.0);
    }

    #[test]
    fn the_frequencies_between_two_positions_follow_the_sign_of_the_row() {
        let all = (f64::NEG_INFINITY, f64::INFINITY);
        assert_eq!(within(all, 0.5, (4.0, 10.0)), (2.0, 5.0));
        assert_eq!(within((2.5, 9.0), -0.5, (-10.0, -4.0)), (2.5, 5.0));
        assert_eq!(within((2.5, 9.0), f64::INFINITY, (4.0, 10.0)), (2.5, 9.0));
    }

    #[test]
    fn runs_come_out_in_the_order_of_their_tiles() {
        let run = |key, row| Keyed { key, row, lo: 0, hi: 1 };
        for spread in [1, 1_000_000] {
            let mut runs: Vec<Keyed> = (0..200).map(|i| run((i * 7919) % 31 * spread, i as u32)).collect();
            sort_by_key(&mut runs);
            assert!(runs.windows(2).all(|p| (p[0].key, p[0].row) < (p[1].key, p[1].row)));
        }
    }
}
