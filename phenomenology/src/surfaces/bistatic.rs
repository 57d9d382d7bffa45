//! Bistatic scattering coefficient of a surface of Gaussian facets.

use super::error::{SurfaceError, bounded, cos_incidence};
use super::shadowing::{Shadowing, shadow_lambda};
use super::slopes::Slopes;
use super::stack::Stack;
use num_complex::Complex64;
use std::f64::consts::PI;

/// A pair of directions: zenith angles and azimuths of propagation, radians.
///
/// The incident wave comes down along azimuth `incident_azimuth_rad`, the scattered wave goes up
/// along `scattered_azimuth_rad`; equal azimuths are forward scatter, opposite ones back-scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BistaticGeometry {
    /// Angle of incidence.
    pub incident_zenith_rad: f64,
    /// Azimuth along which the incident wave travels.
    pub incident_azimuth_rad: f64,
    /// Angle of scattering.
    pub scattered_zenith_rad: f64,
    /// Azimuth along which the scattered wave travels.
    pub scattered_azimuth_rad: f64,
}

/// Bistatic coefficients; the first letter is the scattered polarisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bistatic {
    /// Scattered v, incident v.
    pub vv: f64,
    /// Scattered v, incident h.
    pub vh: f64,
    /// Scattered h, incident v.
    pub hv: f64,
    /// Scattered h, incident h.
    pub hh: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Difference below which two azimuths count as equal, radians.
const SAME_AZIMUTH_RAD: f64 = 1e-6;

/// The four bistatic coefficients.
///
/// The hemispherical reflectivity is `(1/4 pi) int sum_q gamma_qp dOmega_s`.
///
/// # Errors
/// [`SurfaceError::Angle`] for a zenith angle at or beyond 90 degrees, [`SurfaceError::Azimuth`].
///
/// # Reference
/// Tsang & Kong 2001, Scattering of Electromagnetic Waves III, section 2.1 (stationary phase):
/// `gamma_qp = pi P S12 |f_qp|^2 / (n_z^4 cos_i)`.
pub fn bistatic_coefficient(
    stack: &Stack,
    slopes: &Slopes,
    shadowing: Shadowing,
    geometry: &BistaticGeometry,
) -> Result<Bistatic, SurfaceError> {
    let g = geometry;
    let cos_i = cos_incidence(g.incident_zenith_rad)?;
    let cos_s = cos_incidence(g.scattered_zenith_rad)?;
    for azimuth in [g.incident_azimuth_rad, g.scattered_azimuth_rad] {
        if bounded("azimuth", azimuth, -1e6, 1e6).is_err() {
            return Err(SurfaceError::Azimuth { degrees: azimuth.to_degrees() });
        }
    }
    let (sin_i, sin_s) = (g.incident_zenith_rad.sin(), g.scattered_zenith_rad.sin());
    let (say_i, cay_i) = g.incident_azimuth_rad.sin_cos();
    let (say_s, cay_s) = g.scattered_azimuth_rad.sin_cos();
    let k_i = [sin_i * cay_i, sin_i * say_i, -cos_i];
    let k_s = [sin_s * cay_s, sin_s * say_s, cos_s];
    // Written with the azimuth, z x k needs no division, even for vertical rays.
    let h_i = [-say_i, cay_i, 0.0];
    let h_s = [-say_s, cay_s, 0.0];
    let (v_i, v_s) = (cross(h_i, k_i), cross(h_s, k_s));

    let facet: [f64; 3] = std::array::from_fn(|i| k_s[i] - k_i[i]);
    let size = dot(facet, facet).sqrt();
    let n = facet.map(|x| x / size);
    let (zx, zy) = (-n[0] / n[2], -n[1] / n[2]);
    let (su, sc) = (slopes.along, slopes.across);
    let exponent = (zx / su).powi(2) + (zy / sc).powi(2);
    let density = (-0.5 * exponent).exp() / (2.0 * PI * su * sc);

    let turn = g.scattered_azimuth_rad - (g.incident_azimuth_rad + PI);
    let same = turn.sin().abs() < SAME_AZIMUTH_RAD && turn.cos() > 0.0;
    let lambda_i = shadow_lambda(slopes, g.incident_zenith_rad, g.incident_azimuth_rad + PI);
    let lambda_s = shadow_lambda(slopes, g.scattered_zenith_rad, g.scattered_azimuth_rad);
    let seen = shadowing.bistatic(lambda_i, lambda_s, same);

    let cos_chi = (-dot(k_i, n)).clamp(0.0, 1.0);
    let local = stack.reflection_cos(cos_chi);
    let across = cross(k_i, n);
    let across_size = dot(across, across).sqrt();
    // At normal incidence on the facet any perpendicular direction can be used.
    let t_h = if across_size > 1e-12 { across.map(|x| x / across_size) } else { h_i };
    let (t_vi, t_vs) = (cross(t_h, k_i), cross(t_h, k_s));
    let amplitude =
        |q: [f64; 3], p: [f64; 3]| -> Complex64 { local.r_h * (dot(q, t_h) * dot(p, t_h)) + local.r_v * (dot(q, t_vs) * dot(p, t_vi)) };
    let scale = PI * density * seen / (n[2].powi(4) * cos_i);
    let gamma = |q, p| scale * amplitude(q, p).norm_sqr();
    Ok(Bistatic { vv: gamma(v_s, v_i), vh: gamma(v_s, h_i), hv: gamma(h_s, v_i), hh: gamma(h_s, h_i) })
}
