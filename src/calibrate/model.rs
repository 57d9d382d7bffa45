//! Model visibilities, against which gains are solved.

use crate::{ChainError, Result};
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, UvCoverage, VisibilityHeader, VisibilitySource};
use ndarray::Array3;
use num_complex::{Complex, Complex64};
use std::f64::consts::TAU;

/// Something that predicts what the array would have measured with perfect antennas.
pub trait ModelVisibilities {
    /// Visibilities of rows `first_row..first_row + coverage.n_rows()` of the set, \[blt, chan, pol\] in the unit of the header.
    ///
    /// # Errors
    /// The model cannot be evaluated there.
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>>;

    /// Visibilities of some rows only: `rows` count within the rows that [`ModelVisibilities::predict`] would predict.
    ///
    /// # Errors
    /// As [`ModelVisibilities::predict`].
    fn predict_some(
        &mut self,
        header: &VisibilityHeader,
        (first_row, coverage): (usize, &UvCoverage),
        rows: &[usize],
    ) -> Result<Array3<Complex<f32>>> {
        Ok(self.predict(header, first_row, coverage)?.select(ndarray::Axis(0), rows))
    }

    /// Visibilities of several runs of rows, each with the index of its first row. A model that need not know these indices may take all together.
    ///
    /// # Errors
    /// As [`ModelVisibilities::predict`].
    fn predict_runs(&mut self, header: &VisibilityHeader, runs: &[(usize, &UvCoverage)]) -> Result<Vec<Array3<Complex<f32>>>> {
        runs.iter().map(|(first_row, coverage)| self.predict(header, *first_row, coverage)).collect()
    }
}

/// True for the correlations in which an unpolarised model is not zero.
pub(crate) fn sees_unpolarized(pol: Polarization) -> bool {
    pol.is_parallel_hand() || pol == Polarization::I
}

/// A point source with a flat spectrum, unpolarised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointModel {
    /// Flux density, in the unit of the visibilities.
    pub flux: f64,
    /// Direction cosine l.
    pub l: f64,
    /// Direction cosine m.
    pub m: f64,
}

impl ModelVisibilities for PointModel {
    fn predict(&mut self, header: &VisibilityHeader, _first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let n2 = 1.0 - self.l * self.l - self.m * self.m;
        if !(self.flux.is_finite() && n2 > 0.0) {
            return Err(ChainError::BadOption {
                option: "point model",
                value: format!("flux {}, l {}, m {}", self.flux, self.l, self.m),
                expected: "a finite flux in front of the array (l^2 + m^2 < 1)".into(),
            });
        }
        // n - 1 without cancellation.
        let w_factor = -(self.l * self.l + self.m * self.m) / (1.0 + n2.sqrt());
        let total: Vec<bool> = header.polarizations.iter().map(|p| sees_unpolarized(*p)).collect();
        let mut vis = Array3::zeros(header.shape(coverage.n_rows()));
        if self.l == 0.0 && self.m == 0.0 {
            for p in (0..total.len()).filter(|p| total[*p]) {
                vis.index_axis_mut(ndarray::Axis(2), p).fill(Complex::new(self.flux as f32, 0.0));
            }
            return Ok(vis);
        }
        for (row, uvw) in coverage.uvw_m.rows().into_iter().enumerate() {
            let path_m = uvw[0] * self.l + uvw[1] * self.m + uvw[2] * w_factor;
            for (c, freq_hz) in header.spectrum.freq_hz().iter().enumerate() {
                let v = Complex64::from_polar(self.flux, TAU * path_m * freq_hz / SPEED_OF_LIGHT_M_S);
                for p in (0..total.len()).filter(|p| total[*p]) {
                    vis[(row, c, p)] = Complex::new(v.re as f32, v.im as f32);
                }
            }
        }
        Ok(vis)
    }
}

/// A second set with the same rows, such as a simulation of the model with the coverage of the data.
pub struct SetModel<'a>(pub &'a mut dyn VisibilitySource);

impl ModelVisibilities for SetModel<'_> {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let block = self.0.read_rows(first_row..first_row + coverage.n_rows())?;
        let expected = header.shape(coverage.n_rows());
        if block.vis.dim() != expected {
            return Err(ChainError::Incompatible(format!(
                "the model has visibilities of shape {:?}, the data {expected:?} [row, channel, polarisation]",
                block.vis.dim()
            )));
        }
        if let Some(row) = (0..coverage.n_rows()).find(|&r| {
            (block.coverage.ant1[r], block.coverage.ant2[r]) != (coverage.ant1[r], coverage.ant2[r])
                || (block.coverage.time_jd[r] - coverage.time_jd[r]).abs() > 1e-8
        }) {
            return Err(ChainError::Incompatible(format!(
                "row {} of the model is another baseline or time than that of the data: make the model on the data's own rows",
                first_row + row
            )));
        }
        Ok(block.vis)
    }
}
