//! Bands of v, which are gridded one after the other, so that a process holds the rows of one band and not the whole grid.
//!
//! K processes that share a set hold P / K bytes of planes each, if P are those of one process. A band of S bands has P / S bytes. Of the bands before it,
//! a process keeps the columns of the image that are its own: P n_l / (n_u K) at the end. Both together are P / K for S = K n_u / (n_u - n_l), which is 2 K
//! where the grid is twice as wide as the image.

use super::own_columns::{columns_of, kept_bytes};
use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use std::ops::Range;

/// The bands of a transform, and the processes that share it.
#[derive(Debug, Clone)]
pub struct Bands {
    /// The rows of tiles of each.
    pub(super) tiles: Vec<Range<usize>>,
    /// The number of this process, and how many there are.
    pub(super) place: (usize, usize),
    /// Most bytes of planes that a process holds.
    pub(super) bytes: usize,
}

impl Bands {
    /// The bands of process `place.0` of `place.1`. `None` where the planes of a band would not fit into their share of the memory budget, or where
    /// visibilities alias over the edge of the grid.
    pub(super) fn of<T: Real>(plan: &Plan<T>, place: (usize, usize)) -> Option<Self> {
        let tiles = bands(plan, place.1)?;
        let bytes = banded_bytes(plan, &tiles, place.1);
        (bytes <= plan.plane_bytes).then_some(Self { tiles, place, bytes })
    }

    /// Number of bands.
    #[must_use]
    pub fn count(&self) -> usize {
        self.tiles.len()
    }

    /// Most bytes of planes that a process holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

/// The rows of tiles of each band, for so many processes. `None` where the tiles at the end of the grid reach over its edge into the first band.
pub(super) fn bands<T: Real>(plan: &Plan<T>, processes: usize) -> Option<Vec<Range<usize>>> {
    let tiles = plan.tiles_v();
    if tiles * TILE + plan.table.support > plan.nv {
        return None;
    }
    let count = (processes * plan.nu).div_ceil((plan.nu - plan.grid.n_l).max(1));
    Some(split(tiles, count))
}

/// `tiles` rows of tiles as at most `count` bands, none of which is empty.
pub(super) fn split(tiles: usize, count: usize) -> Vec<Range<usize>> {
    let count = count.clamp(1, tiles.max(1));
    (0..count).map(|k| tiles * k / count..tiles * (k + 1) / count).collect()
}

/// Stripes that have memory while a band is gridded. The tiles of a band reach into the first stripe of the next one.
pub(super) fn open_stripes<T: Real>(plan: &Plan<T>, band: &Range<usize>) -> Range<usize> {
    band.start..(band.end + 1).min(plan.tiles_v())
}

/// Most bytes of planes that a process holds: the largest band, and the columns that are its own.
pub(super) fn banded_bytes<T: Real>(plan: &Plan<T>, bands: &[Range<usize>], processes: usize) -> usize {
    let widest = (0..processes).map(|k| columns_of(plan.grid.n_l, k, processes).len()).max().unwrap_or(0);
    let rows = bands.iter().map(|b| open_stripes(plan, b).len() * TILE).max().unwrap_or(0);
    PlaneRows::<T>::bytes(rows, plan.planes(), plan.nu) + kept_bytes::<T>(plan.n_rows, plan.planes(), widest)
}
