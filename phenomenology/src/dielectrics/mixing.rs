//! Mixing formulas: small inclusions in a host.

use super::error::DielectricError;
use num_complex::Complex64;

/// Largest number of iterations.
const MAX_ITERATIONS: usize = 2000;
/// Relative change at which the iteration stops.
const TOLERANCE: f64 = 1e-14;

/// Depolarisation factors of a sphere.
pub const SPHERE: [f64; 3] = [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0];
/// Depolarisation factors of a long needle.
pub const NEEDLE: [f64; 3] = [0.5, 0.5, 0.0];

/// Effective permittivity of randomly oriented ellipsoids by Polder and van Santen.
///
/// `fraction` is the volume fraction of the inclusions, `factors` the three depolarisation
/// factors (sum 1). The effective medium surrounds each inclusion.
///
/// # Errors
/// [`DielectricError::Refused`] if the iteration does not converge.
///
/// # Reference
/// Polder & van Santen 1946, Physica 12, 257:
/// `eps = host + v/3 (inc - host) sum eps/(eps + a (inc - eps))`.
pub fn polder_van_santen46(host: Complex64, inclusion: Complex64, fraction: f64, factors: [f64; 3]) -> Result<Complex64, DielectricError> {
    let contrast = inclusion - host;
    let mut eps = host + contrast * fraction / 3.0;
    for iteration in 0..MAX_ITERATIONS {
        let sum: Complex64 = factors.iter().map(|&a| eps / (eps + (inclusion - eps) * a)).sum();
        let mut next = host + contrast * sum * (fraction / 3.0);
        // At high contrast the plain iteration can oscillate around the root. The mean of two steps converges.
        if iteration > 50 {
            next = (next + eps) * 0.5;
        }
        let change = (next - eps).norm();
        eps = next;
        if change <= TOLERANCE * eps.norm() {
            return Ok(eps);
        }
    }
    Err(DielectricError::Refused(format!("the mixing formula did not converge after {MAX_ITERATIONS} iterations")))
}

/// Effective permittivity of spheres in a host by Maxwell Garnett.
///
/// # Reference
/// Maxwell Garnett 1904; Sihvola 1999, eq. 3.29.
#[must_use]
pub fn maxwell_garnett04(host: Complex64, inclusion: Complex64, fraction: f64) -> Complex64 {
    let contrast = inclusion - host;
    let shape = inclusion + host * 2.0 - contrast * fraction;
    host + host * contrast * (3.0 * fraction) / shape
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_host_and_inclusion() {
        let host = Complex64::new(1.5, -0.01);
        let water = Complex64::new(8.0, -14.0);
        for factors in [SPHERE, NEEDLE] {
            let none = polder_van_santen46(host, water, 0.0, factors).unwrap();
            let all = polder_van_santen46(host, water, 1.0, factors).unwrap();
            assert!((none - host).norm() < 1e-12);
            assert!((all - water).norm() < 1e-9, "{all}");
        }
        assert!((maxwell_garnett04(host, water, 1.0) - water).norm() < 1e-12);
    }

    // Both formulas share the first-order term of dilute spheres, 3 v host (i-h)/(i+2h).
    #[test]
    fn dilute_spheres_agree() {
        let host = Complex64::new(3.17, -0.001);
        let brine = Complex64::new(40.0, -45.0);
        let v = 1e-5;
        let pvs = polder_van_santen46(host, brine, v, SPHERE).unwrap() - host;
        let mg = maxwell_garnett04(host, brine, v) - host;
        let first = host * (brine - host) / (brine + host * 2.0) * (3.0 * v);
        assert!((pvs - first).norm() < 1e-3 * first.norm());
        assert!((mg - first).norm() < 1e-3 * first.norm());
    }
}
