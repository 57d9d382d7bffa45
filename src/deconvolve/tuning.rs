//! The constants that steer CLEAN beyond the usual options.
//!
//! The documentation of each field gives its reason and a limit of its influence: the largest change of the rms error of the restored image when
//! the value is halved or doubled, in per cent of the rms of the true image. `imaging/tuning_tests.rs` measures the change on three scenes
//! (points, a Gaussian, a ring with a point) and two layouts (a spiral and a Y), and fails if it exceeds the limit. For ratios the distance from
//! 1 is halved and doubled; `largest_scale` is doubled up to its maximum of 0.5.

use crate::Result;
use crate::values::need;
use serde::{Deserialize, Serialize};

/// Constants of CLEAN that few users need to change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CleanTuning {
    /// An automatic mask grows only above this factor times the largest side lobe of the brightest residual. The side lobes of a bright source
    /// are above the noise too, but they are not sources. At 1 the noise lifts some side lobes over the level; a large factor delays faint
    /// sources to later major cycles.
    /// Influence: at most 1 per cent.
    pub side_lobe_margin: f64,
    /// The side lobes of a dirty beam begin outside an ellipse with this semi-axis, in units of the FWHM of the main lobe. The first null
    /// of a lobe is near one FWHM from its centre, so that the value lies just beyond it.
    /// Influence: at most 1 per cent.
    pub main_lobe_fwhm: f64,
    /// An automatic mask is widened around each pixel by this fraction of the main lobe. Half of the main lobe covers the pixels that the peak
    /// of a component may fall on because of noise.
    /// Influence: at most 1 per cent.
    pub mask_growth: f64,
    /// The run stops when the peak is larger than this factor times its smallest value after an earlier major cycle. A larger factor
    /// accepts the growth that approximate minor cycles cause, which the next major cycle corrects.
    /// Influence: at most 1 per cent.
    pub major_divergence: f64,
    /// A minor cycle stops when its peak is larger than this factor times its smallest value. Exact components lower the peak; a slow growth
    /// of a tenth comes from sources between the pixels.
    /// Influence: at most 1 per cent.
    pub minor_divergence: f64,
    /// A cycle goes on without the visibilities while its level is above this factor times the error of its residual, which earlier cycles have
    /// measured. At 1 the faintest components of a cycle are as large as the errors; a large factor needs more passes over the data.
    /// Influence: at most 1 per cent.
    pub trust_margin: f64,
    /// Largest number of active pixels of Clark's algorithm. So many fit into the second cache together with the patch of the beam.
    /// Influence: at most 1 per cent.
    pub clark_active: usize,
    /// Half width of the patch of the beam of Clark's algorithm, as a fraction of the longer side of the image. An eighth covers all but the
    /// far side lobes.
    /// Influence: at most 1 per cent.
    pub clark_patch: f64,
    /// Least half width of that patch in pixels, so that a small image has the near side lobes in its patch.
    /// Influence: at most 1 per cent.
    pub clark_patch_least: usize,
    /// Width of the first scale of multiscale CLEAN after points, in main lobes. A scale of one main lobe is hardly different from a point.
    /// Influence: at most 30 per cent.
    pub first_scale: f64,
    /// Ratio of successive scales. With 2 each scale overlaps its neighbours, so that every width is near some scale.
    /// Influence: at most 30 per cent.
    pub scale_ratio: f64,
    /// Largest scale as a fraction of the shorter side of the image. The kernel of a wider scale does not fit into the image.
    /// Influence: at most 40 per cent.
    pub largest_scale: f64,
    /// Fraction of the power of a scale of multiscale CLEAN that the baselines must measure. With less than a half, what a component adds at
    /// baselines that nobody measured is larger than what it explains.
    /// Influence: at most 30 per cent.
    pub least_measured: f64,
    /// The hole in the middle of the u-v plane ends where the mean weight in a ring is this fraction of that of the ring with the most.
    /// Influence: at most 1 per cent.
    pub hole_edge: f64,
    /// A scale of multiscale CLEAN takes components until its peak is down to this fraction; then the scales are compared again. A
    /// small fraction lets one scale take the flux of another.
    /// Influence: at most 25 per cent.
    pub hand_over: f64,
}

impl Default for CleanTuning {
    fn default() -> Self {
        Self {
            side_lobe_margin: 1.2,
            main_lobe_fwhm: 1.095_445_115_010_332_2, // sqrt(1.2)
            mask_growth: 0.5,
            major_divergence: 1.5,
            minor_divergence: 1.1,
            trust_margin: 4.0,
            clark_active: 20_000,
            clark_patch: 0.125,
            clark_patch_least: 48,
            first_scale: 2.0,
            scale_ratio: 2.0,
            largest_scale: 0.43,
            least_measured: 0.5,
            hole_edge: 0.25,
            hand_over: 0.75,
        }
    }
}

impl CleanTuning {
    /// Check the ranges.
    ///
    /// # Errors
    /// A value is outside its range; the message names the field and the range.
    pub fn check(&self) -> Result<()> {
        for (name, v) in [
            ("side_lobe_margin", self.side_lobe_margin),
            ("main_lobe_fwhm", self.main_lobe_fwhm),
            ("mask_growth", self.mask_growth),
            ("trust_margin", self.trust_margin),
            ("clark_patch", self.clark_patch),
            ("first_scale", self.first_scale),
        ] {
            need(name, v, v > 0.0 && v.is_finite(), "a positive number")?;
        }
        let ratios =
            [("major_divergence", self.major_divergence), ("minor_divergence", self.minor_divergence), ("scale_ratio", self.scale_ratio)];
        for (name, v) in ratios {
            need(name, v, v > 1.0 && v.is_finite(), "a number above 1")?;
        }
        need("largest_scale", self.largest_scale, self.largest_scale > 0.0 && self.largest_scale <= 0.5, "above 0, at most 0.5")?;
        need("hand_over", self.hand_over, self.hand_over > 0.0 && self.hand_over < 1.0, "above 0, below 1")?;
        for (name, v) in [("least_measured", self.least_measured), ("hole_edge", self.hole_edge)] {
            need(name, v, (0.0..1.0).contains(&v), "0 to below 1")?;
        }
        need("clark_active", self.clark_active, self.clark_active > 0, "at least 1")
    }
}
