//! Weights of the visibilities in an image.
//!
//! The density of weights is summed on cells of the u-v plane 1 / (2 n cell) wide, n the side of the image in cells (the cells of an
//! image with twice the field), with all visibilities folded to v >= 0. With W the sum of the cell of a visibility of weight w:
//! natural w; uniform w / W; Briggs w / (1 + W f^2) with f^2 = (5 10^-R)^2 / (sum of W^2 over cells / sum of w).
//! Uniform factors 1 / W are limited to three times their mean over the occupied cells of the 16 x 16 around them, so that a lone
//! visibility in a crowd does not dominate.
//!
//! # Reference
//! Briggs 1995, PhD thesis, New Mexico Tech, ch. 3. Cells, fold and limit are those of WSClean with a padding of 2 (Offringa et al. 2014,
//! MNRAS 444, 606), found from the weights that it stores. CASA counts each visibility at (u, v) and at (-u, -v) on cells of the image
//! itself, without a limit, so its weights differ.

use super::ReducedBlock;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{Axis, Zip};
use rayon::prelude::*;
use std::ops::Range;

/// The density grid is that of an image so many times larger.
const PADDING: f64 = 2.0;
/// Limit of a uniform factor over the mean around it, and half the side of the window of that mean.
const LIMIT: f64 = 3.0;
const WINDOW: usize = 8;

/// Scheme of the weights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Weighting {
    /// By the noise alone: the best signal to noise of a point.
    #[default]
    Natural,
    /// Every occupied cell the same: the sharpest beam.
    Uniform,
    /// Between the two.
    Briggs {
        /// -2 is close to uniform, 2 close to natural.
        robust: f64,
    },
}

/// A scheme with its tapers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightOptions {
    /// Scheme.
    pub weighting: Weighting,
    /// Cells of the density grid are so many times wider than they would be: above 1 is super-uniform.
    pub super_uniform: f64,
    /// Gaussian taper that acts on the image like a smoothing to this FWHM, rad.
    pub taper_rad: Option<f64>,
    /// Gaussian taper of the short baselines that removes structure wider than this FWHM, rad.
    pub inner_taper_rad: Option<f64>,
}

impl Default for WeightOptions {
    fn default() -> Self {
        Self { weighting: Weighting::Natural, super_uniform: 1.0, taper_rad: None, inner_taper_rad: None }
    }
}

impl WeightOptions {
    /// Check the numbers.
    ///
    /// # Errors
    /// A robustness, factor or taper that is not finite or out of range.
    pub fn check(&self) -> Result<()> {
        let bad =
            |option, value: f64, expected: &str| Err(ChainError::BadOption { option, value: value.to_string(), expected: expected.into() });
        if let Weighting::Briggs { robust } = self.weighting
            && !(-5.0..=5.0).contains(&robust)
        {
            return bad("--robust", robust, "a number from -2 (uniform) to 2 (natural)");
        }
        if !(1.0..=1000.0).contains(&self.super_uniform) {
            return bad("--super-uniform", self.super_uniform, "a factor from 1 to 1000");
        }
        for (option, taper) in [("--taper", self.taper_rad), ("--inner-taper", self.inner_taper_rad)] {
            if let Some(t) = taper
                && !(t.is_finite() && t > 0.0)
            {
                return bad(option, t, "a positive angle");
            }
        }
        Ok(())
    }
}

/// Weights of one image.
#[derive(Debug, Clone)]
pub struct ImageWeights {
    options: WeightOptions,
    width: usize,
    height: usize,
    /// Cells a wavelength along u and v.
    scale: (f64, f64),
    /// Sum of weights, later the factor of each cell \[v, u\]; empty with natural weights.
    cells: Vec<f64>,
    sum_of_weights: f64,
}

impl ImageWeights {
    /// An empty density for an image.
    #[must_use]
    pub fn new(grid: &SkyGrid, options: WeightOptions) -> Self {
        let side = |n: usize| ((PADDING * n as f64 / options.super_uniform).round() as usize).max(1);
        let (width, height) = (side(grid.n_l), side(grid.n_m));
        let natural = options.weighting == Weighting::Natural;
        Self {
            options,
            width,
            height,
            scale: (grid.cell_rad * width as f64, grid.cell_rad * height as f64),
            cells: if natural { Vec::new() } else { vec![0.0; width * (height / 2 + 1)] },
            sum_of_weights: 0.0,
        }
    }

    /// True where a pass over the data is needed before the weights are known.
    #[must_use]
    pub fn needs_density(&self) -> bool {
        !self.cells.is_empty()
    }

    /// True where the weights of the image are those of the data.
    #[must_use]
    pub fn are_those_of_the_data(&self) -> bool {
        self.cells.is_empty() && self.options.taper_rad.is_none() && self.options.inner_taper_rad.is_none()
    }

    /// Index of the cell of (u, v) in wavelengths, folded to v >= 0; what lies outside the grid wraps, as it does in the image.
    fn cell(&self, u: f64, v: f64) -> usize {
        let (u, v) = if v < 0.0 { (-u, -v) } else { (u, v) };
        let wrap = |x: f64, n: usize| (x.floor() as i64).rem_euclid(n as i64) as usize;
        // Column width / 2 is u = 0.
        let (mut x, mut y) = (wrap(u * self.scale.0 + (self.width / 2) as f64, self.width), wrap(v * self.scale.1, self.height));
        if y > self.height / 2 {
            (x, y) = (self.width - 1 - x, self.height - 1 - y);
        }
        y * self.width + x
    }

    /// Add the weights of these channels of a block to the density.
    pub fn add(&mut self, block: &ReducedBlock, channels: &Range<usize>, freq_hz: &[f64]) {
        for (uvw, weights) in block.uvw_m.rows().into_iter().zip(block.weight.rows()) {
            let (u, v) = (uvw[0] / SPEED_OF_LIGHT_M_S, uvw[1] / SPEED_OF_LIGHT_M_S);
            for c in channels.clone() {
                let w = f64::from(weights[c]);
                if w > 0.0 {
                    let at = self.cell(u * freq_hz[c], v * freq_hz[c]);
                    self.cells[at] += w;
                    self.sum_of_weights += w;
                }
            }
        }
    }

    /// Turn the density into the factor of each cell.
    pub fn finish(&mut self) {
        match self.options.weighting {
            Weighting::Natural => {}
            Weighting::Uniform => {
                self.cells.iter_mut().filter(|w| **w > 0.0).for_each(|w| *w = 1.0 / *w);
                self.limit();
            }
            Weighting::Briggs { robust } => {
                let squares: f64 = self.cells.iter().map(|w| w * w).sum();
                let f2 = (5.0 * 10f64.powf(-robust)).powi(2) / (squares / self.sum_of_weights);
                self.cells.iter_mut().for_each(|w| *w = 1.0 / (1.0 + *w * f2));
            }
        }
    }

    /// Limit each factor to [`LIMIT`] times the mean of the occupied cells around it.
    fn limit(&mut self) {
        let (width, rows) = (self.width, self.cells.len() / self.width);
        // Sums over all cells above and to the left.
        let mut table = vec![(0.0, 0.0); (width + 1) * (rows + 1)];
        for y in 0..rows {
            let mut line = (0.0, 0.0);
            for x in 0..width {
                let w = self.cells[y * width + x];
                line = (line.0 + w, line.1 + f64::from(u8::from(w > 0.0)));
                let above = table[y * (width + 1) + x + 1];
                table[(y + 1) * (width + 1) + x + 1] = (above.0 + line.0, above.1 + line.1);
            }
        }
        for y in 0..rows {
            for x in 0..width {
                let (x0, x1) = (x.saturating_sub(WINDOW), (x + WINDOW).min(width));
                let (y0, y1) = (y.saturating_sub(WINDOW), (y + WINDOW).min(rows));
                let at = |x: usize, y: usize| table[y * (width + 1) + x];
                let sum = at(x1, y1).0 - at(x0, y1).0 - at(x1, y0).0 + at(x0, y0).0;
                let count = at(x1, y1).1 - at(x0, y1).1 - at(x1, y0).1 + at(x0, y0).1;
                let w = &mut self.cells[y * width + x];
                if *w > 0.0 {
                    *w = w.min(LIMIT * sum / count);
                }
            }
        }
    }

    /// Factor of a visibility at (u, v) wavelengths.
    #[must_use]
    pub fn factor(&self, u: f64, v: f64) -> f64 {
        let density = if self.cells.is_empty() { 1.0 } else { self.cells[self.cell(u, v)] };
        // The transform of a Gaussian of FWHM theta is exp(-(pi theta |u|)^2 / (4 ln 2)).
        let gauss = |theta: f64| (-(std::f64::consts::PI * theta).powi(2) * (u * u + v * v) / (4.0 * std::f64::consts::LN_2)).exp();
        density * self.options.taper_rad.map_or(1.0, gauss) * self.options.inner_taper_rad.map_or(1.0, |t| 1.0 - gauss(t))
    }

    /// Put the weights of the image of these channels into a block.
    pub fn apply(&self, block: &mut ReducedBlock, channels: &Range<usize>, freq_hz: &[f64]) {
        let plain = self.are_those_of_the_data();
        let ReducedBlock { uvw_m, weight, imaging, .. } = block;
        imaging.axis_iter_mut(Axis(0)).into_par_iter().zip(weight.axis_iter(Axis(0))).zip(uvw_m.axis_iter(Axis(0))).for_each(
            |((mut imaging, weight), uvw)| {
                let (u, v) = (uvw[0] / SPEED_OF_LIGHT_M_S, uvw[1] / SPEED_OF_LIGHT_M_S);
                let range = ndarray::s![channels.clone()];
                Zip::from(imaging.slice_mut(range)).and(weight.slice(range)).and(&freq_hz[channels.clone()]).for_each(|i, w, f| {
                    let factor = if plain || *w == 0.0 { 1.0 } else { self.factor(u * f, v * f) };
                    #[allow(clippy::cast_possible_truncation)]
                    let product = (f64::from(*w) * factor) as f32;
                    *i = product;
                });
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;
    use ndarray::{Array2, array};
    use num_complex::Complex32;

    /// Three rows: two in one cell (one of them turned around), one alone.
    fn block() -> ReducedBlock {
        let wavelength = SPEED_OF_LIGHT_M_S / 1e9;
        let weight = array![[1.0_f32], [3.0], [2.0]];
        ReducedBlock {
            first_row: 0,
            uvw_m: array![[100.0, 40.0, 0.0], [-100.2, -40.1, 0.0], [30.0, 0.1, 0.0]] * wavelength,
            vis: Array2::from_elem((3, 1), Complex32::new(1.0, 0.0)),
            imaging: weight.clone(),
            weight,
        }
    }

    fn weigh(options: WeightOptions) -> Vec<f32> {
        let grid = SkyGrid::new(64, 64, 1e-3, SkyFrame::Boresight).unwrap();
        let mut b = block();
        let mut weights = ImageWeights::new(&grid, options);
        if weights.needs_density() {
            weights.add(&b, &(0..1), &[1e9]);
            weights.finish();
        }
        weights.apply(&mut b, &(0..1), &[1e9]);
        b.imaging.iter().copied().collect()
    }

    #[test]
    fn each_scheme_gives_the_weights_of_its_formula() {
        let with = |weighting| WeightOptions { weighting, ..WeightOptions::default() };
        assert_eq!(weigh(with(Weighting::Natural)), [1.0, 3.0, 2.0]);
        assert_eq!(weigh(with(Weighting::Uniform)), [0.25, 0.75, 1.0]);
        // W = 4, 4, 2; sum W^2 = 16 + 4, sum w = 6; f^2 = 25 * 6 / 20 = 7.5
        let briggs = weigh(with(Weighting::Briggs { robust: 0.0 }));
        for (got, expected) in briggs.iter().zip([1.0 / 31.0, 3.0 / 31.0, 2.0 / 16.0]) {
            assert!((got - expected).abs() < 1e-7, "{got} {expected}");
        }
        let wide = weigh(WeightOptions { super_uniform: 64.0, ..with(Weighting::Uniform) });
        assert!((wide.iter().sum::<f32>() - 1.0).abs() < 0.3, "{wide:?}");
    }

    #[test]
    fn tapers_halve_where_they_should() {
        // exp(-(pi theta u)^2 / (4 ln 2)) = 1/2 at u = 2 ln 2 / (pi theta).
        let theta = 2.0 * std::f64::consts::LN_2 / (std::f64::consts::PI * 30.0_f64.hypot(0.1));
        let tapered = weigh(WeightOptions { taper_rad: Some(theta), ..WeightOptions::default() });
        assert!((tapered[2] - 1.0).abs() < 1e-6 && tapered[0] < 1e-3, "{tapered:?}");
        let inner = weigh(WeightOptions { inner_taper_rad: Some(theta), ..WeightOptions::default() });
        assert!((inner[2] - 1.0).abs() < 1e-6 && (inner[0] - 1.0).abs() < 1e-3, "{inner:?}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let robust = |robust| WeightOptions { weighting: Weighting::Briggs { robust }, ..WeightOptions::default() };
        assert!(robust(f64::NAN).check().is_err() && robust(9.0).check().is_err() && robust(0.5).check().is_ok());
        assert!(WeightOptions { taper_rad: Some(-1.0), ..WeightOptions::default() }.check().is_err());
    }
}
