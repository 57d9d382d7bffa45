//! Chi squared of visibilities in memory: one transform to visibilities, the term, one transform back.

use super::data_term::DataTerm;
use crate::fourier::{GridOptions, Pair};
use crate::imaging::{ImageMisfit, summed};
use crate::misfit::VisibilityTerm;
use crate::{ChainError, Result, ensure};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, CowArray, Ix2};
use num_complex::Complex64;

/// The transforms in the precision that the error allows.
enum Transforms {
    Single(Pair<f32>),
    Double(Pair<f64>),
}

/// A term of chi squared over a list of visibilities.
pub(super) struct Listed {
    transforms: Transforms,
    term: Box<dyn VisibilityTerm>,
    model: Vec<Complex64>,
    slope: Vec<Complex64>,
}

impl Listed {
    /// For rows with these channels in Hz and uvw in m \[row, 3\], and a term over row x channel.
    pub(super) fn new(
        grid: &SkyGrid,
        (freq_hz, uvw_m): (&[f64], ArrayView2<'_, f64>),
        options: &GridOptions,
        term: Box<dyn VisibilityTerm>,
    ) -> Result<Self> {
        let ranks = term.ranks();
        let transforms = if options.single_precision_suffices() {
            Transforms::Single(Pair::shared(grid, (freq_hz, uvw_m), options, &*ranks)?)
        } else {
            Transforms::Double(Pair::shared(grid, (freq_hz, uvw_m), options, &*ranks)?)
        };
        let zeros = vec![Complex64::default(); uvw_m.nrows() * freq_hz.len()];
        Ok(Self { transforms, term, model: zeros.clone(), slope: zeros })
    }

    /// The adjoint transform of the gradient with respect to the visibilities.
    fn transpose(&mut self) -> Result<Array2<f64>> {
        let ranks = self.term.ranks();
        let mut top = [self.slope.iter().map(|v| v.re.abs().max(v.im.abs())).fold(0.0, f64::max)];
        ranks.largest(&mut top);
        let [top] = top;
        ensure!(top.is_finite(), ChainError::NoData("chi squared has no finite gradient: the weights are too large for the data".into()));
        let scale = if top > 0.0 { 1.0 / top } else { 1.0 };
        let mut image = match &mut self.transforms {
            Transforms::Single(p) => p.adjoint(&self.slope, scale)?,
            Transforms::Double(p) => p.adjoint(&self.slope, scale)?,
        };
        summed(&*ranks, &mut image);
        image.par_mapv_inplace(|v| v * (1.0 / scale));
        Ok(image)
    }
}

impl DataTerm for Listed {
    fn data(&self) -> f64 {
        self.term.data() as f64
    }

    fn misfit(&mut self, image: CowArray<'_, f64, Ix2>) -> Result<ImageMisfit> {
        self.predict(image.view())?;
        drop(image);
        self.slope.fill(Complex64::default());
        let chi2 = self.term.add(&self.model, 1.0, &mut self.slope);
        Ok(ImageMisfit { chi2, gradient: self.transpose()? })
    }

    fn predict(&mut self, image: ArrayView2<'_, f64>) -> Result<&[Complex64]> {
        match &mut self.transforms {
            Transforms::Single(p) => p.predict(image, &mut self.model)?,
            Transforms::Double(p) => p.predict(image, &mut self.model)?,
        }
        Ok(&self.model)
    }
}
