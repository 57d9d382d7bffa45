//! The received fields of an array: complex Gaussian processes, of which a correlator averages products.
//!
//! With the covariance C_pq = <e_p conj(e_q)> of the fields of n receivers, and the mean of M independent samples, every product
//! V_pq = mean(e_p conj(e_q)) has the expected value C_pq, and (Isserlis 1918)
//!
//! ```text
//! cov(V_pq, V_rs) = <V_pq conj(V_rs)> - C_pq conj(C_rs) = C_pr conj(C_qs) / M,
//! <V_pq V_rs> - C_pq C_rs = C_ps conj(C_qr) / M.
//! ```
//!
//! All products together have the complex Wishart distribution. It is drawn exactly by Bartlett's triangle: V = L A A^H L^H / M with C = L L^H, where
//! A has the square roots of gamma deviates of shape M, M - 1, ... on its diagonal and complex Gaussian deviates below it.
//!
//! # Reference
//! Isserlis 1918, Biometrika 12, 134; Goodman 1963, Ann. Math. Stat. 34, 152 (complex Wishart distribution, and its triangle).

use crate::{ChainError, Result, ensure};
use ndarray::Array2;
use num_complex::Complex64;
use rand::Rng;
use rand_distr::{Distribution, Gamma, StandardNormal};

/// A pivot that is negative by less than this part of its diagonal is rounding.
const ROUNDING: f64 = 1e-5;

/// The covariance of the fields of some receivers, and the number of samples over which their products are averaged.
#[derive(Debug, Clone)]
pub struct Fields {
    covariance: Array2<Complex64>,
    samples: f64,
}

impl Fields {
    /// Fields with this Hermitian covariance \[receiver, receiver\], averaged over this many samples: bandwidth times time.
    ///
    /// # Errors
    /// A covariance that is not square, or fewer samples than receivers.
    pub fn new(covariance: Array2<Complex64>, samples: f64) -> Result<Self> {
        let n = covariance.nrows();
        ensure!(covariance.ncols() == n, ChainError::Internal("the covariance of fields is not square".into()));
        let few = || {
            let expected = format!("at least as many samples (bandwidth times time) as the {n} receivers for noise of the scene");
            ChainError::bad_option("integration", format!("{samples:.1} samples"), expected)
        };
        if !(samples >= n as f64) {
            return Err(few());
        }
        Ok(Self { covariance, samples })
    }

    /// The variance of the real part of V_pq, which is on average that of the imaginary part: C_pp C_qq / 2 M. For p = q, where V is real, twice this.
    #[must_use]
    pub fn variance(&self, p: usize, q: usize) -> f64 {
        let both = if p == q { 1.0 } else { 0.5 };
        both * self.covariance[(p, p)].re * self.covariance[(q, q)].re / self.samples
    }

    /// <V_pq conj(V_rs)> minus the product of the means.
    #[must_use]
    pub fn covariance(&self, (p, q): (usize, usize), (r, s): (usize, usize)) -> Complex64 {
        self.covariance[(p, r)] * self.covariance[(q, s)].conj() / self.samples
    }

    /// <V_pq V_rs> minus the product of the means.
    #[must_use]
    pub fn relation(&self, (p, q): (usize, usize), (r, s): (usize, usize)) -> Complex64 {
        self.covariance[(p, s)] * self.covariance[(q, r)].conj() / self.samples
    }

    /// One draw of all products \[receiver, receiver\].
    ///
    /// # Errors
    /// A covariance that no fields can have.
    pub fn draw(&self, rng: &mut impl Rng) -> Result<Array2<Complex64>> {
        let n = self.covariance.nrows();
        let root = factor(&self.covariance)?;
        let mut triangle = Array2::<Complex64>::zeros((n, n));
        for i in 0..n {
            let gamma = Gamma::new(self.samples - i as f64, 1.0).map_err(|e| ChainError::Internal(e.to_string()))?;
            triangle[(i, i)] = gamma.sample(rng).sqrt().into();
            for j in 0..i {
                let (re, im): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
                triangle[(i, j)] = Complex64::new(re, im) * std::f64::consts::FRAC_1_SQRT_2;
            }
        }
        let half = root.dot(&triangle);
        let conjugate = half.t().mapv(|v| v.conj());
        Ok(half.dot(&conjugate) / self.samples)
    }
}

/// Lower triangle L of C = L L^H. Directions without power get none.
fn factor(c: &Array2<Complex64>) -> Result<Array2<Complex64>> {
    let n = c.nrows();
    let mut l = Array2::<Complex64>::zeros((n, n));
    for j in 0..n {
        let left = c[(j, j)].re - l.row(j).iter().take(j).map(|v| v.norm_sqr()).sum::<f64>();
        let whole = c[(j, j)].re;
        ensure!(
            left >= -ROUNDING * whole && whole >= 0.0,
            ChainError::Incompatible(
                "no fields have these visibilities, so that the noise of the scene is unknown: it is negative somewhere".into()
            )
        );
        if left <= 1e-14 * whole {
            continue;
        }
        let pivot = left.sqrt();
        l[(j, j)] = pivot.into();
        for i in j + 1..n {
            let sum: Complex64 = (0..j).map(|k| l[(i, k)] * l[(j, k)].conj()).sum();
            l[(i, j)] = (c[(i, j)] - sum) / pivot;
        }
    }
    Ok(l)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    /// Fields of a bright point and of receivers of different noise.
    fn fields(samples: f64) -> Fields {
        let phases = [0.0, 1.1, 2.7, -0.6, 4.0];
        let c = Array2::from_shape_fn((5, 5), |(p, q)| {
            let noise = if p == q { 1.0 + 0.3 * p as f64 } else { 0.0 };
            Complex64::from_polar(0.8, phases[p] - phases[q]) + noise
        });
        Fields::new(c, samples).unwrap()
    }

    #[test]
    fn draws_have_the_moments_of_gaussian_fields_however_few_the_samples() {
        for (samples, seed) in [(6.0, 1), (1e6, 2)] {
            let f = fields(samples);
            let draws: Vec<Array2<Complex64>> = (0..20_000).map(|k| f.draw(&mut stream(seed, "draws of fields", k)).unwrap()).collect();
            let n = draws.len() as f64;
            let scale = f.covariance((4, 4), (4, 4)).re;
            let pairs = [(0, 1), (0, 2), (1, 2), (3, 4), (2, 2), (4, 4)];
            for a in pairs {
                let mean = draws.iter().map(|d| d[a]).sum::<Complex64>() / n;
                // Five standard errors.
                assert!((mean - f.covariance[a]).norm() < 5.0 * (2.0 * f.variance(a.0, a.1) / n).sqrt(), "{a:?}: {mean}");
                for b in pairs {
                    let of = |g: &dyn Fn(Complex64) -> Complex64| {
                        draws.iter().map(|d| (d[a] - f.covariance[a]) * g(d[b] - f.covariance[b])).sum::<Complex64>() / n
                    };
                    let (cov, rel) = (of(&|v| v.conj()) - f.covariance(a, b), of(&|v| v) - f.relation(a, b));
                    // Few samples give long tails, so that the errors of the moments are larger.
                    let limit = if samples < 10.0 { 0.08 } else { 0.04 } * scale;
                    assert!(cov.norm() < limit && rel.norm() < limit, "{samples} {a:?} {b:?}: {cov} {rel}, of {scale}");
                }
            }
        }
    }

    #[test]
    fn the_triangle_agrees_with_products_of_samples() {
        // The same distribution as the mean of products of sampled fields, here by its second and third moments of one power.
        let f = fields(8.0);
        let root = factor(&f.covariance).unwrap();
        let sampled = |k: u64| {
            let mut rng = stream(9, "samples of fields", k);
            (0..8)
                .map(|_| {
                    let z = ndarray::Array1::from_shape_fn(5, |_| {
                        let (re, im): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                        Complex64::new(re, im) * std::f64::consts::FRAC_1_SQRT_2
                    });
                    let e = root.dot(&z);
                    e[4].norm_sqr() / 8.0
                })
                .sum::<f64>()
        };
        let moments = |values: Vec<f64>| {
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let central = |k: i32| values.iter().map(|v| (v - mean).powi(k)).sum::<f64>() / n;
            [mean, central(2), central(3)]
        };
        let a = moments((0..40_000).map(sampled).collect());
        let b = moments((0..40_000).map(|k| f.draw(&mut stream(10, "draws", k)).unwrap()[(4, 4)].re).collect());
        for (x, y) in a.iter().zip(b) {
            assert!((x / y - 1.0).abs() < 0.08, "{a:?} {b:?}");
        }
    }

    #[test]
    fn impossible_covariances_and_too_few_samples_are_refused() {
        assert!(Fields::new(Array2::eye(5), 4.0).is_err());
        let c = Array2::from_shape_fn((2, 2), |(p, q)| Complex64::from(if p == q { 1.0 } else { 2.0 }));
        assert!(Fields::new(c, 1e6).unwrap().draw(&mut stream(1, "x", 0)).unwrap_err().to_string().contains("no fields"));
        // Identical fields have no power beyond the first.
        let same = Fields::new(Array2::from_elem((3, 3), Complex64::from(1.0)), 1e4).unwrap();
        let drawn = same.draw(&mut stream(1, "y", 0)).unwrap();
        assert!((drawn[(0, 2)] - drawn[(1, 1)]).norm() < 1e-12);
    }
}
