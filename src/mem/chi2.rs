//! Chi squared of an image, from visibilities in memory or in passes over a set.

use super::data_term::DataTerm;
use super::listed::Listed;
use super::passes::Passes;
use super::response::Response;
use crate::finite::all_finite;
use crate::fourier::GridOptions;
use crate::imaging::{ImageMisfit, Imager};
use crate::misfit::VisibilityTerm;
use crate::progress::Observer;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayError, SkyGrid};
use ndarray::{ArrayView2, CowArray, Ix2};
use num_complex::Complex64;
use std::time::Instant;

/// Chi squared of the visibilities of one image, with its cost so far.
pub struct ChiSquared<'a> {
    grid: SkyGrid,
    term: Box<dyn DataTerm + 'a>,
    response: Response,
    evaluations: usize,
    seconds: f64,
}

impl std::fmt::Debug for ChiSquared<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChiSquared").field("data", &self.term.data()).field("evaluations", &self.evaluations).finish_non_exhaustive()
    }
}

impl<'a> ChiSquared<'a> {
    /// For rows with these uvw in m \[row, 3\] and channels, and a term over row x channel. The visibilities stay in memory.
    ///
    /// # Errors
    /// The term holds no datum; see also [`crate::fourier::Pair::new`].
    pub fn new(
        grid: &SkyGrid,
        freq_hz: &[f64],
        uvw_m: ArrayView2<'_, f64>,
        options: &GridOptions,
        term: Box<dyn VisibilityTerm>,
    ) -> Result<Self> {
        Self::of_term(grid, Box::new(Listed::new(grid, (freq_hz, uvw_m), options, term)?))
    }

    /// For the data of an output channel of an imager whose weights, times `factor`, are 1/sigma^2. Every evaluation is one pass over the
    /// data, so the memory does not depend on their number. `used` is the number of visibilities that count.
    ///
    /// # Errors
    /// No visibility counts.
    pub fn in_passes<'i: 'a, 's: 'i>(
        (imager, channel): (&'i mut Imager<'s>, usize),
        (factor, used): (f64, u64),
        observer: &'i dyn Observer,
    ) -> Result<Self> {
        let grid = imager.grid().clone();
        Self::of_term(&grid, Box::new(Passes::new((imager, channel), (factor, used), observer)))
    }

    fn of_term(grid: &SkyGrid, term: Box<dyn DataTerm + 'a>) -> Result<Self> {
        ensure!(term.data() > 0.0, ChainError::NoData("no term holds any datum: nothing constrains the image".into()));
        Ok(Self { grid: grid.clone(), term, response: Response::default(), evaluations: 0, seconds: 0.0 })
    }

    /// The same for images that the elements see with this response \[m, l\].
    #[must_use]
    pub fn through(mut self, response: Response) -> Self {
        self.response = response;
        self
    }

    /// How the elements see an image.
    #[must_use]
    pub fn response(&self) -> &Response {
        &self.response
    }

    /// Where the pixels are.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// The expected value: the number of real data.
    #[must_use]
    pub fn expected(&self) -> f64 {
        self.term.data()
    }

    /// Evaluations so far, each a pair of transforms, and the seconds they took.
    #[must_use]
    pub fn cost(&self) -> (usize, f64) {
        (self.evaluations, self.seconds)
    }

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux per pixel.
    ///
    /// # Errors
    /// An image of another size; visibilities that are not in memory.
    pub fn predict(&mut self, image: ArrayView2<'_, f64>) -> Result<&[Complex64]> {
        if self.response.is_one() {
            return self.term.predict(image);
        }
        let mut seen = image.to_owned();
        self.response.multiply(&mut seen);
        self.term.predict(seen.view())
    }

    /// Chi squared and its gradient for an image \[m, l\] in flux per pixel.
    ///
    /// # Errors
    /// An image of another size or with values that are not finite.
    pub fn evaluate(&mut self, image: CowArray<'_, f64, Ix2>) -> Result<ImageMisfit> {
        if !all_finite(&image, |v| v)
            && let Some(((row, column), v)) = image.indexed_iter().find(|(_, v)| !v.is_finite())
        {
            let what = format!("pixel (column {column}, row {row}) of the image");
            return Err(ArrayError::BadValue { what, value: v.to_string(), expected: "a finite number" }.into());
        }
        let start = Instant::now();
        let misfit = if self.response.is_one() {
            self.term.misfit(image)?
        } else {
            let mut seen = image.into_owned();
            self.response.multiply(&mut seen);
            let mut misfit = self.term.misfit(seen.into())?;
            self.response.multiply(&mut misfit.gradient);
            misfit
        };
        let finite = misfit.chi2.is_finite() && all_finite(&misfit.gradient, |g| g);
        ensure!(finite, ChainError::NoData("chi squared has no finite gradient: the weights are too large for the data".into()));
        self.evaluations += 1;
        self.seconds += start.elapsed().as_secs_f64();
        Ok(misfit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::misfit::Visibilities;
    use cittert_arrays::SkyFrame;
    use ndarray::Array2;
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
        let slope = chi2.evaluate(image.view().into()).unwrap().gradient;
        let top = slope.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
        for at in [(0, 0), (3, 4), (7, 9), (5, 1)] {
            let mut moved = |x: f64| {
                let mut m = image.clone();
                m[at] += x;
                chi2.evaluate(m.into()).unwrap().chi2
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
        assert!(chi2.evaluate(Array2::from_elem((4, 4), f64::NAN).into()).is_err());
    }
}
