//! Which columns of the padded grid the planes keep.
//!
//! The padded grid is 1.4 to 2 times as wide as the image. Visibilities reach along u only as far as their baselines do: where a beam has four pixels, they leave more
//! than half of the columns empty, which are not stored. A row of the padded grid is made where it is transformed.

use super::kernel::KernelTable;
use super::line_fft::apart;
use super::plane_rows::TILE;
use super::real::Real;
use num_complex::Complex;

/// The columns of a row of a plane, in order of u from the most negative one on. Where visibilities reach farther than the padded grid, it is stored as a whole
/// from u = 0 on, and u wraps around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StoredColumns {
    /// Number of values of a row.
    pub(crate) width: usize,
    /// Number of values of a row whose pixels take its place when it is transformed. Those behind the stored columns are not used before that.
    pub(crate) with_pixels: usize,
    /// Number of columns before u = 0.
    pub(crate) left: usize,
    /// Tiles of starting cells in a row.
    pub(crate) tiles: usize,
}

impl StoredColumns {
    /// For a padded grid of `nu` columns, an image of `n_l` columns, and visibilities up to `reach` cells from u = 0.
    pub(crate) fn of<T: Real>((nu, n_l): (usize, usize), reach: f64, table: &KernelTable<T>) -> Self {
        let far = reach.ceil() as usize;
        let left = (far + table.support / 2 + 1).next_multiple_of(TILE);
        let tiles = (left + far + 1).div_ceil(TILE);
        let width = apart::<Complex<T>>(tiles * TILE + table.lanes);
        let with_pixels = width.max(apart::<Complex<T>>(n_l));
        if with_pixels < nu {
            Self { width, with_pixels, left, tiles }
        } else {
            Self { width: nu, with_pixels: nu, left: 0, tiles: nu.div_ceil(TILE) }
        }
    }

    /// Fill a row of the padded grid from a stored one.
    pub(crate) fn widen<V: Copy + Default>(self, stored: &[V], padded: &mut [V]) {
        let (before, from_0) = stored[..self.width].split_at(self.left);
        let empty = padded.len() - before.len();
        padded[..from_0.len()].copy_from_slice(from_0);
        padded[from_0.len()..empty].fill(V::default());
        padded[empty..].copy_from_slice(before);
    }

    /// Take what visibilities reach out of a row of the padded grid.
    pub(crate) fn narrow<V: Copy>(self, padded: &[V], stored: &mut [V]) {
        let (before, from_0) = stored[..self.width].split_at_mut(self.left);
        before.copy_from_slice(&padded[padded.len() - before.len()..]);
        from_0.copy_from_slice(&padded[..from_0.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel::Kernel;
    use super::super::sort::tile_of;
    use super::*;

    fn table(each: f64) -> KernelTable<f64> {
        KernelTable::new(&Kernel::for_error(each, 1.5).unwrap(), each)
    }

    /// Wherever a visibility lies within the reach, its tile with the margin is stored, at the columns where u is.
    #[test]
    fn every_tile_lies_within_the_stored_columns() {
        let mut narrow = 0;
        for table in [table(1e-2), table(1e-5), table(1e-11)] {
            for reach in [0.0, 0.4, 7.0, 8.01, 100.3, 400.0, 511.9, 512.0, 3000.0] {
                let columns = StoredColumns::of((1024, 700), reach, &table);
                narrow += usize::from(columns.width < 1024);
                let half = table.support as f64 / 2.0;
                for part in -1000..=1000 {
                    let x = reach * f64::from(part) / 1000.0;
                    let (tile, origin) = tile_of(x, half, columns.left as f64, 1024.0);
                    assert!(tile < columns.tiles, "{x} of {reach}: {tile} {columns:?}");
                    assert!((-1.0..TILE as f64).contains(&(x - origin)), "{x} of {reach}: {origin}");
                    if columns.width < 1024 {
                        assert!(tile * TILE + TILE + table.lanes <= columns.width && columns.with_pixels >= 700);
                        let first = origin - half + columns.left as f64;
                        assert!((first - (tile * TILE) as f64).abs() < 1e-9, "{x} of {reach}: {first}");
                    }
                }
            }
        }
        assert_eq!(narrow, 18);
    }

    #[test]
    fn rows_come_back_from_the_padded_grid() {
        let columns = StoredColumns::of((120, 64), 10.0, &table(1e-2));
        assert!(columns.width < 64 && columns.left == 16 && (64..80).contains(&columns.with_pixels), "{columns:?}");
        let stored: Vec<usize> = (1..=columns.with_pixels).collect();
        let mut padded = vec![7; 120];
        columns.widen(&stored, &mut padded);
        assert_eq!((padded[0], padded[119], padded[104]), (17, 16, 1));
        assert_eq!(padded.iter().filter(|v| **v == 0).count(), 120 - columns.width);
        let mut back = vec![0; columns.with_pixels];
        columns.narrow(&padded, &mut back);
        assert_eq!(back[..columns.width], stored[..columns.width]);
    }
}
