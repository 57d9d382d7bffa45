//! The memory of the planes of the half grid.

use super::real::Real;
use num_complex::Complex;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Side of a tile of starting cells: with its margin a tile fits into the first cache.
pub(crate) const TILE: usize = 16;

/// The rows of several planes, in stripes of `TILE` rows. A stripe is \[row, plane, u\] and has a lock of its own.
#[derive(Debug)]
pub(crate) struct PlaneRows<T> {
    pub(crate) stripes: Vec<Mutex<Vec<Complex<T>>>>,
    pub(crate) planes: usize,
    /// Values of a row of a plane.
    pub(crate) width: usize,
}

impl<T: Real> PlaneRows<T> {
    pub(crate) fn zeros(n_rows: usize, planes: usize, width: usize) -> Self {
        // New pages are written first, on all threads. A page that is read first is given by the system twice, and the second time all threads wait.
        let len = TILE * planes * width;
        let mut stripes: Vec<Vec<Complex<T>>> = (0..n_rows.div_ceil(TILE)).map(|_| Vec::with_capacity(len)).collect();
        stripes.par_iter_mut().for_each(|s| s.resize(len, Complex::new(T::default(), T::default())));
        Self { stripes: stripes.into_iter().map(Mutex::new).collect(), planes, width }
    }

    /// Rows without memory. Stripes are put into them where they are needed.
    pub(crate) fn unfilled(n_rows: usize, planes: usize, width: usize) -> Self {
        Self { stripes: (0..n_rows.div_ceil(TILE)).map(|_| Mutex::new(Vec::new())).collect(), planes, width }
    }

    /// True if it has this size.
    pub(crate) fn fits(&self, n_rows: usize, planes: usize, width: usize) -> bool {
        self.planes == planes
            && self.width == width
            && self.stripes.len() == n_rows.div_ceil(TILE)
            && self.size() == Self::bytes(n_rows, planes, width)
    }

    /// Size in bytes.
    pub(crate) fn size(&self) -> usize {
        let first = self.stripes.first().map_or(0, |s| s.lock().unwrap_or_else(PoisonError::into_inner).len());
        self.stripes.len() * first * size_of::<Complex<T>>()
    }

    /// Set everything to 0.
    pub(crate) fn clear(&mut self) {
        self.stripes_mut().into_par_iter().for_each(|s| s.fill(Complex::new(T::default(), T::default())));
    }

    /// Size in bytes of this number of planes.
    pub(crate) fn bytes(n_rows: usize, planes: usize, width: usize) -> usize {
        Self::bytes_of_rows(n_rows.div_ceil(TILE) * TILE, planes, width)
    }

    /// Size in bytes of so many rows of this number of planes.
    pub(crate) fn bytes_of_rows(rows: usize, planes: usize, width: usize) -> usize {
        rows * planes * width * size_of::<Complex<T>>()
    }

    pub(crate) fn stripes_mut(&mut self) -> Vec<&mut Vec<Complex<T>>> {
        self.stripes.iter_mut().map(|s| s.get_mut().unwrap_or_else(PoisonError::into_inner)).collect()
    }
}
