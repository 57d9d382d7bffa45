//! Upsampling by a kernel, along both axes.
//!
//! The centre of the field stays at the reference pixel n / 2 of both grids, so the coordinates of the sky hold. The sum of the weights of each
//! pixel is 1, and over all new pixels each old pixel has the same weight, so the mean brightness is kept away from the border.

use super::border::{by_rows_with, line, reflect};
use ndarray::{Array2, ArrayView2};

/// Where the new pixels lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placing {
    /// The reference pixels n / 2 of the old and the new grid coincide, as the coordinates of images have it.
    Reference,
    /// The outer edges of the old and the new grid coincide, as OpenCV and scikit-image have it.
    Edges,
}

/// A kernel of interpolation: its value at a distance in pixels, 0 from `reach` on.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<F> {
    /// Half of its width, pixels.
    pub reach: usize,
    /// Its value.
    pub value: F,
}

/// Index in the old line at which new pixel `i` lies, for a line of `n` pixels that becomes `factor` times as long.
pub(super) fn position(i: usize, n: usize, factor: usize, placing: Placing) -> f64 {
    match placing {
        Placing::Reference => (i as f64 - (n * factor / 2) as f64) / factor as f64 + (n / 2) as f64,
        Placing::Edges => (i as f64 + 0.5) / factor as f64 - 0.5,
    }
}

/// The old pixels and their weights for each new pixel of a line.
fn weights<F: Fn(f64) -> f64>(n: usize, factor: usize, kernel: &Kernel<F>, placing: Placing) -> Vec<Vec<(usize, f64)>> {
    let of_pixel = |i: usize| {
        let x = position(i, n, factor, placing);
        let first = x.floor() as isize - kernel.reach as isize + 1;
        let raw: Vec<(usize, f64)> = (first..first + 2 * kernel.reach as isize)
            .map(|k| (reflect(k, n), (kernel.value)((x - k as f64).abs())))
            .filter(|(_, w)| *w != 0.0)
            .collect();
        let sum: f64 = raw.iter().map(|(_, w)| w).sum();
        raw.into_iter().map(|(k, w)| (k, w / sum)).collect()
    };
    (0..n * factor).map(of_pixel).collect()
}

/// A plane \[m, l\] with `factor` times as many pixels along each axis.
pub(super) fn resample<F: Fn(f64) -> f64>(plane: ArrayView2<'_, f64>, factor: usize, kernel: &Kernel<F>, placing: Placing) -> Array2<f64> {
    let plane = plane.as_standard_layout().into_owned();
    let (n_m, n_l) = plane.dim();
    let (down, across) = (weights(n_m, factor, kernel, placing), weights(n_l, factor, kernel, placing));
    by_rows_with(
        (n_m * factor, n_l * factor),
        || vec![0.0; n_l],
        |mixed, r, out| {
            mixed.fill(0.0);
            for (from, w) in &down[r] {
                mixed.iter_mut().zip(line(&plane, *from)).for_each(|(o, v)| *o += w * v);
            }
            for (o, taps) in out.iter_mut().zip(&across) {
                *o = taps.iter().map(|(from, w)| w * mixed[*from]).sum();
            }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_pixels_coincide() {
        for (n, factor) in [(8, 2), (8, 3), (9, 2), (9, 3), (7, 4)] {
            assert_eq!(position(n * factor / 2, n, factor, Placing::Reference), (n / 2) as f64, "{n} {factor}");
            let edges = (position(0, n, factor, Placing::Edges), position(n * factor - 1, n, factor, Placing::Edges));
            assert!((edges.0 + edges.1 - (n - 1) as f64).abs() < 1e-12);
        }
    }
}
