//! Rough soil, empirical to 100 GHz: Wegmueller and Maetzler.

use super::error::SurfaceError;
use super::fresnel::Reflection;
use std::f64::consts::PI;

/// Largest angle of the fit, degrees.
const MAX_DEGREES: f64 = 70.0;
/// The same, rad.
pub(super) const WEGMULLER_MAX_RAD: f64 = MAX_DEGREES * PI / 180.0;

/// The reflection of a rough soil from that of the smooth one.
///
/// `ks` is the rms height times the free-space wavenumber. The phases are those of the smooth surface,
/// although a diffuse reflection has no phase.
///
/// # Errors
/// [`SurfaceError::Value`] beyond 70 degrees, where there is no fit.
///
/// # Reference
/// Wegmueller & Maetzler 1999, IEEE Trans. Geosci. Remote Sens. 37, 1391.
pub fn wegmuller_matzler99(smooth: &Reflection, theta_rad: f64, ks: f64) -> Result<Reflection, SurfaceError> {
    let degrees = theta_rad.to_degrees();
    if degrees > MAX_DEGREES + 1e-9 {
        return Err(SurfaceError::Value {
            what: "angle in degrees for the Wegmuller-Matzler roughness",
            value: degrees,
            min: 0.0,
            max: MAX_DEGREES,
        });
    }
    let cos = theta_rad.cos();
    let h = smooth.power_h * (-ks.powf((0.1 * cos).sqrt())).exp();
    let v = if degrees <= 60.0 { h * cos.powf(0.655) } else { h * (0.635 - 0.0014 * (degrees - 60.0)) };
    Ok(smooth.with_powers(h, v))
}
