//! Convolution of planes that go on as their mirror images, with a kernel that is given by its spectrum.
//!
//! A plane and its mirror images, reflected at the outer edge of the last pixel, repeat after twice the size without a jump. The convolution is
//! exactly that of this infinite plane: nothing is cut off, and a symmetric kernel keeps the sum of the plane.

use super::convolve::{Convolver, Filter, Spectrum};
use super::line_fft::LineFfts;
use super::real::Real;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex;
use rayon::prelude::*;

/// Plans for planes of one size.
#[derive(Debug)]
pub struct MirrorConvolver<T: Real>(Convolver<T>);

impl<T: Real> MirrorConvolver<T> {
    /// A convolver for planes \[`n_m`, `n_l`\].
    #[must_use]
    pub fn new((n_m, n_l): (usize, usize)) -> Self {
        let (p_m, p_l) = (2 * n_m, 2 * n_l);
        Self(Convolver { n_m: p_m, n_l: p_l, p_m, p_l, fft: LineFfts::new(p_l, p_m) })
    }

    /// The spectrum of a kernel from its values at frequencies along l and m, in cycles a pixel from -1/2 to 1/2. The kernel is real:
    /// its values at opposite frequencies are conjugate, and at 1/2 it is the same as at -1/2.
    #[must_use]
    pub fn spectrum(&self, value: impl Fn(f64, f64) -> Complex<T> + Sync) -> Spectrum<T> {
        let (p_l, p_m) = (self.0.p_l, self.0.p_m);
        let signed = |k: usize, n: usize| if 2 * k > n { k as f64 - n as f64 } else { k as f64 };
        let mut out: Vec<Complex<T>> = bytemuck::zeroed_vec(self.0.half() * p_m);
        out.par_chunks_mut(p_m).enumerate().for_each(|(u, column)| {
            for (v, out) in column.iter_mut().enumerate() {
                *out = value(u as f64 / p_l as f64, signed(v, p_m) / p_m as f64);
            }
        });
        Spectrum(out)
    }

    /// The plane convolved with a kernel.
    #[must_use]
    pub fn convolve(&self, plane: ArrayView2<'_, T>, kernel: &impl Filter<T>) -> Array2<T> {
        let (n_m, n_l) = plane.dim();
        let mut out = Array2::from_elem((n_m, n_l), T::default());
        let fill = |row: usize, out: &mut [T]| {
            let from = plane.row(if row < n_m { row } else { 2 * n_m - 1 - row });
            let (first, second) = out.split_at_mut(n_l);
            first.iter_mut().zip(from).for_each(|(o, v)| *o = *v);
            second.iter_mut().rev().zip(from).for_each(|(o, v)| *o = *v);
            true
        };
        self.0.through(fill, kernel, &mut out, |o, v| *o = v);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_kernel_of_three_values_is_the_sum_over_mirrored_neighbours() {
        for (n_m, n_l) in [(9, 14), (12, 7), (2, 5)] {
            let plane = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 7 + j * 3) % 11) as f64 - 4.0);
            let c = MirrorConvolver::<f64>::new((n_m, n_l));
            // 1 at the centre, 0.5 one pixel further along l, 0.25 one pixel back along m.
            let kernel = c.spectrum(|u, v| Complex::from(1.0) + Complex::cis(-TAU * u) * 0.5 + Complex::cis(TAU * v) * 0.25);
            let out = c.convolve(plane.view(), &kernel);
            for ((i, j), v) in out.indexed_iter() {
                let sum = plane[[i, j]] + 0.5 * plane[[i, j.saturating_sub(1)]] + 0.25 * plane[[(i + 1).min(n_m - 1), j]];
                assert!((v - sum).abs() < 1e-12, "{n_m} {n_l} at {i} {j}: {v} {sum}");
            }
        }
    }
}
