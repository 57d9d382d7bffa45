//! The planes of a transform in groups that fit into memory.

use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use super::wplanes::SLAB;
use std::ops::Range;

/// Divide the planes into groups of consecutive planes that fit into `budget` bytes. A group has at least one plane.
///
/// A plane belongs to one group, so that it is transformed once. The tiles of a slab of w may reach into several groups, and are made again for
/// each: with the few visibilities of an image whose planes do not fit, this costs much less than another transform.
pub(super) fn plane_groups<T: Real>(plan: &Plan<T>, budget: usize) -> Vec<Range<usize>> {
    let planes = plan.planes();
    let fits = (budget / PlaneRows::<T>::bytes(plan.n_rows, 1, plan.columns.with_pixels).max(1)).clamp(1, planes);
    let groups = planes.div_ceil(fits);
    (0..groups).map(|k| planes * k / groups..planes * (k + 1) / groups).collect()
}

/// True if the tiles of a slab reach into a group of planes.
pub(super) fn reaches<T: Real>(plan: &Plan<T>, slab: usize, group: &Range<usize>) -> bool {
    slab * SLAB < group.end && slab * SLAB + plan.slab_depth() > group.start
}

/// The index in a group of a plane of the tiles of a slab; `None` if it belongs to another group.
pub(super) fn in_group(slab: usize, plane: usize, group: &Range<usize>) -> Option<usize> {
    let at = slab * SLAB + plane;
    group.contains(&at).then(|| at - group.start)
}

/// Index in the half grid of a row of a tile. The margin of the last tiles extends beyond the grid: these rows are empty, and the result is
/// `None`.
pub(super) fn grid_row<T: Real>(plan: &Plan<T>, tile_v: usize, row: usize) -> Option<usize> {
    let r = tile_v * TILE + row;
    if r < plan.n_rows { Some(r) } else { r.checked_sub(plan.nv).filter(|r| *r < plan.n_rows) }
}
