//! The order in which tiles are added to the planes. It is fixed, so that any number of threads gives the same sums.
//!
//! A unit is a run of neighbouring tiles in one row of tiles. A finished tile reaches into the next tile of its row, into the next row, and
//! over the edge of the grid to its other side. Units that do not reach each other have the same colour. What a cell receives is added in the order
//! of the colours. A crowded tile is a unit of its own: its pieces are summed at the same time, each in a tile of its own, and added in order.

use super::plan::Plan;
use super::real::Real;
use super::sort::{Chunk, Segment, TilePlace};
use super::wplanes::SLAB;
use std::cmp::Reverse;

/// Number of units that the visibilities of a block are divided into, if they lie close together. It depends on nothing but the plan.
const UNITS: usize = 256;
/// The same where each slab of w has its own colours.
const UNITS_OF_SLABS: usize = 1024;
/// Fewest visibilities of a unit that is not the last of its row.
const LEAST: usize = 2048;

/// Tiles that one thread adds to the planes, one after the other.
#[derive(Debug)]
pub(crate) struct Unit {
    /// The segments in the order of their tiles. More than one list: the pieces of one crowded tile.
    pub(crate) pieces: Vec<Vec<Segment>>,
    pub(crate) slab: usize,
    /// The row of tiles.
    pub(crate) v: usize,
}

/// The segments, in the order of their tiles, as units of each colour.
pub(crate) fn units<T: Real>(plan: &Plan<T>, segments: Vec<Segment>, chunks: &[Chunk]) -> Vec<Vec<Unit>> {
    let total: usize = segments.iter().map(|s| s.weight).sum();
    let share = (total / if plan.slabs() == 1 { UNITS } else { UNITS_OF_SLABS }).max(LEAST);
    let depth = plan.slab_depth().div_ceil(SLAB).min(plan.slabs());
    let mut colours: Vec<Vec<Unit>> = (0..COLOURS * COLOURS * depth).map(|_| Vec::new()).collect();
    for row in rows_of_tiles(plan, segments) {
        let TilePlace { v, slab, .. } = TilePlace::of(plan, row[0][0].key);
        let first = COLOURS * (depth * colour(v, v, plan.tiles_v()) + slab % depth);
        for (k, (u, pieces)) in units_of_row(plan, row, share, chunks).into_iter().enumerate() {
            colours[first + colour(u, k, plan.tiles_u())].push(Unit { pieces, slab, v });
        }
    }
    colours.retain(|c| !c.is_empty());
    // The light ones come last, so that threads end at about the same time.
    colours.iter_mut().for_each(|c| c.sort_by_key(|u| Reverse(u.weight())));
    colours
}

impl Unit {
    /// Number of nodes.
    fn weight(&self) -> usize {
        self.pieces.iter().flatten().map(|s| s.weight).sum()
    }
}

/// Colours along one axis.
const COLOURS: usize = 4;

/// The colour along one axis of what starts at tile `at`, as the `k`-th in line. The last two tiles reach over the edge of the grid, and each
/// has a colour of its own.
fn colour(at: usize, k: usize, tiles: usize) -> usize {
    if at + 2 >= tiles { 2 + (tiles - 1 - at) } else { k % 2 }
}

/// The segments of each tile, in rows of tiles.
fn rows_of_tiles<T: Real>(plan: &Plan<T>, segments: Vec<Segment>) -> Vec<Vec<Vec<Segment>>> {
    let mut rows: Vec<Vec<Vec<Segment>>> = Vec::new();
    let tiles_u = plan.tiles_u() as u64;
    for segment in segments {
        match rows.last_mut().filter(|r| r[0][0].key / tiles_u == segment.key / tiles_u) {
            Some(row) => match row.last_mut().filter(|t| t[0].key == segment.key) {
                Some(tile) => tile.push(segment),
                None => row.push(vec![segment]),
            },
            None => rows.push(vec![vec![segment]]),
        }
    }
    rows
}

/// The units of a row of tiles: the first tile and the pieces of each.
fn units_of_row<T: Real>(plan: &Plan<T>, row: Vec<Vec<Segment>>, share: usize, chunks: &[Chunk]) -> Vec<(usize, Vec<Vec<Segment>>)> {
    let mut units: Vec<(usize, Vec<Vec<Segment>>)> = Vec::new();
    // Weight of the last unit while it may grow.
    let mut open = None;
    for tile in row {
        let u = TilePlace::of(plan, tile[0].key).u;
        let weight: usize = tile.iter().map(|s| s.weight).sum();
        let alone = weight > 2 * share || u + 2 >= plan.tiles_u();
        match (open, units.last_mut()) {
            (Some(w), Some((_, pieces))) if !alone && w < share => {
                pieces[0].extend(tile);
                open = Some(w + weight);
            }
            _ => {
                units.push((u, if alone { cut(tile, share, chunks) } else { vec![tile] }));
                open = (!alone).then_some(weight);
            }
        }
    }
    units
}

/// Divide the segments of a crowded tile into lists of about `share` visibilities.
fn cut(tile: Vec<Segment>, share: usize, chunks: &[Chunk]) -> Vec<Vec<Segment>> {
    let (mut lists, mut list, mut weight) = (Vec::new(), Vec::new(), 0);
    for segment in tile.into_iter().flat_map(|s| split(s, share, chunks)) {
        weight += segment.weight;
        list.push(segment);
        if weight >= share {
            lists.push(std::mem::take(&mut list));
            weight = 0;
        }
    }
    if !list.is_empty() {
        lists.push(list);
    }
    lists
}

/// Divide a segment that is heavier than `share`.
fn split(segment: Segment, share: usize, chunks: &[Chunk]) -> Vec<Segment> {
    if segment.weight <= 2 * share {
        return vec![segment];
    }
    let parts = segment.weight.div_ceil(share).min(segment.runs.len());
    let n = segment.runs.len();
    let piece = |k: usize| {
        let runs = segment.runs.start + n * k / parts..segment.runs.start + n * (k + 1) / parts;
        let weight = chunks[segment.chunk].runs[runs.clone()].iter().map(|r| (r.hi - r.lo) as usize).sum();
        Segment { key: segment.key, chunk: segment.chunk, runs, weight }
    };
    (0..parts).map(piece).collect()
}
