//! A mask that CLEAN makes from the residual and extends in every major cycle.

use crate::deconvolve::CleanTuning;
use ndarray::{Array2, Zip, s};

/// Where components are allowed \[m, l\]; it starts empty.
pub(super) struct AutoMask {
    pub(super) mask: Array2<bool>,
    /// The mask grows only above this multiple of the noise.
    pub(super) sigmas: f64,
    /// Half width in pixels that is added around each pixel.
    reach: usize,
    negative: bool,
}

impl AutoMask {
    /// An empty mask. `beam_px` is the FWHM of the main lobe in pixels.
    pub(super) fn new(shape: (usize, usize), sigmas: f64, beam_px: f64, negative: bool, tuning: &CleanTuning) -> Self {
        let reach = (tuning.mask_growth * beam_px).ceil().max(1.0) as usize;
        Self { mask: Array2::from_elem(shape, false), sigmas, reach, negative }
    }

    /// Add the pixels of the residual that are above the level, with the pixels around them. Pixels outside `fixed` stay out.
    pub(super) fn grow(&mut self, residual: &Array2<f32>, level: f64, fixed: Option<&Array2<bool>>) {
        let (n_m, n_l) = residual.dim();
        for ((i, j), v) in residual.indexed_iter() {
            let v = f64::from(*v);
            let above = if self.negative { v.abs() > level } else { v > level };
            if above {
                let rows = i.saturating_sub(self.reach)..(i + self.reach + 1).min(n_m);
                let columns = j.saturating_sub(self.reach)..(j + self.reach + 1).min(n_l);
                self.mask.slice_mut(s![rows, columns]).fill(true);
            }
        }
        if let Some(fixed) = fixed {
            Zip::from(&mut self.mask).and(fixed).for_each(|m, f| *m &= *f);
        }
    }
}
