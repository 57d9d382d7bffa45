//! Bands of v, which are gridded one after the other, so that a process holds the rows of one band and not the whole grid.
//!
//! K processes that share a set hold P / K bytes of planes each, if P are those of one process. A band of S bands has P / S bytes. Of the bands before it,
//! a process keeps the columns of the image that are its own: P n_l / (n_u K) at the end, where all n_u columns of the padded grid are stored. Both together are then
//! P / K for S = K n_u / (n_u - n_l), which is 2 K where the grid is twice as wide as the image. Where fewer columns are stored, a band has less.

use super::own_columns::columns_of;
use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::Real;
use num_complex::Complex;
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
        let sides = Sides::of(plan);
        let tiles = sides.bands(place.1)?;
        let bytes = sides.bytes(&tiles, place.1);
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

/// The sizes of a transform from which its bands follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    /// Points of the padded grid along u and along v.
    pub(super) padded: (usize, usize),
    /// Columns of it that visibilities reach, which are stored.
    pub(super) width: usize,
    /// Columns of the image.
    pub(super) n_l: usize,
    /// Rows of the half grid that are kept, and planes.
    pub(super) rows: usize,
    pub(super) planes: usize,
    /// Cells that the kernel covers.
    pub(super) support: usize,
    /// Bytes of a cell.
    pub(super) cell_bytes: usize,
}

impl Sides {
    pub(super) fn of<T: Real>(plan: &Plan<T>) -> Self {
        Self {
            padded: (plan.nu, plan.nv),
            width: plan.columns.width,
            n_l: plan.grid.n_l,
            rows: plan.n_rows,
            planes: plan.planes(),
            support: plan.table.support,
            cell_bytes: size_of::<Complex<T>>(),
        }
    }

    /// The rows of tiles of each band, for so many processes. `None` where the tiles at the end of the grid reach over its edge into the first band.
    pub(super) fn bands(self, processes: usize) -> Option<Vec<Range<usize>>> {
        let tiles = self.rows.div_ceil(TILE);
        if tiles * TILE + self.support > self.padded.1 {
            return None;
        }
        let count = (processes * self.padded.0).div_ceil((self.padded.0 - self.n_l).max(1));
        Some(split(tiles, count))
    }

    /// Most bytes of planes that a process holds: the largest band, and the columns that are its own.
    pub(super) fn bytes(self, bands: &[Range<usize>], processes: usize) -> usize {
        let rows = bands.iter().map(|b| open_stripes(self.rows, b).len() * TILE).max().unwrap_or(0);
        rows * self.planes * self.width * self.cell_bytes + self.own_bytes(processes)
    }

    /// Bytes of the columns of a process in all rows and planes.
    pub(super) fn own_bytes(self, processes: usize) -> usize {
        let widest = (0..processes).map(|k| columns_of(self.n_l, k, processes).len()).max().unwrap_or(0);
        self.rows * self.planes * widest * self.cell_bytes
    }
}

/// `tiles` rows of tiles as at most `count` bands, none of which is empty.
pub(super) fn split(tiles: usize, count: usize) -> Vec<Range<usize>> {
    let count = count.clamp(1, tiles.max(1));
    (0..count).map(|k| tiles * k / count..tiles * (k + 1) / count).collect()
}

/// Stripes of a grid with so many rows that have memory while a band is gridded. The tiles of a band reach into the first stripe of the next one.
pub(super) fn open_stripes(n_rows: usize, band: &Range<usize>) -> Range<usize> {
    band.start..(band.end + 1).min(n_rows.div_ceil(TILE))
}
