//! How far a residual may be trusted that was made with one beam for the whole image, without the visibilities.
//!
//! A minor cycle subtracts the beam of the image centre, cut off at the size of the image, wherever a component lies. The true beam of a component
//! differs: the w term changes its far side lobes with the distance from the centre, and beyond half an image from the component the cut one has
//! none. The error is linear in the model, and neither the noise nor the gain changes it. Far side lobes of sources at different places have
//! unrelated signs, so that the errors of sources add in quadrature:
//!
//! `largest |error| = ratio * sqrt(sum over main lobes of (flux in the lobe)^2)`
//!
//! The ratio is measured whenever an exact residual replaces an approximate one. The next cycle then goes down, without visibilities, as far as
//! its level stays a margin above the error of its own components. What an exact residual corrects is measured again, and the largest ratio counts.
//! It is never below the side lobes at the edge of the beam: those beyond are about as high, and sources at the centre do not show them.
//!
//! # Reference
//! Schwab 1984, AJ 89, 1076, who goes back to the visibilities when the error of the beam could matter; the bound there is not measured.

use crate::deconvolve::{CleanTuning, Component, Deconvolver, largest_where};
use ndarray::{Array2, ArrayView2, Axis, s};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Of so many rows of an image one is compared.
const STEP: usize = 8;
/// Where the outer part of a beam begins, as a fraction of the way from its centre to its edge.
const OUTER: f64 = 0.75;

/// The error of approximate residuals, as far as it is known.
pub(super) struct Trust {
    margin: f64,
    /// Width of a main lobe in pixels.
    lobe: usize,
    /// Largest |beam| near the edge of its array.
    edge: f64,
    /// Largest ratio that was measured.
    ratio: Option<f64>,
    /// Every `STEP`th row of the approximate residual, and the norm of its model, until the exact residual is there.
    expected: Option<(Array2<f32>, f64)>,
}

impl Trust {
    pub(super) fn new(psf: ArrayView2<'_, f32>, beam_px: f64, tuning: &CleanTuning) -> Self {
        let (n_m, n_l) = psf.dim();
        let far = |at: usize, n: usize| at.abs_diff(n / 2) as f64 >= OUTER * (n / 2) as f64;
        let edge = largest_where(psf, |(i, j)| far(i, n_m) || far(j, n_l)).into();
        Self { margin: tuning.trust_margin, lobe: (beam_px.round() as usize).max(1), edge, ratio: None, expected: None }
    }

    /// The lowest level of a cycle with these components. `None` as long as the error is not known.
    pub(super) fn level(&self, norm: f64) -> Option<f64> {
        self.ratio.map(|ratio| self.margin * ratio.max(self.edge) * norm)
    }

    /// Root of the sum of the squared fluxes in each main lobe, for components since the last exact residual.
    pub(super) fn norm(&self, deconvolver: &dyn Deconvolver, components: &[Component], shape: (usize, usize)) -> f64 {
        let lobe = self.lobe;
        if components.iter().all(|c| c.scale_px == 0.0) {
            let mut sums = BTreeMap::<(usize, usize), f64>::new();
            components.iter().for_each(|c| *sums.entry((c.row / lobe, c.column / lobe)).or_default() += c.flux);
            return sums.values().map(|flux| flux * flux).sum::<f64>().sqrt();
        }
        let mut model = Array2::zeros(shape);
        deconvolver.draw(components, &mut model);
        let of_lobes = |rows: ArrayView2<'_, f64>| rows.axis_chunks_iter(Axis(1), lobe).map(|square| square.sum().powi(2)).sum::<f64>();
        let sums: Vec<f64> = model.axis_chunks_iter(Axis(0), lobe).into_par_iter().map(of_lobes).collect();
        sums.iter().sum::<f64>().sqrt()
    }

    /// Keep what the exact residual will be compared with.
    pub(super) fn expect(&mut self, approximate: &Array2<f32>, norm: f64) {
        self.expected = (norm > 0.0).then(|| (approximate.slice(s![STEP / 2..;STEP, ..]).to_owned(), norm));
    }

    /// Compare the exact residual with the approximate one that it replaces.
    pub(super) fn measure(&mut self, exact: &Array2<f32>) {
        let Some((approximate, norm)) = self.expected.take() else { return };
        let exact = exact.slice(s![STEP / 2..;STEP, ..]);
        let error = approximate.iter().zip(&exact).fold(0.0_f32, |a, (x, y)| a.max((x - y).abs()));
        let ratio = f64::from(error) / norm;
        self.ratio = Some(self.ratio.map_or(ratio, |before| before.max(ratio)));
    }
}
