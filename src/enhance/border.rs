//! The border of a frame, and work on its rows.
//!
//! Every filter takes the pixels beyond the border from the frame reflected at its outer edge (d c b a | a b c d | d c b a), so that a constant
//! frame stays constant and no border becomes darker or brighter than what lies beside it.

use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

/// The pixel that stands at index `i` of a line of `n` pixels reflected at its ends.
pub(super) fn reflect(i: isize, n: usize) -> usize {
    let k = i.rem_euclid(2 * n as isize) as usize;
    if k < n { k } else { 2 * n - 1 - k }
}

/// A plane with `rows` rows and `columns` columns more on each side, reflected.
pub(super) fn padded(plane: ArrayView2<'_, f64>, rows: usize, columns: usize) -> Array2<f64> {
    let (n_m, n_l) = plane.dim();
    by_rows((n_m + 2 * rows, n_l + 2 * columns), |r, out| {
        let from = plane.row(reflect(r as isize - rows as isize, n_m));
        for (c, v) in out.iter_mut().enumerate() {
            *v = from[reflect(c as isize - columns as isize, n_l)];
        }
    })
}

/// A plane \[m, l\] whose rows are computed by all threads. A row depends on its index alone, so the threads do not change the result.
pub(super) fn by_rows(dim: (usize, usize), row: impl Fn(usize, &mut [f64]) + Sync) -> Array2<f64> {
    by_rows_with(dim, || (), |(), r, out| row(r, out))
}

/// As [`by_rows`], with memory that each thread keeps from row to row.
pub(super) fn by_rows_with<T>(
    dim: (usize, usize),
    memory: impl Fn() -> T + Sync + Send,
    row: impl Fn(&mut T, usize, &mut [f64]) + Sync,
) -> Array2<f64> {
    let mut out = Array2::zeros(dim);
    if let Some(all) = out.as_slice_mut() {
        all.par_chunks_mut(dim.1.max(1)).enumerate().for_each_init(memory, |kept, (r, line)| row(kept, r, line));
    }
    out
}

/// A row of a plane in standard order.
pub(super) fn line(plane: &Array2<f64>, row: usize) -> &[f64] {
    let n = plane.ncols();
    plane.as_slice().map_or(&[], |all| &all[row * n..(row + 1) * n])
}

/// The sum of a function of each row, in the order of the rows, so that the threads do not change the result.
pub(super) fn sum_of_rows(rows: usize, of_row: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
    (0..rows).into_par_iter().map(of_row).collect::<Vec<f64>>().iter().sum()
}

/// Mean of all pixels.
pub(super) fn mean(plane: ArrayView2<'_, f64>) -> f64 {
    plane.mean().unwrap_or(0.0)
}

/// Smallest and largest pixel.
pub(super) fn range(plane: ArrayView2<'_, f64>) -> (f64, f64) {
    plane.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn a_line_is_reflected_at_its_outer_edge_as_often_as_needed() {
        let found: Vec<usize> = (-7..8).map(|i| reflect(i, 3)).collect();
        assert_eq!(found, [0, 0, 1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert_eq!(
            padded(array![[1.0, 2.0]].view(), 1, 2),
            array![[2., 1., 1., 2., 2., 1.], [2., 1., 1., 2., 2., 1.], [2., 1., 1., 2., 2., 1.]]
        );
    }
}
