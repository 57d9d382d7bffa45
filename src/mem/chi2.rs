//! Chi squared of an image: one transform to visibilities, the term, one transform back.

use crate::fourier::{GridOptions, Pair};
use crate::misfit::VisibilityTerm;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayError, SkyGrid};
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;
use std::time::Instant;

/// The transforms in the precision that the error allows.
enum Transforms {
    Single(Pair<f32>),
    Double(Pair<f64>),
}

/// A term of chi squared over the visibilities of one image.
pub struct ChiSquared {
    grid: SkyGrid,
    transforms: Transforms,
    term: Box<dyn VisibilityTerm>,
    model: Vec<Complex64>,
    slope: Vec<Complex64>,
    evaluations: usize,
    seconds: f64,
}

/// Chi squared with its gradient.
#[derive(Debug, Clone)]
pub struct Misfit {
    /// Its value.
    pub chi2: f64,
    /// d chi2 / d I for each pixel \[m, l\], 1 / flux.
    pub gradient: Array2<f64>,
}

impl std::fmt::Debug for ChiSquared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChiSquared").field("term", &self.term.name()).field("evaluations", &self.evaluations).finish_non_exhaustive()
    }
}

impl ChiSquared {
    /// For rows with these uvw in m \[row, 3\] and channels, and a term over row x channel.
    ///
    /// # Errors
    /// The term holds no datum; see also [`Pair::new`].
    pub fn new(
        grid: &SkyGrid,
        freq_hz: &[f64],
        uvw_m: ArrayView2<'_, f64>,
        options: &GridOptions,
        term: Box<dyn VisibilityTerm>,
    ) -> Result<Self> {
        ensure!(term.data() > 0, ChainError::NoData("no term holds any datum: nothing constrains the image".into()));
        let transforms = if options.single_precision_suffices() {
            Transforms::Single(Pair::new(grid, freq_hz, uvw_m, options)?)
        } else {
            Transforms::Double(Pair::new(grid, freq_hz, uvw_m, options)?)
        };
        let n = uvw_m.nrows() * freq_hz.len();
        let zeros = vec![Complex64::default(); n];
        Ok(Self { grid: grid.clone(), transforms, term, model: zeros.clone(), slope: zeros, evaluations: 0, seconds: 0.0 })
    }

    /// Where the pixels are.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// The expected value: the number of real data.
    #[must_use]
    pub fn expected(&self) -> f64 {
        self.term.data() as f64
    }

    /// Evaluations so far, each a pair of transforms, and the seconds they took.
    #[must_use]
    pub fn cost(&self) -> (usize, f64) {
        (self.evaluations, self.seconds)
    }

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux per pixel.
    ///
    /// # Errors
    /// An image of another size.
    pub fn predict(&mut self, image: ArrayView2<'_, f64>) -> Result<&[Complex64]> {
        match &mut self.transforms {
            Transforms::Single(p) => p.predict(image, &mut self.model)?,
            Transforms::Double(p) => p.predict(image, &mut self.model)?,
        }
        Ok(&self.model)
    }

    /// Chi squared and its gradient for an image \[m, l\] in flux per pixel.
    ///
    /// # Errors
    /// An image of another size or with values that are not finite.
    pub fn evaluate(&mut self, image: ArrayView2<'_, f64>) -> Result<Misfit> {
        if let Some(((row, column), v)) = image.indexed_iter().find(|(_, v)| !v.is_finite()) {
            let what = format!("pixel (column {column}, row {row}) of the image");
            return Err(ArrayError::BadValue { what, value: v.to_string(), expected: "a finite number" }.into());
        }
        let start = Instant::now();
        self.predict(image)?;
        self.slope.fill(Complex64::default());
        let chi2 = self.term.add(&self.model, 1.0, &mut self.slope);
        let gradient = self.transpose()?;
        self.evaluations += 1;
        self.seconds += start.elapsed().as_secs_f64();
        Ok(Misfit { chi2, gradient })
    }

    /// The adjoint transform of the gradient with respect to the visibilities.
    fn transpose(&mut self) -> Result<Array2<f64>> {
        let top = self.slope.iter().map(|v| v.re.abs().max(v.im.abs())).fold(0.0, f64::max);
        ensure!(top.is_finite(), ChainError::NoData("chi squared has no finite gradient: the weights are too large for the data".into()));
        let scale = if top > 0.0 { 1.0 / top } else { 1.0 };
        let image = match &mut self.transforms {
            Transforms::Single(p) => p.adjoint(&self.slope, scale)?,
            Transforms::Double(p) => p.adjoint(&self.slope, scale)?,
        };
        Ok(image * (1.0 / scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::misfit::Visibilities;
    use cittert_arrays::SkyFrame;
    use num_complex::Complex32;

    #[test]
    fn the_gradient_agrees_with_finite_differences_through_the_transforms() {
        let grid = SkyGrid::new(10, 8, 4e-3, SkyFrame::Boresight).unwrap();
        let freq = [90e9, 91e9, 92e9];
        let uvw = Array2::from_shape_fn((20, 3), |(r, k)| [0.1, 0.12, 0.02][k] * ((r * 7 + k * 3) as f64).sin());
        let vis: Vec<Complex32> = (0..60).map(|k| Complex32::from_polar(1.0, k as f32)).collect();
        let weight: Vec<f32> = (0..60).map(|k| (k % 5) as f32).collect();
        let term = Visibilities::new(vis, weight).unwrap();
        let opts = GridOptions { epsilon: 1e-12, ..GridOptions::default() };
        let mut chi2 = ChiSquared::new(&grid, &freq, uvw.view(), &opts, Box::new(term)).unwrap();
        assert_eq!(chi2.expected(), 96.0);
        let image = Array2::from_shape_fn((8, 10), |(i, j)| 0.1 * ((i * 3 + j) % 7) as f64);
        let slope = chi2.evaluate(image.view()).unwrap().gradient;
        let top = slope.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
        for at in [(0, 0), (3, 4), (7, 9), (5, 1)] {
            let mut moved = |x: f64| {
                let mut m = image.clone();
                m[at] += x;
                chi2.evaluate(m.view()).unwrap().chi2
            };
            let numeric = (moved(1e-3) - moved(-1e-3)) / 2e-3;
            assert!((numeric - slope[at]).abs() < 1e-8 * top, "{at:?}: {numeric} {}", slope[at]);
        }
        assert_eq!(chi2.cost().0, 9);
    }

    #[test]
    fn an_image_that_is_not_finite_is_refused() {
        let grid = SkyGrid::new(4, 4, 1e-3, SkyFrame::Boresight).unwrap();
        let term = Visibilities::new(vec![Complex32::default()], vec![1.0]).unwrap();
        let mut chi2 = ChiSquared::new(&grid, &[1e11], Array2::zeros((1, 3)).view(), &GridOptions::default(), Box::new(term)).unwrap();
        assert!(chi2.evaluate(Array2::from_elem((4, 4), f64::NAN).view()).is_err());
    }
}
