//! Gauss rules, computed once.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Nodes and weights of a rule.
#[derive(Debug)]
pub(super) struct Rule {
    points: Vec<(f64, f64)>,
}

impl Rule {
    /// Nodes and weights moved to the interval `lo` to `hi` (Gauss-Legendre only).
    pub(super) fn on(&self, lo: f64, hi: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (mid, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        self.points.iter().map(move |&(x, w)| (mid + half * x, half * w))
    }

    /// Nodes and weights as they are.
    pub(super) fn points(&self) -> &[(f64, f64)] {
        &self.points
    }
}

/// Gauss-Legendre rule of `n` points on -1 to 1, by Newton from the Chebyshev guess.
fn gauss_legendre(n: usize) -> Rule {
    let mut points = Vec::with_capacity(n);
    for i in 0..n {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p0, mut p1) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
            }
            slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
            let step = p1 / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        points.push((x, 2.0 / ((1.0 - x * x) * slope * slope)));
    }
    Rule { points }
}

/// Gauss-Hermite rule of `n` points for the standard normal density (weights sum to 1).
fn gauss_normal(n: usize) -> Rule {
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(n);
    // Orthonormal Hermite polynomials; roots found from the outermost inwards.
    let value = |x: f64| {
        let (mut p0, mut p1) = (0.0, 1.0);
        for k in 0..n {
            let k = k as f64;
            (p0, p1) = (p1, (x * p1 - k.sqrt() * p0) / (k + 1.0).sqrt());
        }
        (p1, p0)
    };
    let scan = 40 * n;
    let reach = 2.0 * (n as f64).sqrt() + 2.0;
    let at = |i: usize| -reach + 2.0 * reach * (i as f64 + 0.5) / scan as f64;
    for i in 1..scan {
        let (lo, hi) = (at(i - 1), at(i));
        if value(lo).0 * value(hi).0 > 0.0 {
            continue;
        }
        let mut x = 0.5 * (lo + hi);
        for _ in 0..50 {
            let (p, before) = value(x);
            let step = p / ((n as f64).sqrt() * before);
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (_, before) = value(x);
        points.push((x, 1.0 / (n as f64 * before * before)));
    }
    Rule { points }
}

/// Nodes and weights of the Gauss-Legendre rule of `n` points on an interval.
pub(super) fn gauss_legendre_on(n: usize, lo: f64, hi: f64) -> Vec<(f64, f64)> {
    gauss_legendre(n).on(lo, hi).collect()
}

macro_rules! rules {
    ($($name:ident = $make:ident($n:expr), $doc:literal;)*) => {$(
        #[doc = $doc]
        pub(super) fn $name() -> &'static Rule {
            static RULE: OnceLock<Rule> = OnceLock::new();
            RULE.get_or_init(|| $make($n))
        }
    )*};
}

rules! {
    legendre_12 = gauss_legendre(12), "Gauss-Legendre, 12 points.";
    legendre_24 = gauss_legendre(24), "Gauss-Legendre, 24 points.";
    legendre_32 = gauss_legendre(32), "Gauss-Legendre, 32 points.";
    normal_8 = gauss_normal(8), "Standard normal density, 8 points.";
}

#[cfg(test)]
pub(super) fn legendre_fine() -> &'static Rule {
    static RULE: OnceLock<Rule> = OnceLock::new();
    RULE.get_or_init(|| gauss_legendre(160))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legendre_integrates_polynomials() {
        for rule in [legendre_12(), legendre_24(), legendre_32(), legendre_fine()] {
            let sum: f64 = rule.on(0.0, 2.0).map(|(x, w)| w * x.powi(11)).sum();
            let exact = 2f64.powi(12) / 12.0;
            assert!((sum / exact - 1.0).abs() < 1e-12, "{sum}");
        }
    }

    #[test]
    fn normal_has_the_moments_of_the_density() {
        let rule = normal_8();
        assert_eq!(rule.points().len(), 8);
        for (power, moment) in [(0, 1.0), (2, 1.0), (4, 3.0), (6, 15.0), (14, 135_135.0)] {
            let sum: f64 = rule.points().iter().map(|(x, w)| w * x.powi(power)).sum();
            assert!((sum / moment - 1.0).abs() < 1e-11, "{power}: {sum}");
        }
    }
}
