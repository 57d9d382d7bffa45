//! Fresnel reflection at one plane interface.
//!
//! The electric field of `h` is perpendicular to the plane of incidence, and that of `v` lies in it. The sign of `r_v` belongs to the
//! basis `v = h x k`: at normal incidence `r_v = -r_h`, and a perfect conductor has `r_h = -1`, `r_v = +1`.

use super::error::{SurfaceError, cos_incidence};
use super::layer::Layer;
use num_complex::Complex64;

/// Reflection of a surface at one angle of incidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflection {
    /// Amplitude, h.
    pub r_h: Complex64,
    /// Amplitude, v.
    pub r_v: Complex64,
    /// Power reflectivity, h.
    pub power_h: f64,
    /// Power reflectivity, v.
    pub power_v: f64,
    /// Mean of `r_v` times the conjugate of `r_h`, for the third and fourth Stokes parameters.
    pub cross: Complex64,
}

impl Reflection {
    /// Reflection with the given amplitudes, fully coherent.
    #[must_use]
    pub fn from_amplitudes(r_h: Complex64, r_v: Complex64) -> Self {
        Self { r_h, r_v, power_h: r_h.norm_sqr(), power_v: r_v.norm_sqr(), cross: r_v * r_h.conj() }
    }

    /// Power reflectivities `[h, v]`.
    #[must_use]
    pub fn powers(&self) -> [f64; 2] {
        [self.power_h, self.power_v]
    }

    /// Emissivities `[h, v]` of an opaque surface: one minus the reflectivities.
    #[must_use]
    pub fn emissivities(&self) -> [f64; 2] {
        [1.0 - self.power_h, 1.0 - self.power_v]
    }

    /// The same phases with other powers. The cross term is scaled accordingly.
    #[must_use]
    pub fn with_powers(&self, power_h: f64, power_v: f64) -> Self {
        let scale = |from: f64, to: f64| if from > 0.0 { (to / from).sqrt() } else { 0.0 };
        let (h, v) = (scale(self.power_h, power_h), scale(self.power_v, power_v));
        Self { r_h: self.r_h * h, r_v: self.r_v * v, power_h, power_v, cross: self.cross * (h * v) }
    }
}

/// Permittivity of air.
pub(super) const AIR: Complex64 = Complex64::new(1.0, 0.0);

/// Normal wavenumber over that of free space, `sqrt(eps - sin^2)`, decaying into the medium.
#[must_use]
pub(super) fn normal_wavenumber(eps: Complex64, sin2: f64) -> Complex64 {
    let q = (eps - sin2).sqrt();
    // For a negative real argument with a positive zero as imaginary part, the square root is the growing wave.
    if q.im > 0.0 { -q } else { q }
}

/// Permittivity and normal wavenumber of medium `n` of a stack: 0 is the air, `n` is layer `n` from the top.
#[must_use]
#[inline]
pub(super) fn medium(layers: &[Layer], n: usize, cos_theta: f64) -> (Complex64, Complex64) {
    match n {
        0 => (AIR, Complex64::new(cos_theta, 0.0)),
        n => (layers[n - 1].eps, normal_wavenumber(layers[n - 1].eps, 1.0 - cos_theta * cos_theta)),
    }
}

/// Amplitudes `[h, v]` of the interface from medium 1 to medium 2.
#[must_use]
pub(super) fn interface(eps1: Complex64, q1: Complex64, eps2: Complex64, q2: Complex64) -> [Complex64; 2] {
    let (a, b) = (eps2 * q1, eps1 * q2);
    [(q1 - q2) / (q1 + q2), (a - b) / (a + b)]
}

/// Reflection from air at a cosine of incidence, which is not checked.
#[must_use]
pub(super) fn fresnel_cos(eps: Complex64, cos_theta: f64) -> Reflection {
    let q1 = Complex64::new(cos_theta, 0.0);
    let q2 = normal_wavenumber(eps, 1.0 - cos_theta * cos_theta);
    let [r_h, r_v] = interface(AIR, q1, eps, q2);
    Reflection::from_amplitudes(r_h, r_v)
}

/// Reflection of a plane surface in air, angle of incidence in radians.
///
/// # Errors
/// [`SurfaceError::Angle`] outside 0 to below 90 degrees.
///
/// # Reference
/// Born & Wolf, section 1.5: `r_h = (q1-q2)/(q1+q2)`,
/// `r_v = (eps2 q1 - eps1 q2)/(eps2 q1 + eps1 q2)`, `q = sqrt(eps - sin^2)`.
pub fn fresnel(eps: Complex64, theta_rad: f64) -> Result<Reflection, SurfaceError> {
    Ok(fresnel_cos(eps, cos_incidence(theta_rad)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn total_reflection_beyond_the_critical_angle() {
        let inside = |theta: f64| {
            let q1 = Complex64::new(2.0 * theta.cos(), 0.0);
            interface(Complex64::new(4.0, 0.0), q1, AIR, normal_wavenumber(AIR, 4.0 * theta.sin().powi(2))).map(|r| r.norm_sqr())
        };
        let critical = (1.0f64 / 2.0).asin();
        assert!(inside(critical + 0.05).iter().all(|r| (r - 1.0).abs() < 1e-14));
        assert!(inside(critical - 0.05).iter().all(|r| *r < 1.0));
    }

    #[test]
    fn brewster_angle_of_a_lossless_medium() {
        let r = fresnel(Complex64::new(3.0, 0.0), 3f64.sqrt().atan()).unwrap();
        assert!(r.power_v < 1e-30 && r.power_h > 0.2);
    }

    #[test]
    fn signs_follow_the_basis() {
        let r = fresnel(Complex64::new(8.2, -13.9), 0.0).unwrap();
        assert!((r.r_h + r.r_v).norm() < 1e-15);
        let metal = fresnel(Complex64::new(1.0, -1e12), 0.5).unwrap();
        assert!((metal.r_h + 1.0).norm() < 1e-5 && (metal.r_v - 1.0).norm() < 1e-5);
    }

    #[test]
    fn grazing_incidence_reflects_all() {
        for eps in [Complex64::new(3.0, -0.1), Complex64::new(8.0, -14.0)] {
            let r = fresnel(eps, FRAC_PI_2 - 1e-7).unwrap();
            assert!((1.0 - r.power_h) < 1e-5 && (1.0 - r.power_v) < 1e-5);
            assert!(r.power_h <= 1.0 && r.power_v <= 1.0);
        }
    }

    #[test]
    fn angles_that_cannot_be_are_refused() {
        let eps = Complex64::new(3.0, -0.1);
        for degrees in [90.0f64, 120.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = fresnel(eps, degrees.to_radians()).unwrap_err();
            assert!(matches!(error, SurfaceError::Angle { .. }), "{degrees}");
        }
        assert!(fresnel(eps, 89.999f64.to_radians()).is_ok());
    }
}
