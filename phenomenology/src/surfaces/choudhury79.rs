//! Reflectivity damped by small-scale roughness: Choudhury, and Wang and Choudhury (Q/H).

use super::error::{SurfaceError, bounded};
use super::fresnel::Reflection;

/// Parameters of the Q/H model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QhRoughness {
    /// Polarisation mixing, 0 to 1.
    pub q: f64,
    /// Roughness height, 0 or more.
    pub h: f64,
    /// Power of the cosine.
    pub n: f64,
}

impl QhRoughness {
    /// Checked parameters.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] if Q is outside 0 to 1, H negative or N outside -4 to 4.
    pub fn new(q: f64, h: f64, n: f64) -> Result<Self, SurfaceError> {
        Ok(Self {
            q: bounded("Q of the roughness", q, 0.0, 1.0)?,
            h: bounded("H of the roughness", h, 0.0, 1e3)?,
            n: bounded("N of the roughness", n, -4.0, 4.0)?,
        })
    }

    /// The parameters of Choudhury 1979: Q = 0, H = (2 k s)^2, N = 2, with the free-space
    /// wavenumber `k` in rad/m and the rms height `s` in m.
    ///
    /// # Reference
    /// Choudhury et al. 1979, J. Geophys. Res. 84, 5699: `R exp(-4 k^2 s^2 cos^2)`.
    #[must_use]
    pub fn choudhury79(k0_rad_m: f64, rms_height_m: f64) -> Self {
        let h = 2.0 * k0_rad_m * rms_height_m;
        Self { q: 0.0, h: h * h, n: 2.0 }
    }

    /// The reflection of the rough surface from that of the smooth one.
    ///
    /// # Reference
    /// Wang & Choudhury 1981, J. Geophys. Res. 86, 5277:
    /// `R_p' = ((1-Q) R_p + Q R_q) exp(-H cos^N)`.
    #[must_use]
    pub fn apply(&self, smooth: &Reflection, cos_theta: f64) -> Reflection {
        let damping = (-self.h * cos_theta.powf(self.n)).exp();
        let [h, v] = self.mix(smooth.powers());
        let rough = smooth.with_powers(h * damping, v * damping);
        // Only the part that is not mixed keeps its phase relation.
        Reflection { cross: smooth.cross * ((1.0 - self.q) * damping), ..rough }
    }

    /// Mix a pair `[h, v]`.
    #[must_use]
    pub(super) fn mix(&self, pair: [f64; 2]) -> [f64; 2] {
        let [h, v] = pair;
        [(1.0 - self.q) * h + self.q * v, (1.0 - self.q) * v + self.q * h]
    }
}
