//! The structure of a granular medium: the spectrum of its density fluctuations.

use crate::surfaces::error::{SurfaceError, bounded};
use std::f64::consts::PI;

/// How the grains of a medium are arranged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Microstructure {
    /// An exponential autocorrelation.
    Exponential {
        /// Correlation length, m.
        length_m: f64,
    },
    /// Spheres that cannot overlap and stick to each other.
    StickySpheres {
        /// Radius, m.
        radius_m: f64,
        /// Stickiness; the smaller, the more they stick. Infinite for spheres that do not stick.
        stickiness: f64,
    },
}

impl Microstructure {
    /// Checks the sizes for a volume fraction of grains.
    ///
    /// # Errors
    /// [`SurfaceError::Value`]; [`SurfaceError::Refused`] for a stickiness that is too small for the fraction.
    pub fn check(&self, fraction: f64) -> Result<(), SurfaceError> {
        match *self {
            Self::Exponential { length_m } => bounded("correlation length in m", length_m, 1e-7, 0.1).map(|_| ()),
            Self::StickySpheres { radius_m, stickiness } => {
                bounded("radius of the spheres in m", radius_m, 1e-7, 0.1)?;
                bridges(fraction, stickiness).map(|_| ())
            }
        }
    }

    /// The Fourier transform of the autocorrelation of the indicator of the grains, m^3, at a wavenumber in 1/m.
    ///
    /// # Reference
    /// Exponential: Maetzler 1998, J. Appl. Phys. 83, 6111. Spheres: Percus & Yevick with the adhesion of Baxter 1968, in the form of Tsang
    /// & Kong 2001, eqs. 8.4.19-22, and Loewe & Picard 2015, The Cryosphere 9, 2101, eqs. 25-33.
    pub(super) fn spectrum(&self, fraction: f64, wavenumber: f64) -> f64 {
        match *self {
            Self::Exponential { length_m } => {
                let x = (wavenumber * length_m).powi(2);
                fraction * (1.0 - fraction) * 8.0 * PI * length_m.powi(3) / (1.0 + x).powi(2)
            }
            Self::StickySpheres { radius_m, stickiness } => {
                let t = bridges(fraction, stickiness).unwrap_or(0.0);
                let x = wavenumber * radius_m;
                let form = sphere_form(x);
                let shell = if x < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x };
                let crowd = fraction / (1.0 - fraction);
                let a = crowd * ((1.0 - t * fraction + 3.0 * crowd) * form + (3.0 - t * (1.0 - fraction)) * shell) + x.cos();
                let b = crowd * x * form + x.sin();
                fraction * 4.0 / 3.0 * PI * radius_m.powi(3) * form * form / (a * a + b * b)
            }
        }
    }
}

/// Amplitude of a sphere, 1 at `x` = 0: `3 (sin x - x cos x)/x^3`.
fn sphere_form(x: f64) -> f64 {
    // The two terms cancel at small x: their difference loses 3 digits at 0.03, where two terms of the series have 9.
    if x < 0.03 { 1.0 - x * x / 10.0 + x.powi(4) / 280.0 } else { 3.0 * (x.sin() - x * x.cos()) / x.powi(3) }
}

/// The number `t` of Baxter for a volume fraction and a stickiness.
///
/// # Reference
/// Tsang & Kong 2001, eq. 8.4.22: the smaller root of `f/12 t^2 - (tau + f/(1-f)) t + (1 + f/2)/(1-f)^2 = 0`.
pub(super) fn bridges(fraction: f64, stickiness: f64) -> Result<f64, SurfaceError> {
    if stickiness == f64::INFINITY || fraction == 0.0 {
        return Ok(0.0);
    }
    let empty = 1.0 - fraction;
    let (a, b, c) = (fraction / 12.0, stickiness + fraction / empty, (1.0 + 0.5 * fraction) / (empty * empty));
    let inside = b * b - 4.0 * a * c;
    // The root without cancellation.
    let t = 2.0 * c / (b + inside.max(0.0).sqrt());
    if stickiness > 0.0 && inside >= 0.0 && t * fraction * empty <= 1.0 + 2.0 * fraction {
        return Ok(t);
    }
    let least = (14.0 * fraction * fraction - 4.0 * fraction - 1.0) / (12.0 * (2.0 * fraction * fraction - fraction - 1.0));
    Err(SurfaceError::Refused(format!(
        "stickiness {stickiness} is too small for a volume fraction of {fraction:.3}; it must be above {:.3}",
        least.max(0.0)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of the spectrum over all wavenumbers is the variance `f (1 - f)` of the indicator.
    fn variance(m: &Microstructure, fraction: f64, size_m: f64) -> f64 {
        let (steps, step) = (400_000, 2e-3 / size_m);
        (1..steps).map(|k| f64::from(k) * step).map(|k| k * k * m.spectrum(fraction, k) * step).sum::<f64>() / (2.0 * PI * PI)
    }

    #[test]
    fn fluctuations_have_the_variance_of_the_mixture() {
        for (f, size) in [(0.1, 1e-4), (0.3, 2e-4)] {
            let exponential = Microstructure::Exponential { length_m: size };
            assert!((variance(&exponential, f, size) / (f * (1.0 - f)) - 1.0).abs() < 2e-3);
            for stickiness in [0.2, 1.0, f64::INFINITY] {
                let spheres = Microstructure::StickySpheres { radius_m: size, stickiness };
                // The Percus-Yevick spectrum of hard spheres keeps the exclusion of other centres, so its variance is exact.
                // The tail falls as 1/k^4, and a share of 1/800 lies beyond the last wavenumber.
                let ratio = variance(&spheres, f, size) / (f * (1.0 - f));
                assert!((ratio - 1.0).abs() < 5e-3, "{f} {stickiness}: {ratio}");
            }
        }
    }

    #[test]
    fn few_spheres_scatter_as_one() {
        let spheres = Microstructure::StickySpheres { radius_m: 1e-4, stickiness: f64::INFINITY };
        let volume = 4.0 / 3.0 * PI * 1e-12;
        assert!((spheres.spectrum(1e-6, 0.0) / (1e-6 * volume) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn spheres_that_stick_too_much_are_refused() {
        let message = bridges(0.3, 0.01).unwrap_err().to_string();
        assert!(message.contains("0.01") && message.contains("must be above 0.0"), "{message}");
        assert!(bridges(0.3, 0.2).is_ok());
    }
}
