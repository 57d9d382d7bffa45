//! The planes of a transform in groups that fit into memory.

use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use super::wplanes::SLAB;
use std::ops::Range;

/// Divide the slabs of w into groups. The planes of one group fit into `budget` bytes; a group has at least one slab.
pub(super) fn plane_groups<T: Real>(plan: &Plan<T>, budget: usize) -> Vec<Range<usize>> {
    let slabs = plan.slabs();
    let overlap = plan.slab_depth().saturating_sub(SLAB);
    let fits = |n: usize| slabs == 1 || PlaneRows::<T>::bytes(plan.n_rows, n * SLAB + overlap, plan.nu) <= budget;
    let step = (1..=slabs).rev().find(|n| fits(*n)).unwrap_or(1);
    (0..slabs).step_by(step).map(|s| s..(s + step).min(slabs)).collect()
}

/// Number of planes of one group of slabs.
pub(super) fn planes_of<T: Real>(plan: &Plan<T>, group: &Range<usize>) -> usize {
    if plan.slabs() == 1 { plan.slab_depth() } else { (group.len() - 1) * SLAB + plan.slab_depth() }
}

/// Index in the half grid of a row of a tile. The margin of the last tiles extends beyond the grid: these rows are empty, and the result is
/// `None`.
pub(super) fn grid_row<T: Real>(plan: &Plan<T>, tile_v: usize, row: usize) -> Option<usize> {
    let r = tile_v * TILE + row;
    if r < plan.n_rows { Some(r) } else { r.checked_sub(plan.nv).filter(|r| *r < plan.n_rows) }
}
