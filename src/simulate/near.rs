//! Scenes on a surface near the array: the exact visibilities of every pair of antennas.
//!
//! The array is fixed to its boresight, so the visibilities of a pair are those of every integration. They are computed once, and the rows take them.

use super::options::SimulateOptions;
use super::sky::SkyModel;
use crate::Result;
use crate::nearfield::{Pairs, Surface};
use crate::values::need;
use cittert_arrays::UvCoverage;
use ndarray::Array3;
use num_complex::Complex64;

/// Model visibilities of every pair of antennas, in parts.
pub(super) struct Near {
    pub(super) parts: Vec<Part>,
}

/// A part of the scene in some channels of the set, and the products to which it contributes.
pub(super) struct Part {
    pub(super) chans: Vec<usize>,
    /// Means over the sub-channels \[chan\], in the unit of the set.
    pub(super) pairs: Pairs,
    pub(super) terms: Vec<(usize, Complex64)>,
}

impl Near {
    /// Add the visibilities of some rows \[row, chan, pol\].
    pub(super) fn add_to(&self, coverage: &UvCoverage, sum: &mut Array3<Complex64>) {
        for part in &self.parts {
            for row in 0..coverage.n_rows() {
                let (a, b) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
                for (c, chan) in part.chans.iter().enumerate() {
                    let vis = part.pairs.at(c, a, b);
                    part.terms.iter().for_each(|(pol, coefficient)| sum[(row, *chan, *pol)] += vis * coefficient);
                }
            }
        }
    }
}

/// The surface on which a scene lies, by itself or by the options; `None` is the far field.
///
/// # Errors
/// A range that needs a file or a traced scene, which the caller must load into the scene.
pub(super) fn surface_of(sky: &SkyModel, options: &SimulateOptions) -> Result<Option<Surface>> {
    match (&sky.surface, &options.range) {
        (Some(surface), _) => Ok(Some(surface.clone())),
        (None, None) => Ok(None),
        (None, Some(choice)) => {
            let surface = choice.surface()?;
            need(
                "range",
                choice,
                surface.is_some(),
                "a distance such as 10m or sphere:10m: maps of distances must be loaded with the scene",
            )?;
            Ok(surface)
        }
    }
}
