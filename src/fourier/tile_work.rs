//! How long gridding takes in each row of tiles, so that several processes can share it evenly.
//!
//! Most of the time goes into nodes. Far from v = 0 a tile has few of them, and what is left counts: to find the runs of a row in the tile, and to add the finished
//! tile to the planes, once in every block that reaches it.

use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::Real;
use super::sort::{TilePlace, tile_of};
use super::sorted_rows::{FoldedRows, SortedRows};
use crate::Result;
use cittert_arrays::Ranks;
use ndarray::ArrayView2;

/// The time for a run, and for a cell of a tile that is added to the planes, in the unit of [`Plan::node_cost`] (about 1 ns). Measured with three sets and images, kernels of
/// 8 and 11 cells and 4 to 10 planes: 65 to 114 for a run, 1.9 to 4.8 for a cell. Since cells are asked for ahead, a cell takes about a quarter less.
const RUN: f64 = 75.0;
const CELL: f64 = 3.0;

/// Rows of which the work is estimated.
#[derive(Debug, Clone, Copy)]
pub struct SampleOfRows<'a> {
    /// Some rows of all parts of a set, m \[row, 3\], and how many each of them stands for.
    pub spread: (ArrayView2<'a, f64>, f64),
    /// The rows of one block, m \[row, 3\], and how many blocks there are.
    pub block: (ArrayView2<'a, f64>, usize),
}

/// About how long nodes of some rows take in each row of tiles, times `each`.
pub(super) fn add_nodes<T: Real>(plan: &Plan<T>, rows: &FoldedRows, each: f64, sums: &mut [f64]) {
    let (half, below, period) = (plan.table.support as f64 / 2.0, plan.below() as f64, plan.nv as f64);
    let costs: Vec<f64> = (0..=plan.planes().max(plan.slab_depth())).map(|planes| each * plan.node_cost(planes)).collect();
    for row in rows.chunks.iter().flat_map(|chunk| &chunk.rows) {
        for f in &plan.channels.classes[row.class].freq_hz {
            if let Some(sum) = sums.get_mut(tile_of(row.uvw[1] * f, half, below, period).0) {
                *sum += costs[plan.planes_of(row.uvw[2] * f)];
            }
        }
    }
}

/// About how long all processes together take in each row of tiles. All of them call it together, and get the same numbers.
///
/// # Errors
/// A uvw that is not finite or lies outside the extent of the plan.
pub(super) fn of_all<T: Real>(plan: &Plan<T>, sample: SampleOfRows<'_>, ranks: &dyn Ranks) -> Result<Vec<f64>> {
    let ((spread, each), (block, blocks)) = (sample.spread, sample.block);
    let mut work = vec![0.0; plan.tiles_v()];
    add_nodes(plan, &FoldedRows::new(plan, spread)?, each, &mut work);
    let mut visits = vec![0.0; plan.tiles_v() * plan.tiles_u()];
    for piece in SortedRows::new(plan, block)?.colours.iter().flatten().flat_map(|unit| &unit.pieces) {
        for same in piece.chunk_by(|a, b| a.key == b.key) {
            let place = TilePlace::of(plan, same[0].key);
            work[place.v] += RUN * (blocks * same.iter().map(|segment| segment.runs.len()).sum::<usize>()) as f64;
            visits[place.v * plan.tiles_u() + place.u] += 1.0;
        }
    }
    ranks.sum(&mut work);
    // Blocks of several processes are gridded together, and most tiles that one of them reaches are reached by others.
    ranks.largest(&mut visits);
    let mut rounds = [blocks as f64];
    ranks.largest(&mut rounds);
    let side = (TILE + plan.table.support) as f64;
    let visit = CELL * rounds[0] * side * side * plan.slab_depth() as f64;
    for (sum, visits) in work.iter_mut().zip(visits.chunks_exact(plan.tiles_u())) {
        *sum += visit * visits.iter().sum::<f64>();
    }
    Ok(work)
}
