//! The rows of a block, sorted for one transform and divided into the units that are gridded at the same time.

use super::plan::Plan;
use super::real::Real;
use super::sort::{Chunk, Row, Run, Segment};
use super::units::{Unit, units};
use crate::{ChainError, Result};
use ndarray::ArrayView2;
use rayon::prelude::*;
use std::ops::{Deref, Range};

/// Most chunks of a block.
pub(super) const MOST_CHUNKS: usize = 16;

/// The positions of some rows on the grid of one transform, in no order. This is enough to make their nodes, which other processes sort.
#[derive(Debug)]
pub struct FoldedRows {
    /// Identity of the plan of these positions.
    plan: u64,
    pub(crate) chunks: Vec<Chunk>,
}

/// The positions of the visibilities of some rows on the grid of one transform, in the order of its tiles. It is made once and used in every
/// pass over the same rows.
#[derive(Debug)]
pub struct SortedRows {
    rows: FoldedRows,
    /// The units of each colour, in the order of the colours.
    pub(crate) colours: Vec<Vec<Unit>>,
}

impl FoldedRows {
    pub(super) fn new<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>) -> Result<Self> {
        plan.check_rows(uvw_m, (uvw_m.nrows(), plan.n_chan()))?;
        let chunks = shares(uvw_m.nrows()).into_par_iter().map(|range| Chunk::folded(plan, uvw_m, range)).collect();
        Ok(Self { plan: plan.id, chunks })
    }

    /// Check that the rows were sorted for this plan.
    pub(crate) fn check<T: Real>(&self, plan: &Plan<T>) -> Result<()> {
        if self.plan == plan.id {
            return Ok(());
        }
        Err(ChainError::Incompatible(
            "rows that were sorted for one transform were given to another: sort them with the transform that grids them".into(),
        ))
    }

    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.chunks.iter().map(|c| c.n_nodes).sum()
    }
}

/// Sorted rows serve wherever their order does not matter.
impl Deref for SortedRows {
    type Target = FoldedRows;

    fn deref(&self) -> &FoldedRows {
        &self.rows
    }
}

impl SortedRows {
    pub(crate) fn new<T: Real>(plan: &Plan<T>, uvw_m: ArrayView2<'_, f64>) -> Result<Self> {
        plan.check_rows(uvw_m, (uvw_m.nrows(), plan.n_chan()))?;
        let ranges = shares(uvw_m.nrows());
        let made = ranges.into_par_iter().map(|range| Chunk::new(plan, uvw_m, range)).collect::<Result<Vec<_>>>()?;
        Ok(Self::of_chunks(plan, made))
    }

    /// The rows of these chunks, each with the keys of its runs.
    pub(super) fn of_chunks<T: Real>(plan: &Plan<T>, made: Vec<(Chunk, Vec<u64>)>) -> Self {
        let (chunks, keys): (Vec<Chunk>, Vec<Vec<u64>>) = made.into_iter().unzip();
        let each = chunks.par_iter().zip(&keys).enumerate();
        let lists: Vec<Vec<Segment>> = each.map(|(i, (c, k))| c.segments(i, k)).collect();
        drop(keys);
        let mut segments = lists.concat();
        drop(lists);
        segments.par_sort_unstable_by_key(|s| (s.key, s.chunk));
        let colours = units(plan, segments, &chunks);
        Self { rows: FoldedRows { plan: plan.id, chunks }, colours }
    }

    /// For each chunk, which of its rows have a run in these rows of tiles.
    pub(crate) fn reaching(&self, band: &Range<usize>) -> Vec<Vec<bool>> {
        let mut reach: Vec<Vec<bool>> = self.chunks.iter().map(|c| vec![false; c.rows.len()]).collect();
        let inside = self.colours.iter().flatten().filter(|u| band.contains(&u.v));
        for segment in inside.flat_map(|u| &u.pieces).flatten() {
            let runs = &self.chunks[segment.chunk].runs[segment.runs.clone()];
            runs.iter().for_each(|run| reach[segment.chunk][run.row as usize] = true);
        }
        reach
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let chunk = |c: &Chunk| c.rows.len() * size_of::<Row>() + c.runs.len() * size_of::<Run>();
        let unit = |u: &Unit| size_of::<Unit>() + u.pieces.iter().map(|p| p.len() * size_of::<Segment>()).sum::<usize>();
        self.chunks.iter().map(chunk).sum::<usize>() + self.colours.iter().flatten().map(unit).sum::<usize>()
    }
}

/// Divide the rows of a block into ranges. Their number does not depend on that of the threads, because sums are made in their order.
fn shares(n_rows: usize) -> Vec<Range<usize>> {
    let parts = n_rows.div_ceil(256).clamp(1, MOST_CHUNKS);
    (0..parts).map(|k| n_rows * k / parts..n_rows * (k + 1) / parts).filter(|r| !r.is_empty()).collect()
}
