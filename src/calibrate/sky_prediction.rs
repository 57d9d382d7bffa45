//! Visibilities of a model of the sky, an image or sources, on the rows of a set.

use super::model::ModelVisibilities;
use crate::Result;
use crate::progress::{Observer, Silent};
use crate::simulate::{Pedestal, SimulateOptions, Simulator, SkyModel};
use cittert_arrays::quantity::Temperature;
use cittert_arrays::{BrightnessUnit, UvCoverage, VisUnit, VisibilityHeader};
use ndarray::{Array3, s};
use num_complex::Complex;

/// How accurate a prediction is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Error relative to the total flux.
    pub epsilon: f64,
    /// Leave out the w term.
    pub no_w: bool,
}

/// A model of the sky, and the visibilities that a set measures of it.
pub struct SkyPrediction<'a> {
    simulator: Simulator<'a>,
    observer: &'a dyn Observer,
}

impl<'a> SkyPrediction<'a> {
    /// Predict `sky` with the array, channels and unit of `header`. Correlator units are treated as Jy.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub fn new(header: &VisibilityHeader, sky: &'a SkyModel, accuracy: Accuracy, observer: &'a dyn Observer) -> Result<Self> {
        let mut header = header.clone();
        if header.unit == VisUnit::Uncalibrated {
            header.unit = VisUnit::Jy;
        }
        // Images of such a set add the constant back; the visibilities are without it. Sources are no part of the constant.
        let of_image = sky.images.iter().any(|i| i.unit == BrightnessUnit::Kelvin);
        let pedestal = header.pedestal_k.filter(|_| of_image).map_or(Pedestal::None, |t| Pedestal::Kelvin(Temperature(t)));
        let options = SimulateOptions { epsilon: accuracy.epsilon, no_w: accuracy.no_w, pedestal, ..SimulateOptions::default() };
        Ok(Self { simulator: Simulator::new(header, sky, &options, &Silent)?, observer })
    }

    /// Expect about so many visibilities in all, so that a large image takes less memory where they are few.
    #[must_use]
    pub fn expecting(mut self, visibilities: usize) -> Self {
        self.simulator = self.simulator.expecting(visibilities as u64);
        self
    }

    /// Prepare for rows some of which another process predicts, so that each row gets the bits that it has where one process predicts all.
    ///
    /// # Errors
    /// As [`ModelVisibilities::predict`].
    pub fn cover(&mut self, coverage: &UvCoverage) -> Result<()> {
        self.simulator.cover(&placed(coverage.clone()).0, self.observer)
    }

    /// The visibilities of some rows. Rows whose uvw are not finite have no model: they are predicted at the origin and then marked.
    fn of_rows(&mut self, first_row: usize, coverage: UvCoverage) -> Result<Array3<Complex<f32>>> {
        let (rows, lost) = placed(coverage);
        let mut vis = self.simulator.block(rows, first_row as u64, self.observer)?.vis;
        lost.iter().for_each(|r| vis.slice_mut(s![*r, .., ..]).fill(Complex::new(f32::NAN, f32::NAN)));
        Ok(vis)
    }
}

/// The rows of a coverage with those moved to the origin whose uvw are not finite, and which these are.
fn placed(mut rows: UvCoverage) -> (UvCoverage, Vec<usize>) {
    let lost: Vec<usize> = (0..rows.n_rows()).filter(|r| rows.uvw_m.row(*r).iter().any(|x| !x.is_finite())).collect();
    lost.iter().for_each(|r| rows.uvw_m.row_mut(*r).fill(0.0));
    (rows, lost)
}

impl ModelVisibilities for SkyPrediction<'_> {
    fn predict(&mut self, _header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        self.of_rows(first_row, coverage.clone())
    }

    fn predict_runs(&mut self, _header: &VisibilityHeader, runs: &[(usize, &UvCoverage)]) -> Result<Vec<Array3<Complex<f32>>>> {
        let Some(((first_row, first), others)) = runs.split_first() else { return Ok(Vec::new()) };
        // One transform with the extent of all runs, and one way through its tiles.
        let mut all = (*first).clone();
        others.iter().try_for_each(|(_, coverage)| all.append(coverage))?;
        let all = self.of_rows(*first_row, all)?;
        if others.is_empty() {
            return Ok(vec![all]);
        }
        let mut end = 0;
        let of_run = |(_, coverage): &(usize, &UvCoverage)| {
            let from = end;
            end += coverage.n_rows();
            all.slice(s![from..end, .., ..]).to_owned()
        };
        Ok(runs.iter().map(of_run).collect())
    }
}
