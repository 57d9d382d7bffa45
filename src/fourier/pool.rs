//! Buffers that are kept for the next pass. The operating system gives large memory page by page and clears each page, which would take as
//! long as gridding.

use super::plane_rows::PlaneRows;
use super::real::Real;
use crate::memory::MemoryBudget;
use num_complex::Complex;
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Buffers that earlier passes have given back.
#[derive(Debug)]
pub(crate) struct Pool<T: Real> {
    nodes: Mutex<Vec<Vec<Complex<T>>>>,
    planes: Mutex<Vec<PlaneRows<T>>>,
    /// Buffers of tiles, as many as were lent at the same time.
    tiles: Mutex<Vec<Vec<T>>>,
    memory: MemoryBudget,
    /// Bytes of a set of planes that may be kept.
    kept_planes: usize,
}

impl<T: Real> Pool<T> {
    /// Buffers of the transform of an image with this number of pixels.
    pub(crate) fn new(memory: MemoryBudget, pixels: usize) -> Self {
        Self {
            nodes: Mutex::new(Vec::new()),
            planes: Mutex::new(Vec::new()),
            tiles: Mutex::new(Vec::new()),
            memory,
            kept_planes: memory.kept_planes_of(pixels),
        }
    }

    /// A buffer of this length with any content: the smallest kept buffer that is long enough and at most twice as long, or a new one.
    pub(crate) fn take(&self, len: usize) -> Vec<Complex<T>> {
        let mut kept = self.nodes.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |b: &&(usize, usize)| b.1 >= len && b.1 <= 2 * len;
        let sizes: Vec<(usize, usize)> = kept.iter().enumerate().map(|(k, b)| (k, b.capacity())).collect();
        let best = sizes.iter().filter(fits).min_by_key(|b| b.1);
        let mut buffer = best.map_or_else(Vec::new, |b| kept.swap_remove(b.0));
        drop(kept);
        buffer.resize(len, Complex::new(T::default(), T::default()));
        buffer
    }

    /// Give buffers back. Buffers beyond the share of the memory budget are freed.
    pub(crate) fn give(&self, buffers: Vec<Vec<Complex<T>>>) {
        let mut kept = self.nodes.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes = |b: &Vec<Complex<T>>| b.capacity() * size_of::<Complex<T>>();
        let mut total: usize = kept.iter().map(bytes).sum();
        for buffer in buffers {
            total += bytes(&buffer);
            if total <= self.memory.kept_buffers() {
                kept.push(buffer);
            }
        }
    }

    /// The buffer of a tile: so many numbers, all 0. It comes back when it is dropped. A transform has thousands of pieces of tiles, and the heap has one lock
    /// for all threads.
    pub(crate) fn tile(&self, len: usize) -> TileBuffer<'_, T> {
        let kept = self.tiles.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut numbers = kept.unwrap_or_default();
        numbers.clear();
        numbers.resize(len, T::default());
        TileBuffer { numbers, pool: self }
    }

    /// Planes of this size with any content.
    pub(crate) fn take_planes(&self, n_rows: usize, planes: usize, width: usize) -> PlaneRows<T> {
        let kept = self.planes.lock().unwrap_or_else(PoisonError::into_inner).pop();
        kept.filter(|k| k.fits(n_rows, planes, width)).unwrap_or_else(|| PlaneRows::zeros(n_rows, planes, width))
    }

    /// Planes of this size that are 0 everywhere.
    pub(crate) fn take_empty_planes(&self, n_rows: usize, planes: usize, width: usize) -> PlaneRows<T> {
        let kept = self.planes.lock().unwrap_or_else(PoisonError::into_inner).pop();
        // New planes are zero already.
        kept.filter(|k| k.fits(n_rows, planes, width)).map_or_else(
            || PlaneRows::zeros(n_rows, planes, width),
            |mut old| {
                old.clear();
                old
            },
        )
    }

    /// Give planes back. Planes beyond the share of the memory budget are freed.
    pub(crate) fn give_planes(&self, planes: PlaneRows<T>) {
        let mut kept = self.planes.lock().unwrap_or_else(PoisonError::into_inner);
        let total: usize = kept.iter().map(PlaneRows::size).sum();
        let keep = self.kept_planes;
        if total + planes.size() <= 2 * keep && planes.size() <= keep {
            kept.push(planes);
        }
    }
}

/// The numbers of a tile, lent by a pool.
pub(crate) struct TileBuffer<'a, T: Real> {
    numbers: Vec<T>,
    pool: &'a Pool<T>,
}

impl<T: Real> Deref for TileBuffer<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.numbers
    }
}

impl<T: Real> DerefMut for TileBuffer<'_, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.numbers
    }
}

impl<T: Real> Drop for TileBuffer<'_, T> {
    fn drop(&mut self) {
        self.pool.tiles.lock().unwrap_or_else(PoisonError::into_inner).push(std::mem::take(&mut self.numbers));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_buffer_of_a_tile_is_0_again_and_there_are_as_many_as_at_once() {
        let pool = Pool::<f32>::new(MemoryBudget::default(), 1);
        for _ in 0..3 {
            let (mut one, mut two) = (pool.tile(8), pool.tile(8));
            assert!(one.iter().chain(two.iter()).all(|x| *x == 0.0));
            one.fill(1.0);
            two.fill(2.0);
        }
        assert_eq!(pool.tiles.lock().unwrap().len(), 2);
    }

    #[test]
    fn a_buffer_that_is_far_too_large_stays_where_it_is() {
        let pool = Pool::<f32>::new(MemoryBudget::default(), 1);
        pool.give(vec![vec![Complex::default(); 1000], vec![Complex::default(); 150]]);
        assert_eq!(pool.take(100).capacity(), 150);
        assert_eq!(pool.take(100).capacity(), 100);
        assert_eq!(pool.take(900).capacity(), 1000);
    }
}
