//! The Hessian of chi squared: a convolution with the dirty beam of the weights of the data.
//!
//! For visibilities the Hessian of chi2 / 2 is A^T W A. For a field without a w term this is exactly a convolution with the beam. It does
//! not depend on the image. A Newton step therefore needs fast convolutions and no transform of visibilities. The inverse is approximated
//! by that of the nearest circulant matrix, which is diagonal after a Fourier transform.
//!
//! # Reference
//! Chan 1988, SIAM J. Sci. Stat. Comput. 9, 766 (the circulant); Cornwell & Evans 1985, A&A 143, 77 (the diagonal alone).

use crate::fourier::{Convolver, Filter, GridOptions, RealSpectrum};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, Zip};
use rayon::prelude::*;

/// Factor on the cell, and its inverse on uvw. It leaves u l unchanged and keeps a field of twice the width in front of the horizon.
pub(super) const SHRINK: f64 = 1e-4;

/// The Hessian of half of chi squared as a convolution.
pub struct BeamHessian {
    wide: Convolver<f32>,
    beam: RealSpectrum<f32>,
    round: Convolver<f32>,
    eigenvalues: RealSpectrum<f32>,
    /// Sum of the weights: the diagonal, 1 / flux^2.
    diagonal: f64,
    /// Largest eigenvalue over the diagonal.
    largest: f64,
}

impl std::fmt::Debug for BeamHessian {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BeamHessian({:?}, diagonal {:e}, largest eigenvalue {:e})", self.wide, self.diagonal, self.largest)
    }
}

impl BeamHessian {
    /// For visibilities in memory, with these uvw in m \[row, 3\], channels and weights \[row x chan\].
    #[cfg(test)]
    pub(super) fn of_list(grid: &SkyGrid, freq_hz: &[f64], uvw_m: ArrayView2<'_, f64>, weights: &[f32]) -> crate::Result<Self> {
        let mut pair = crate::fourier::Pair::<f32>::new(&Self::field(grid), freq_hz, Self::stretch(uvw_m).view(), &Self::grid_options())?;
        let diagonal: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let values: Vec<num_complex::Complex64> = weights.iter().map(|w| (f64::from(*w) / diagonal).into()).collect();
        let beam = pair.adjoint(&values, 1.0)?.mapv(|v| v as f32);
        drop(pair);
        Ok(Self::of_beam(grid, beam, diagonal))
    }

    /// The field of a beam of twice the size, with shrunken cells.
    pub(super) fn field(grid: &SkyGrid) -> SkyGrid {
        SkyGrid { n_l: 2 * grid.n_l, n_m: 2 * grid.n_m, cell_rad: grid.cell_rad * SHRINK, frame: grid.frame.clone() }
    }

    /// The uvw \[row, 3\] that belong to shrunken cells, with w = 0.
    pub(super) fn stretch(uvw_m: ArrayView2<'_, f64>) -> Array2<f64> {
        let mut stretched = uvw_m.to_owned();
        stretched.column_mut(2).fill(0.0);
        stretched /= SHRINK;
        stretched
    }

    /// The options of the transform to a beam.
    pub(super) fn grid_options() -> GridOptions {
        GridOptions { epsilon: 1e-5, w_term: false, divide_by_n: false, ..GridOptions::default() }
    }

    /// From the beam of twice the size \[2 m, 2 l\], 1 in its middle, and the sum of the weights, 1 / flux^2.
    pub(super) fn of_beam(grid: &SkyGrid, mut beam: Array2<f32>, diagonal: f64) -> Self {
        let wide = Convolver::new((grid.n_m, grid.n_l), grid.n_m.max(grid.n_l));
        let round = Convolver::new((grid.n_m, grid.n_l), 0);
        let eigenvalues = round.kernel(circulant(&beam, (grid.n_m, grid.n_l), round.padded()).view()).real(|v| v.max(0.0));
        let largest = eigenvalues.values().iter().copied().fold(0.0_f32, f32::max);
        // The outermost lines have no mirror image, and no pair of pixels spans them. Without them the beam is symmetric, because the data have
        // no w, and its spectrum is real.
        beam.row_mut(0).fill(0.0);
        beam.column_mut(0).fill(0.0);
        let beam = wide.kernel(beam.view()).real(|v| v);
        Self { wide, beam, round, eigenvalues, diagonal, largest: f64::from(largest) }
    }

    /// The diagonal: the sum of the weights, 1 / flux^2.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The largest eigenvalue, 1 / flux^2.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.largest * self.diagonal
    }

    /// Replace an image by the Hessian over its diagonal times this image.
    pub fn apply_to(&self, v: &mut Array2<f32>) {
        self.wide.convolve_in_place(v, &self.beam);
    }

    /// The operator (1 + t H / diagonal)^-1 in the circulant approximation, for [`BeamHessian::filter`].
    pub fn damping(&self, t: f32) -> impl Filter<f32> + use<'_> {
        self.eigenvalues.map(move |k| 1.0 / (1.0 + t * k))
    }

    /// The operator (1 + t H / diagonal + u L)^-1 in the circulant approximation, with L of [`BeamHessian::differences`].
    pub fn damping_with<'a>(&'a self, t: f32, differences: &'a RealSpectrum<f32>, u: f32) -> impl Filter<f32> + use<'a> {
        self.eigenvalues.map_with(differences, move |k, c| 1.0 / (1.0 + t * k + u * c))
    }

    /// The eigenvalues of the sum of the squared differences of neighbours, 0 to 8, where the image goes on periodically.
    #[must_use]
    pub fn differences(&self) -> RealSpectrum<f32> {
        let stencil = ndarray::arr2(&[[0.0, -1.0, 0.0], [-1.0, 4.0, -1.0], [0.0, -1.0, 0.0]]);
        self.round.kernel(stencil.view()).real(|v| v.max(0.0))
    }

    /// Power of the Fourier components of an image that is padded to twice its size, half of the plane \[u, v\], and the padded size \[m, l\].
    pub(super) fn powers(&self, image: ArrayView2<'_, f32>) -> (Vec<f32>, (usize, usize)) {
        (self.wide.kernel(image).powers(), self.wide.padded())
    }

    /// Mean over the spectrum of 1 / (1 + t k + u c), with the differences c.
    #[must_use]
    pub fn mean_damping_with(&self, t: f64, differences: &RealSpectrum<f32>, u: f64) -> f64 {
        let values = self.eigenvalues.values();
        let pairs = values.iter().zip(differences.values());
        let sum: f64 = pairs.map(|(k, c)| 1.0 / (1.0 + t * f64::from(*k) + u * f64::from(*c))).sum();
        sum / values.len().max(1) as f64
    }

    /// Apply an operator of [`BeamHessian::damping`] to an image.
    pub fn filter(&self, v: &mut Array2<f32>, operator: &impl Filter<f32>) {
        self.round.convolve_in_place(v, operator);
    }

    /// Mean over the spectrum of 1 / (1 + t k). This is the diagonal of the operator.
    #[must_use]
    pub fn mean_damping(&self, t: f64) -> f64 {
        let values = self.eigenvalues.values();
        let sum_of = |part: &[f32]| part.iter().map(|k| 1.0 / (1.0 + t * f64::from(*k))).sum();
        let sums: Vec<f64> = values.par_chunks(1 << 14).map(sum_of).collect();
        let sum: f64 = sums.iter().sum();
        sum / values.len().max(1) as f64
    }
}

/// The circulant nearest to the Toeplitz matrix of a beam of twice the size \[2 m, 2 l\], with its origin in the middle.
fn circulant(beam: &Array2<f32>, (n_m, n_l): (usize, usize), (p_m, p_l): (usize, usize)) -> Array2<f32> {
    // Along an axis of period p, element j is the mean of the beam at j and at j - p, with the weights p - j and j.
    let parts = |k: usize, p: usize, n: usize| -> [(f32, Option<usize>); 2] {
        let j = (k + p - p / 2) % p;
        let place = |d: isize| usize::try_from(d + n as isize).ok().filter(|i| *i < 2 * n);
        let share = j as f32 / p as f32;
        [(1.0 - share, place(j as isize)), (share, place(j as isize - p as isize))]
    };
    let mut out = Array2::zeros((p_m, p_l));
    Zip::indexed(&mut out).par_for_each(|(i, j), o| {
        let mut sum = 0.0;
        for (a, row) in parts(i, p_m, n_m) {
            for (b, column) in parts(j, p_l, n_l) {
                if let (Some(r), Some(c)) = (row, column) {
                    sum += a * b * beam[(r, c)];
                }
            }
        }
        *o = sum;
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fourier::fixtures::{image_to_vis, vis_to_image};
    use cittert_arrays::SkyFrame;

    fn setup(n_l: usize, n_m: usize) -> (SkyGrid, Vec<f64>, Array2<f64>, Vec<f32>) {
        let grid = SkyGrid::new(n_l, n_m, 4e-3, SkyFrame::Boresight).unwrap();
        let uvw = Array2::from_shape_fn((40, 3), |(r, k)| if k == 2 { 0.0 } else { 0.1 * ((r * 7 + k * 3) as f64).sin() });
        let weights = (0..80).map(|k| 1.0 + (k % 3) as f32).collect();
        (grid, vec![90e9, 92e9], uvw, weights)
    }

    #[test]
    fn it_is_the_transform_there_and_back_on_even_and_odd_grids() {
        for (n_l, n_m) in [(16, 12), (15, 9), (14, 17)] {
            let (grid, freq, uvw, weights) = setup(n_l, n_m);
            let hessian = BeamHessian::of_list(&grid, &freq, uvw.view(), &weights).unwrap();
            let image = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 5 + j * 3) % 7) as f64);
            let opts = GridOptions { epsilon: 1e-9, ..GridOptions::default() };
            let vis = image_to_vis(&grid, image.view(), uvw.view(), &freq, &opts).unwrap();
            let w = Array2::from_shape_fn((40, 2), |(r, c)| f64::from(weights[2 * r + c]));
            let exact = vis_to_image(&grid, uvw.view(), &freq, vis.view(), w.view(), &opts).unwrap() / hessian.diagonal();
            let mut fast = image.mapv(|v| v as f32);
            hessian.apply_to(&mut fast);
            let top = exact.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            assert!(fast.iter().zip(&exact).all(|(a, b)| (f64::from(*a) - b).abs() < 2e-4 * top), "{n_l} {n_m}");
        }
    }

    #[test]
    fn the_damping_is_positive_definite_and_near_the_inverse() {
        let (grid, freq, uvw, weights) = setup(32, 32);
        let hessian = BeamHessian::of_list(&grid, &freq, uvw.view(), &weights).unwrap();
        let v = Array2::from_shape_fn((32, 32), |(i, j)| (((i * 5 + j * 3) % 7) as f32) - 3.0);
        let t = 0.5;
        let mut u = v.clone();
        hessian.filter(&mut u, &hessian.damping(t));
        let dot = |a: &Array2<f32>, b: &Array2<f32>| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
        assert!(dot(&u, &v) > 0.0);
        let mut back = u.clone();
        hessian.apply_to(&mut back);
        let back = &u + &(back * t);
        let left = &back - &v;
        assert!(dot(&left, &left) < 0.1 * dot(&v, &v), "{} of {}", dot(&left, &left), dot(&v, &v));
        assert!(hessian.largest() > hessian.diagonal());
        let mean = hessian.mean_damping(f64::from(t));
        assert!(mean > 0.0 && mean < 1.0 && (hessian.mean_damping(0.0) - 1.0).abs() < 1e-12);
    }
}
