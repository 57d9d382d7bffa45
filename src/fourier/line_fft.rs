//! One-dimensional transforms along the rows and the columns of a plane.

use super::real::Real;
use cittert_fourier_planner::{Fft, FftDirection};
use std::sync::Arc;

/// Plans of the one-dimensional transforms along rows and columns, forward and inverse.
pub(crate) struct LineFfts<T> {
    pub(crate) rows: [Arc<dyn Fft<T>>; 2],
    pub(crate) columns: [Arc<dyn Fft<T>>; 2],
}

impl<T> std::fmt::Debug for LineFfts<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LineFfts").finish_non_exhaustive()
    }
}

impl<T: Real> LineFfts<T> {
    pub(crate) fn new(nu: usize, nv: usize) -> Self {
        let both = |n| [T::plan(n, FftDirection::Forward), T::plan(n, FftDirection::Inverse)];
        Self { rows: both(nu), columns: both(nv) }
    }
}

/// Bytes of a cache line.
const LINE: usize = 64;

/// A distance between lines of `n` values of a type that are worked on together. It is odd in units of a cache line, so that values of the same index do
/// not all compete for the same place of the cache, as they would with a power of 2.
pub(super) fn apart<V>(n: usize) -> usize {
    let line = (LINE / size_of::<V>().max(1)).max(1);
    (n.div_ceil(line) | 1) * line
}

/// The smallest even number from `least` on with no prime factor above 5.
pub(crate) fn good_size(least: usize) -> usize {
    let smooth = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    (least..).find(|n| n.is_multiple_of(2) && smooth(*n)).unwrap_or(least)
}
