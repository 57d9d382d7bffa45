//! Large arrays whose memory all threads take from the system.
//!
//! The system gives memory page by page, when a page is first touched, and clears each. For an image that takes as long as a pass over it. A page that is
//! read before it is written is given twice, and the second time all threads wait. So all threads write new arrays before they read them.

use ndarray::{Array2, ArrayView2, Zip};
use rayon::prelude::*;
use std::mem::MaybeUninit;

/// Elements that one thread writes at once.
const PART: usize = 1 << 14;

/// So many zeros.
pub(crate) fn zeroed<T: Copy + Default + Send + Sync>(n: usize) -> Vec<T> {
    let mut new = Vec::with_capacity(n);
    new.spare_capacity_mut()[..n].par_chunks_mut(PART).for_each(|part| part.fill(MaybeUninit::new(T::default())));
    // SAFETY: the parts cover so many elements, and all of each were written.
    unsafe { new.set_len(n) };
    new
}

/// An array of zeros \[row, column\].
pub(crate) fn zeros<T: Copy + Default + Send + Sync>(shape: (usize, usize)) -> Array2<T> {
    // The length is that of the shape, so this never fails.
    Array2::from_shape_vec(shape, zeroed(shape.0 * shape.1)).unwrap_or_default()
}

/// A copy of an array.
pub(crate) fn copied<T: Copy + Send + Sync>(array: ArrayView2<'_, T>) -> Array2<T> {
    Zip::from(array).par_map_collect(|v| *v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_elements_are_written() {
        for shape in [(0, 0), (0, 5), (3, 0), (1, 1), (1, PART), (2, PART + 3), (130, 301)] {
            // Memory that was used before holds something else.
            drop(Array2::from_elem(shape, 7.5_f32));
            assert_eq!(zeros::<f32>(shape), Array2::<f32>::zeros(shape));
            let array = Array2::from_shape_fn(shape, |(i, j)| (i * 1000 + j) as f64);
            let copy = copied(array.view());
            assert!(copy == array && copy.is_standard_layout());
            assert!(copied(array.t()) == array.t());
        }
    }
}
