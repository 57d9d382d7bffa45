//! Images divided by the power pattern of the elements that they contain.

use super::PATTERN_LIMIT;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{BrightnessUnit, ElementPattern, Image};
use serde::{Deserialize, Serialize};

/// Whether images are divided by the pattern of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct CorrectionOptions {
    /// Divide the image by the pattern of the elements, which the set must state. The noise then grows outwards.
    #[cfg_attr(feature = "cli", arg(long))]
    pub pbcor: bool,
    /// Pixels where the pattern is below this part of its peak are blank after the division.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CorrectionOptions::default().pbcor_limit))]
    pub pbcor_limit: f64,
}

impl Default for CorrectionOptions {
    fn default() -> Self {
        Self { pbcor: false, pbcor_limit: PATTERN_LIMIT }
    }
}

impl CorrectionOptions {
    /// Check the numbers, and that there is a pattern to divide by.
    ///
    /// # Errors
    /// A limit outside 0 to 1, a limit without a correction, a correction without a pattern.
    pub fn check(&self, pattern: &ElementPattern) -> Result<()> {
        need("pbcor-limit", self.pbcor_limit, (0.0..1.0).contains(&self.pbcor_limit), "a part of the peak from 0 to below 1")?;
        let used = self.pbcor || self.pbcor_limit == Self::default().pbcor_limit;
        need("pbcor-limit", self.pbcor_limit, used, "no limit, or the option pbcor, which alone uses it")?;
        let text = "the set does not say through which pattern its elements saw the scene, so no image can be divided by it: state it in the layout and \
                    simulate with it, or leave pbcor out";
        ensure!(!(self.pbcor && pattern.is_none()), ChainError::Incompatible(text.into()));
        Ok(())
    }

    /// The image divided by the pattern that it contains, at the frequency of each channel. Pixels below the limit are NaN.
    #[must_use]
    pub fn corrected(&self, image: &Image<f32>) -> Image<f32> {
        let mut out = image.clone();
        out.seen_through = std::mem::take(&mut out.pattern);
        for (chan, freq) in image.spectrum.freq_hz().iter().enumerate() {
            let power = image.pattern.plane(&image.grid, *freq);
            for pol in 0..image.polarizations.len() {
                for (at, v) in out.plane_mut(chan, pol).indexed_iter_mut() {
                    *v = if power[at] >= self.pbcor_limit && power[at] > 0.0 { (f64::from(*v) / power[at]) as f32 } else { f32::NAN };
                }
            }
        }
        out
    }
}

/// The pattern that an image contains, on its grid and in its channels.
#[must_use]
pub fn pattern_image(image: &Image<f32>) -> Image<f32> {
    let mut out = image.clone();
    (out.unit, out.pattern, out.pedestal_k) = (BrightnessUnit::One, ElementPattern::None, None);
    out.beams.clear();
    for (chan, freq) in image.spectrum.freq_hz().iter().enumerate() {
        let power = image.pattern.plane(&image.grid, *freq);
        for pol in 0..image.polarizations.len() {
            out.plane_mut(chan, pol).assign(&power.mapv(|v| v as f32));
        }
    }
    out
}
