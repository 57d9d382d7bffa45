//! Convolution of images by padded Fourier transforms. It serves restoring beams, the scales of multiscale CLEAN, and models with the dirty
//! beam.
//!
//! Two real rows share one complex transform, and only half of the spectrum is kept. The spectrum of a kernel is stored by columns. An image
//! never has its whole spectrum in memory: its rows are transformed, and then each block of columns is padded, transformed, multiplied,
//! transformed back and written over the rows. The padding along m exists only in the block that a thread works on.

use super::line_fft::{LineFfts, apart, good_size};
use super::real::Real;
use crate::pages::{zeroed, zeros};
use ndarray::{Array2, ArrayView1, ArrayView2, Axis};
use num_complex::Complex;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Number of columns that are transposed together: a few cache lines of each row.
const BLOCK: usize = 16;

/// Plans for images of one size.
pub struct Convolver<T: Real> {
    pub(super) n_m: usize,
    pub(super) n_l: usize,
    pub(super) p_m: usize,
    pub(super) p_l: usize,
    pub(super) fft: LineFfts<T>,
}

/// Half of the spectrum of a real image \[u, v\].
#[derive(Debug, Clone)]
pub struct Spectrum<T>(pub(super) Vec<Complex<T>>);

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

    /// Spectrum of a kernel. Its array \[k_m, k_l\] is not larger than the images, and its centre is the pixel (k_m / 2, k_l / 2).
    #[must_use]
    pub fn kernel(&self, kernel: ArrayView2<'_, T>) -> Spectrum<T> {
        let (k_m, k_l) = kernel.dim();
        let (c_m, c_l) = (k_m / 2, k_l / 2);
        let half = self.half();
        let rows = self.rows(k_m, c_l, |row, out| copy_row(kernel.row(row), out));
        let mut out: Vec<Complex<T>> = zeroed(half * self.p_m);
        out.par_chunks_mut(BLOCK * self.p_m).enumerate().for_each_init(
            || vec![Complex::default(); self.fft.columns[0].get_inplace_scratch_len()],
            |scratch, (block, columns)| {
                let width = columns.len() / self.p_m;
                for r in 0..k_m {
                    let at = (r + self.p_m - c_m) % self.p_m;
                    for (c, v) in rows.row(r).iter().skip(block * BLOCK).take(width).enumerate() {
                        columns[c * self.p_m + at] = *v;
                    }
                }
                self.fft.columns[0].process_with_scratch(columns, scratch);
            },
        );
        Spectrum(out)
    }

    /// Image convolved with a kernel.
    #[must_use]
    pub fn convolve(&self, image: ArrayView2<'_, T>, kernel: &impl Filter<T>) -> Array2<T> {
        let mut out = zeros((self.n_m, self.n_l));
        self.through(|row, out| copy_row(image.row(row), out), kernel, &mut out, |o, v| *o = v);
        out
    }

    /// Convolve an image with a kernel in its own memory.
    pub fn convolve_in_place(&self, image: &mut Array2<T>, kernel: &impl Filter<T>) {
        let mut rows = self.rows(self.n_m, 0, |row, out| copy_row(image.row(row), out));
        self.columns(&mut rows, kernel);
        self.back(&rows, image, |o, v| *o = v);
    }

    /// Subtract points (row, column, flux), convolved with a kernel, from an image. Points of one pixel add up.
    pub fn subtract_points(&self, points: &[(usize, usize, f64)], kernel: &impl Filter<T>, image: &mut Array2<T>) {
        let mut sums = BTreeMap::<(usize, usize), f64>::new();
        points.iter().for_each(|(row, column, flux)| *sums.entry((*row, *column)).or_default() += flux);
        let fill = |row: usize, out: &mut [T]| {
            let mut any = false;
            for ((_, column), flux) in sums.range((row, 0)..(row + 1, 0)) {
                out[*column] = T::of(*flux);
                any = true;
            }
            any
        };
        self.through(fill, kernel, image, |o, v| *o -= v);
    }

    pub(super) fn half(&self) -> usize {
        self.p_l / 2 + 1
    }

    /// Convolve the image whose rows `fill` writes, and combine each pixel of the result with one of `out`.
    pub(super) fn through(
        &self,
        fill: impl Fn(usize, &mut [T]) -> bool + Sync,
        kernel: &impl Filter<T>,
        out: &mut Array2<T>,
        combine: impl Fn(&mut T, T) + Sync,
    ) {
        let mut rows = self.rows(self.n_m, 0, fill);
        self.columns(&mut rows, kernel);
        self.back(&rows, out, combine);
    }

    /// Transforms of `count` real rows along l, \[row, u\]. `fill` writes a row into a slice of zeros and returns false if the row is empty.
    /// The pixel `origin` of a row is the origin of the transform.
    pub(super) fn rows(&self, count: usize, origin: usize, fill: impl Fn(usize, &mut [T]) -> bool + Sync) -> Array2<Complex<T>> {
        let half = self.half();
        let zero = Complex::new(T::default(), T::default());
        // The threads that fill the memory are the first to touch it. To clear it first would take a tenth of the time of a convolution.
        let mut rows: Vec<Complex<T>> = Vec::with_capacity(count * half);
        rows.spare_capacity_mut()[..count * half].par_chunks_mut(2 * half).enumerate().for_each_init(
            || (vec![zero; self.p_l], vec![zero; self.fft.rows[0].get_inplace_scratch_len()], [self.line(), self.line()]),
            |(z, scratch, [a, b]), (pair, out)| {
                a.fill(T::default());
                b.fill(T::default());
                let first = fill(2 * pair, a);
                let second = 2 * pair + 1 < count && fill(2 * pair + 1, b);
                // Most rows of a model have no source. Their spectra are 0.
                if !first && !second {
                    out.iter_mut().for_each(|v| {
                        v.write(zero);
                    });
                    return;
                }
                z.fill(zero);
                let places = (self.p_l - origin..self.p_l).chain(0..self.p_l - origin);
                for (place, (a, b)) in places.zip(a.iter().zip(b.iter())) {
                    z[place] = Complex::new(*a, *b);
                }
                self.fft.rows[0].process_with_scratch(z, scratch);
                let (first, second) = out.split_at_mut(half);
                for u in 0..half {
                    let (a, b) = (z[u], z[if u == 0 { 0 } else { self.p_l - u }]);
                    let h = T::of(0.5);
                    first[u].write(Complex::new(a.re + b.re, a.im - b.im).scale(h));
                    if let Some(s) = second.get_mut(u) {
                        s.write(Complex::new(a.im + b.im, b.re - a.re).scale(h));
                    }
                }
            },
        );
        // SAFETY: the parts cover so many values, and a task writes all of its part: those of a row, and of a second one where there is one.
        unsafe { rows.set_len(count * half) };
        // The length is that of the shape, so this never fails.
        Array2::from_shape_vec((count, half), rows).unwrap_or_default()
    }

    fn line(&self) -> Vec<T> {
        vec![T::default(); self.p_l]
    }

    /// Multiply the transforms of the columns of these rows \[row, u\] by a kernel.
    pub(super) fn columns(&self, rows: &mut Array2<Complex<T>>, kernel: &impl Filter<T>) {
        let zero = Complex::new(T::default(), T::default());
        let scratch = self.fft.columns.iter().map(|f| f.get_inplace_scratch_len()).max().unwrap_or(0);
        let stride = apart::<Complex<T>>(self.p_m);
        rows.axis_chunks_iter_mut(Axis(1), BLOCK).into_par_iter().enumerate().for_each_init(
            || (vec![zero; BLOCK * stride], vec![zero; scratch]),
            |(z, scratch), (block, mut part)| {
                for (r, row) in part.rows().into_iter().enumerate() {
                    for (c, v) in row.iter().enumerate() {
                        z[c * stride + r] = *v;
                    }
                }
                for (c, column) in z.chunks_exact_mut(stride).take(part.ncols()).enumerate() {
                    let column = &mut column[..self.p_m];
                    column[part.nrows()..].fill(zero);
                    self.fft.columns[0].process_with_scratch(column, scratch);
                    kernel.apply((block * BLOCK + c) * self.p_m, column);
                    self.fft.columns[1].process_with_scratch(column, scratch);
                }
                for (r, mut row) in part.rows_mut().into_iter().enumerate() {
                    for (c, v) in row.iter_mut().enumerate() {
                        *v = z[c * stride + r];
                    }
                }
            },
        );
    }

    /// Transform rows \[row, u\] back to pixels, and combine them with those of `out`.
    pub(super) fn back(&self, rows: &Array2<Complex<T>>, out: &mut Array2<T>, combine: impl Fn(&mut T, T) + Sync) {
        let zero = Complex::new(T::default(), T::default());
        let scale = T::of(1.0 / (self.p_l as f64 * self.p_m as f64));
        out.axis_chunks_iter_mut(Axis(0), 2).into_par_iter().enumerate().for_each_init(
            || (vec![zero; self.p_l], vec![zero; self.fft.rows[1].get_inplace_scratch_len()]),
            |(z, scratch), (pair, mut lines)| {
                let two = lines.nrows() == 2;
                for (u, a) in rows.row(2 * pair).iter().enumerate() {
                    let b = if two { rows[(2 * pair + 1, u)] } else { zero };
                    z[u] = Complex::new(a.re - b.im, a.im + b.re);
                    let mirror = self.p_l - u;
                    if u > 0 && mirror != u {
                        z[mirror] = Complex::new(a.re + b.im, b.re - a.im);
                    }
                }
                self.fft.rows[1].process_with_scratch(z, scratch);
                for (r, mut line) in lines.rows_mut().into_iter().enumerate() {
                    for (o, v) in line.iter_mut().zip(z.iter()) {
                        combine(o, scale * if r == 0 { v.re } else { v.im });
                    }
                }
            },
        );
    }
}

/// Copy a row to the front of a slice of zeros; false if the row is 0 everywhere.
fn copy_row<T: Real>(row: ArrayView1<'_, T>, out: &mut [T]) -> bool {
    let mut any = false;
    for (o, v) in out.iter_mut().zip(row) {
        *o = *v;
        any |= *v != T::default();
    }
    any
}

/// What multiplies the spectrum of an image.
pub trait Filter<T: Real>: Sync {
    /// Multiply these values of a half spectrum \[u, v\], from the one with the index `first` on.
    fn apply(&self, first: usize, values: &mut [Complex<T>]);
}

impl<T: Real> Filter<T> for Spectrum<T> {
    fn apply(&self, first: usize, values: &mut [Complex<T>]) {
        values.iter_mut().zip(&self.0[first..]).for_each(|(v, k)| *v *= *k);
    }
}

impl<T: Real> Spectrum<T> {
    /// The real parts.
    pub fn real_parts(&self) -> impl Iterator<Item = T> + '_ {
        self.0.iter().map(|v| v.re)
    }

    /// The squares of the absolute values.
    #[must_use]
    pub fn powers(&self) -> Vec<T> {
        self.0.par_iter().map(|v| v.re * v.re + v.im * v.im).collect()
    }

    /// The spectrum of a symmetric kernel, whose imaginary part is 0, with a function applied to it.
    #[must_use]
    pub fn real(&self, f: impl Fn(T) -> T + Sync) -> RealSpectrum<T> {
        RealSpectrum(self.0.par_iter().map(|v| f(v.re)).collect())
    }
}

/// Half of the spectrum of a kernel that is symmetric about its centre \[u, v\]. It has no imaginary part.
#[derive(Debug, Clone)]
pub struct RealSpectrum<T>(Vec<T>);

impl<T: Real> RealSpectrum<T> {
    /// The values.
    #[must_use]
    pub fn values(&self) -> &[T] {
        &self.0
    }

    /// The operator that multiplies each Fourier component by a function of its value here.
    pub fn map<F: Fn(T) -> T + Sync>(&self, f: F) -> impl Filter<T> + use<'_, T, F> {
        Mapped { values: &self.0, f }
    }

    /// The operator that multiplies each Fourier component by a function of its values here and in another spectrum of the same size.
    pub fn map_with<'a, F: Fn(T, T) -> T + Sync>(&'a self, other: &'a Self, f: F) -> impl Filter<T> + use<'a, T, F> {
        MappedPair { values: &self.0, others: &other.0, f }
    }
}

impl<T: Real> Filter<T> for RealSpectrum<T> {
    fn apply(&self, first: usize, values: &mut [Complex<T>]) {
        values.iter_mut().zip(&self.0[first..]).for_each(|(v, k)| *v = v.scale(*k));
    }
}

/// A function of a real spectrum.
struct Mapped<'a, T, F> {
    values: &'a [T],
    f: F,
}

impl<T: Real, F: Fn(T) -> T + Sync> Filter<T> for Mapped<'_, T, F> {
    fn apply(&self, first: usize, values: &mut [Complex<T>]) {
        values.iter_mut().zip(&self.values[first..]).for_each(|(v, k)| *v = v.scale((self.f)(*k)));
    }
}

/// A function of two real spectra.
struct MappedPair<'a, T, F> {
    values: &'a [T],
    others: &'a [T],
    f: F,
}

impl<T: Real, F: Fn(T, T) -> T + Sync> Filter<T> for MappedPair<'_, T, F> {
    fn apply(&self, first: usize, values: &mut [Complex<T>]) {
        let both = self.values[first..].iter().zip(&self.others[first..]);
        values.iter_mut().zip(both).for_each(|(v, (k, c))| *v = v.scale((self.f)(*k, *c)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn convolution_agrees_with_the_double_sum_at_all_edges() {
        for (n_m, n_l) in [(9, 14), (12, 7), (2, 40), (33, 33), (20, 20), (8, 8)] {
            let image = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 7 + j * 3) % 11) as f64 - 4.0);
            let kernel = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 5 + j * 2) % 13) as f64 * 0.1 - 0.4);
            // A kernel of the size of the image reaches half of its side.
            let c = Convolver::<f64>::new((n_m, n_l), n_m.max(n_l) / 2);
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
