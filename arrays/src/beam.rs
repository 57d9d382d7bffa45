//! The restoring beam.

use serde::{Deserialize, Serialize};

/// An elliptical Gaussian by its full widths at half maximum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestoringBeam {
    /// Major axis FWHM, rad.
    pub bmaj_rad: f64,
    /// Minor axis FWHM, rad.
    pub bmin_rad: f64,
    /// Position angle of the major axis, rad: from +m (north) towards +l (east).
    pub bpa_rad: f64,
}

impl RestoringBeam {
    /// Solid angle of the Gaussian, sr: pi bmaj bmin / (4 ln 2).
    #[must_use]
    pub fn solid_angle_sr(&self) -> f64 {
        std::f64::consts::PI * self.bmaj_rad * self.bmin_rad / (4.0 * std::f64::consts::LN_2)
    }
}
