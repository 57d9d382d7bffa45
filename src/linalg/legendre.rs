//! Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// Nodes from -1 to 1 and their weights, which integrate polynomials up to degree 2 n - 1 exactly.
///
/// # Reference
/// Abramowitz & Stegun 1964, eq. 25.4.29; roots by Newton's method.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let root = |k: usize| {
        let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut now, mut before) = (1.0, 0.0);
            for j in 0..n {
                let j = j as f64;
                (now, before) = (((2.0 * j + 1.0) * x * now - j * before) / (j + 1.0), now);
            }
            slope = n as f64 * (x * now - before) / (x * x - 1.0);
            let step = now / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).rev().map(root).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_exact() {
        for n in [1_usize, 2, 5, 16, 24] {
            let rule = gauss_legendre(n);
            for power in 0..2 * n {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let truth = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - truth).abs() < 1e-13, "{n} nodes, degree {power}: {sum} {truth}");
            }
        }
    }
}
