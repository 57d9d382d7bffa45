//! Permittivity, absorption and scattering of granular media.

use super::microstructure::{Microstructure, bridges};
use super::scatterer::{Phase, Scatterer};
use crate::constants::SPEED_OF_LIGHT_M_S;
use crate::dielectrics::mixing::polder_van_santen46;
use crate::surfaces::error::SurfaceError;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// A medium of two materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// Permittivity of the host.
    pub host: Complex64,
    /// Permittivity of the grains, pockets or bubbles.
    pub inclusion: Complex64,
    /// Their volume fraction.
    pub fraction: f64,
    /// Their depolarisation factors.
    pub factors: [f64; 3],
}

/// The effective permittivity of a mixture, and its absorption and scattering by the improved Born approximation.
///
/// # Errors
/// A mixing formula that does not converge, or grains that [`Microstructure::check`] refuses.
///
/// # Reference
/// Maetzler 1998, J. Appl. Phys. 83, 6111, eqs. 16-22: `P = k0^4/(4 pi) |e2 - e1|^2 Y^2 C(2 k sin(Theta/2)) |p.q|^2`, with `k` the wavenumber in
/// the medium, `C` the transform of the autocorrelation and `Y^2` the mean square of the field in a grain over that outside. The effective
/// permittivity is that of Polder & van Santen. Its loss gives the absorption, `2 k0 Im sqrt(e)`, as in SMRT (Picard et al. 2018, Geosci.
/// Model Dev. 11, 2763).
pub fn improved_born_maetzler98(mixture: &Mixture, grains: Microstructure, freq_hz: f64) -> Result<(Complex64, Scatterer), SurfaceError> {
    let Mixture { host, inclusion, fraction, factors } = *mixture;
    grains.check(fraction)?;
    let k0 = TAU * freq_hz / SPEED_OF_LIGHT_M_S;
    let eps = polder_van_santen46(host, inclusion, fraction, factors)?;
    let contrast = inclusion - host;
    let field: f64 = factors
        .iter()
        .map(|&a| {
            let around = eps * (1.0 - a) + host * a;
            (around / (around + contrast * a)).norm_sqr() / 3.0
        })
        .sum();
    let index = eps.sqrt();
    let strength = contrast.norm_sqr() * field * k0.powi(4) / (4.0 * PI);
    let phase = Phase::Granular { strength, wavenumber: k0 * index.re, fraction, grains };
    Ok((eps, Scatterer { absorption_per_m: 2.0 * k0 * index.im.abs(), phase }))
}

/// The effective permittivity of a dense medium of small spheres that stick, and its absorption and scattering, by the quasi-crystalline
/// approximation with coherent potential.
///
/// # Errors
/// [`SurfaceError::Refused`] for spheres that are too large for it or stick too much.
///
/// # Reference
/// Tsang & Kong 2001, section 5.3, in the form of DMRT-ML (Picard et al. 2013, Geosci. Model Dev. 6, 1061, eqs. 1-7). Spheres and their
/// clusters have to be small against the wavelength.
pub fn dense_medium_tsang01(
    mixture: &Mixture,
    radius_m: f64,
    stickiness: f64,
    freq_hz: f64,
) -> Result<(Complex64, Scatterer), SurfaceError> {
    let Mixture { host, inclusion, fraction: f, .. } = *mixture;
    Microstructure::StickySpheres { radius_m, stickiness }.check(f)?;
    let t = bridges(f, stickiness)?;
    let k0 = TAU * freq_hz / SPEED_OF_LIGHT_M_S;
    let contrast = inclusion - host;
    let b = contrast * ((1.0 - 4.0 * f) / 3.0) - host;
    let c = -host * contrast * ((1.0 - f) / 3.0);
    let root = (b * b - c * 4.0).sqrt();
    let plus = (root - b) * 0.5;
    let still = if plus.re < 1.0 { (-root - b) * 0.5 } else { plus };
    let response = contrast / (contrast * (1.0 - f) / (still * 3.0) + 1.0);
    let crowd = (1.0 - f).powi(4) / (1.0 + 2.0 * f - t * f * (1.0 - f)).powi(2);
    let size = 2.0 / 9.0 * (k0 * radius_m).powi(3);
    let eps = host + (still - host) * (Complex64::new(1.0, 0.0) - Complex64::new(0.0, 1.0) * still.sqrt() * response * (size * crowd));
    let extinction = 2.0 * k0 * eps.sqrt().im.abs();
    let scattering = size * f * k0 * response.norm_sqr() * crowd;
    if scattering >= extinction {
        return Err(SurfaceError::Refused(format!(
            "spheres of {radius_m} m are too large for dmrt at {} GHz, where their albedo would be {:.3}; use iba-spheres",
            freq_hz * 1e-9,
            scattering / extinction
        )));
    }
    Ok((eps, Scatterer { absorption_per_m: extinction - scattering, phase: Phase::Rayleigh { scattering_per_m: scattering } }))
}
