//! Shadowing on a surface of Gaussian slopes, for one or two directions.

use super::slopes::Slopes;
use std::f64::consts::{PI, SQRT_2};

/// Which shadowing function is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shadowing {
    /// Smith: `1/(1+L)`. A black surface then has emissivity exactly 1.
    #[default]
    Smith,
    /// Wagner: `(1-exp(-L))/L`, the older form; somewhat larger.
    Wagner,
    /// No shadowing.
    None,
}

/// Argument above which `Lambda` is negligible in an integral (below 1e-17).
const NEGLIGIBLE_V: f64 = 6.0;

/// `Lambda` for `v = cot(zenith)/(sqrt(2) slope)`; infinite at the horizon.
///
/// # Reference
/// Smith 1967, J. Geophys. Res. 72, 4059: `(exp(-v^2)/(sqrt(pi) v) - erfc(v))/2`.
#[must_use]
pub fn shadow_lambda_v(v: f64) -> f64 {
    if v <= 0.0 {
        return f64::INFINITY;
    }
    if v > 20.0 {
        // Leading terms of the asymptotic series; the difference of the two terms loses digits.
        let v2 = v * v;
        return (-v2).exp() / (4.0 * PI.sqrt() * v * v2) * (1.0 - 1.5 / v2 * (1.0 - 2.5 / v2));
    }
    0.5 * ((-v * v).exp() / (PI.sqrt() * v) - libm::erfc(v))
}

/// `Lambda` at a zenith angle (radians) and azimuth (radians, from the first slope axis).
#[must_use]
pub fn shadow_lambda(slopes: &Slopes, zenith_rad: f64, azimuth_rad: f64) -> f64 {
    let (s, c) = azimuth_rad.sin_cos();
    let slope = slopes.variance(c, s).sqrt();
    shadow_lambda_v(1.0 / (zenith_rad.tan() * SQRT_2 * slope))
}

/// `Lambda` of an upward unit direction; zero where it is negligible.
#[must_use]
pub(super) fn lambda_of_direction(slopes: &Slopes, d: [f64; 3]) -> f64 {
    let v = d[2] / (SQRT_2 * slopes.variance(d[0], d[1]).sqrt());
    if v > NEGLIGIBLE_V { 0.0 } else { shadow_lambda_v(v) }
}

impl Shadowing {
    /// Probability that a facet that faces a direction is seen from it.
    #[must_use]
    pub fn single(self, lambda: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Smith => 1.0 / (1.0 + lambda),
            Self::Wagner if lambda.is_infinite() => 0.0,
            Self::Wagner if lambda < 1e-8 => 1.0 - 0.5 * lambda,
            Self::Wagner => -(-lambda).exp_m1() / lambda,
        }
    }

    /// Probability that a facet that faces two directions is seen from both.
    ///
    /// With `same_azimuth` the same obstacle blocks both directions, and only the larger `Lambda` counts.
    #[must_use]
    pub fn bistatic(self, lambda_a: f64, lambda_b: f64, same_azimuth: bool) -> f64 {
        self.single(if same_azimuth { lambda_a.max(lambda_b) } else { lambda_a + lambda_b })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_joins_the_closed_form() {
        let v = 20.0f64;
        let closed = 0.5 * ((-v * v).exp() / (PI.sqrt() * v) - libm::erfc(v));
        let series = shadow_lambda_v(v * (1.0 + 1e-15));
        assert!((series / closed - 1.0).abs() < 1e-6, "{series} {closed}");
    }

    #[test]
    fn wagner_is_larger_than_smith_and_both_are_probabilities() {
        for lambda in [0.0, 1e-10, 1e-3, 0.5, 3.0, 1e3] {
            let (s, w) = (Shadowing::Smith.single(lambda), Shadowing::Wagner.single(lambda));
            assert!(w >= s && w <= 1.0 && s > 0.0, "{lambda}: {s} {w}");
        }
        assert_eq!(Shadowing::Wagner.single(f64::INFINITY), 0.0);
        assert_eq!(Shadowing::Smith.single(f64::INFINITY), 0.0);
    }

    #[test]
    fn nadir_sees_everything_and_the_horizon_nothing() {
        let slopes = Slopes::isotropic(0.2).unwrap();
        assert_eq!(shadow_lambda(&slopes, 0.0, 0.3), 0.0);
        assert!((Shadowing::Smith.single(shadow_lambda_v(30.0)) - 1.0).abs() < 1e-12);
        let horizon = shadow_lambda_v(1e-6);
        assert!(Shadowing::Smith.bistatic(horizon, horizon, false) < 1e-4);
    }
}
