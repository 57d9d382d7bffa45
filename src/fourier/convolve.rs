//! Convolution of images by padded Fourier transforms. It serves restoring beams, the scales of multiscale CLEAN, and models with the dirty
//! beam.
//!
//! Two real rows share one complex transform, and only half of the spectrum is kept. The spectrum is stored by columns, so that the inverse
//! transform can start without a transpose.

use super::line_fft::{LineFfts, good_size};
use super::real::Real;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use rayon::prelude::*;

/// Number of columns that are transposed together: a few cache lines of each row.
const BLOCK: usize = 16;

/// Plans for images of one size.
pub struct Convolver<T: Real> {
    n_m: usize,
    n_l: usize,
    p_m: usize,
    p_l: usize,
    fft: LineFfts<T>,
}

/// Half of the spectrum of a real image \[u, v\].
#[derive(Debug, Clone)]
pub struct Spectrum<T>(Vec<Complex<T>>);

impl<T: Real> std::fmt::Debug for Convolver<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Convolver({} x {} padded to {} x {})", self.n_l, self.n_m, self.p_l, self.p_m)
    }
}

impl<T: Real> Convolver<T> {
    /// A convolver for images \[`n_m`, `n_l`\] and for kernels that reach at most `reach` pixels from their centre.
    #[must_use]
    pub fn new((n_m, n_l): (usize, usize), reach: usize) -> Self {
        // The part that wraps around falls into the padding.
        let (p_m, p_l) = (good_size(n_m + reach.min(n_m)), good_size(n_l + reach.min(n_l)));
        Self { n_m, n_l, p_m, p_l, fft: LineFfts::new(p_l, p_m) }
    }

    /// Rows and columns of the padded transforms.
    #[must_use]
    pub fn padded(&self) -> (usize, usize) {
        (self.p_m, self.p_l)
    }

    /// Spectrum of an image of this size.
    #[must_use]
    pub fn image(&self, image: ArrayView2<'_, T>) -> Spectrum<T> {
        self.forward(image, (0, 0))
    }

    /// Spectrum of a kernel. Its array \[k_m, k_l\] is not larger than the images, and its centre is the pixel (k_m / 2, k_l / 2).
    #[must_use]
    pub fn kernel(&self, kernel: ArrayView2<'_, T>) -> Spectrum<T> {
        let (k_m, k_l) = kernel.dim();
        self.forward(kernel, (k_m / 2, k_l / 2))
    }

    /// Image convolved with a kernel.
    #[must_use]
    pub fn convolve(&self, image: ArrayView2<'_, T>, kernel: &Spectrum<T>) -> Array2<T> {
        let mut s = self.image(image);
        s.multiply(kernel);
        self.inverse(s)
    }

    fn forward(&self, image: ArrayView2<'_, T>, (c_m, c_l): (usize, usize)) -> Spectrum<T> {
        let (k_m, k_l) = image.dim();
        let half = self.p_l / 2 + 1;
        let zero = Complex::new(T::default(), T::default());
        // New memory is zero already, and the threads that fill it are the first to touch it.
        let mut rows: Vec<Complex<T>> = bytemuck::zeroed_vec(k_m * half);
        rows.par_chunks_mut(2 * half).enumerate().for_each_init(
            || (vec![zero; self.p_l], vec![zero; self.fft.rows[0].get_inplace_scratch_len()]),
            |(z, scratch), (pair, out)| {
                // Most rows of a model have no source. Their spectra are 0.
                let empty = |row: usize| row >= k_m || image.row(row).iter().all(|v| *v == T::default());
                if empty(2 * pair) && empty(2 * pair + 1) {
                    return;
                }
                z.fill(zero);
                for c in 0..k_l {
                    let at = (c + self.p_l - c_l) % self.p_l;
                    let second = if 2 * pair + 1 < k_m { image[(2 * pair + 1, c)] } else { T::default() };
                    z[at] = Complex::new(image[(2 * pair, c)], second);
                }
                self.fft.rows[0].process_with_scratch(z, scratch);
                let (first, second) = out.split_at_mut(half);
                for u in 0..half {
                    let (a, b) = (z[u], z[(self.p_l - u) % self.p_l]);
                    let h = T::of(0.5);
                    first[u] = Complex::new(a.re + b.re, a.im - b.im).scale(h);
                    if let Some(s) = second.get_mut(u) {
                        *s = Complex::new(a.im + b.im, b.re - a.re).scale(h);
                    }
                }
            },
        );
        let mut out: Vec<Complex<T>> = bytemuck::zeroed_vec(half * self.p_m);
        out.par_chunks_mut(BLOCK * self.p_m).enumerate().for_each_init(
            || vec![zero; self.fft.columns[0].get_inplace_scratch_len()],
            |scratch, (block, columns)| {
                let width = columns.len() / self.p_m;
                for r in 0..k_m {
                    let at = (r + self.p_m - c_m) % self.p_m;
                    let from = &rows[r * half + block * BLOCK..];
                    for (c, v) in from[..width].iter().enumerate() {
                        columns[c * self.p_m + at] = *v;
                    }
                }
                self.fft.columns[0].process_with_scratch(columns, scratch);
            },
        );
        Spectrum(out)
    }

    /// The image of a spectrum.
    #[must_use]
    pub fn inverse(&self, mut spectrum: Spectrum<T>) -> Array2<T> {
        let half = self.p_l / 2 + 1;
        let zero = Complex::new(T::default(), T::default());
        spectrum.0.par_chunks_mut(BLOCK * self.p_m).for_each_init(
            || vec![zero; self.fft.columns[1].get_inplace_scratch_len()],
            |scratch, columns| self.fft.columns[1].process_with_scratch(columns, scratch),
        );
        let columns = &spectrum.0;
        // Several rows are gathered together, since their values are adjacent in each column.
        let mut out = Array2::from_elem((self.n_m, self.n_l), T::default());
        let scale = T::of(1.0 / (self.p_l as f64 * self.p_m as f64));
        out.axis_chunks_iter_mut(Axis(0), BLOCK).into_par_iter().enumerate().for_each_init(
            || (vec![zero; BLOCK / 2 * self.p_l], vec![zero; self.fft.rows[1].get_inplace_scratch_len()]),
            |(z, scratch), (block, mut rows)| {
                let first = block * BLOCK;
                for u in 0..half {
                    let mirror = (self.p_l - u) % self.p_l;
                    let column = &columns[u * self.p_m + first..(u + 1) * self.p_m];
                    for (q, pair) in z.chunks_exact_mut(self.p_l).enumerate() {
                        let a = column.get(2 * q).copied().unwrap_or(zero);
                        let b = column.get(2 * q + 1).copied().unwrap_or(zero);
                        pair[u] = Complex::new(a.re - b.im, a.im + b.re);
                        if mirror != u {
                            pair[mirror] = Complex::new(a.re + b.im, b.re - a.im);
                        }
                    }
                }
                self.fft.rows[1].process_with_scratch(z, scratch);
                for (r, mut row) in rows.rows_mut().into_iter().enumerate() {
                    let pair = &z[r / 2 * self.p_l..];
                    for (o, v) in row.iter_mut().zip(pair) {
                        *o = scale * if r % 2 == 0 { v.re } else { v.im };
                    }
                }
            },
        );
        out
    }
}

impl<T: Real> Spectrum<T> {
    /// The spectrum with a real function applied to the real part. The imaginary part becomes 0, as it is for a symmetric kernel.
    #[must_use]
    pub fn map_real(&self, f: impl Fn(T) -> T + Sync) -> Self {
        Self(self.0.par_iter().map(|v| Complex::new(f(v.re), T::default())).collect())
    }

    /// The real parts.
    pub fn real_parts(&self) -> impl Iterator<Item = T> + '_ {
        self.0.iter().map(|v| v.re)
    }

    /// Multiply by another spectrum of the same convolver.
    pub fn multiply(&mut self, other: &Self) {
        debug_assert_eq!(self.0.len(), other.0.len(), "spectra of two convolvers");
        self.0.par_chunks_mut(1 << 14).zip(other.0.par_chunks(1 << 14)).for_each(|(a, b)| {
            for (a, b) in a.iter_mut().zip(b) {
                *a *= *b;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn convolution_agrees_with_the_double_sum_at_all_edges() {
        for (n_m, n_l) in [(9, 14), (12, 7), (2, 40), (33, 33)] {
            let image = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 7 + j * 3) % 11) as f64 - 4.0);
            let kernel = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 5 + j * 2) % 13) as f64 * 0.1 - 0.4);
            let c = Convolver::<f64>::new((n_m, n_l), n_m.max(n_l) / 2 + 1);
            let fast = c.convolve(image.view(), &c.kernel(kernel.view()));
            for ((i, j), v) in fast.indexed_iter() {
                let mut sum = 0.0;
                for ((p, q), x) in image.indexed_iter() {
                    let (a, b) = ((i + n_m / 2).wrapping_sub(p), (j + n_l / 2).wrapping_sub(q));
                    sum += x * kernel.get((a, b)).copied().unwrap_or(0.0);
                }
                assert!((v - sum).abs() < 1e-11, "{n_m} {n_l} at {i} {j}: {v} {sum}");
            }
        }
    }
}
