//! Polynomials that are fitted to smooth functions, and Gauss-Legendre quadrature.

/// Nodes and weights of the Gauss-Legendre rule with `n` points on \[-1, 1\].
///
/// # Reference
/// Abramowitz & Stegun 1964, 25.4.29; the roots by Newton's method from the estimate of 22.16.6.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let nodes = (0..n).map(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..n {
                let k = k as f64;
                (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
            }
            slope = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    });
    nodes.collect()
}

/// Monomial coefficients (constant first) of the polynomial that equals `f` at `n` Chebyshev nodes of \[-1, 1\].
pub(crate) fn fit(n: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let angle = |j: usize| std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
    let values: Vec<f64> = (0..n).map(|j| f(angle(j).cos())).collect();
    let chebyshev = |k: usize| -> f64 {
        let sum: f64 = values.iter().enumerate().map(|(j, v)| v * (k as f64 * angle(j)).cos()).sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / n as f64
    };
    let mut out = vec![0.0; n];
    // T_0 = 1, T_1 = x, T_{k+1} = 2 x T_k - T_{k-1}, as rows of monomial coefficients.
    let (mut t, mut next) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    (t[0], next[1.min(n)]) = (1.0, 1.0);
    for k in 0..n {
        let c = chebyshev(k);
        out.iter_mut().zip(&t).for_each(|(o, t)| *o += c * t);
        let mut after: Vec<f64> = t.iter().map(|x| -x).collect();
        (0..n).for_each(|i| after[i + 1] += 2.0 * next[i]);
        (t, next) = (next, after);
    }
    out
}

/// The polynomial with these coefficients (constant first) at x.
pub(crate) fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The shortest fit of `f` on \[-1, 1\] whose error at 65 test points is at most `tolerance`. A fit with `longest` coefficients is returned if
/// no shorter one is accurate enough; its error is then that of rounding.
pub(crate) fn fit_to(tolerance: f64, longest: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let expected: Vec<(f64, f64)> = (0..=64).map(|i| f64::from(i) / 32.0 - 1.0).map(|x| (x, f(x))).collect();
    let mut n = 1;
    loop {
        let c = fit(n, &f);
        let worst = expected.iter().map(|(x, y)| (horner(&c, *x) - y).abs()).fold(0.0, f64::max);
        if worst <= tolerance || n >= longest {
            return c;
        }
        n += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_integrates_polynomials_of_degree_2n_minus_1_exactly() {
        for n in [1, 2, 5, 40] {
            let sum: f64 = gauss_legendre(n).iter().map(|(x, w)| w * x.powi(2 * n as i32 - 2)).sum();
            assert!((sum - 2.0 / (2 * n - 1) as f64).abs() < 1e-14, "{n} {sum}");
        }
    }

    #[test]
    fn a_cubic_is_fitted_by_its_own_coefficients() {
        let c = fit(4, |x| 1.0 - 2.0 * x + 0.5 * x * x * x);
        for (a, b) in c.iter().zip([1.0, -2.0, 0.0, 0.5]) {
            assert!((a - b).abs() < 1e-14);
        }
        assert!(fit_to(1e-13, 30, f64::exp).len() < 18);
    }
}
