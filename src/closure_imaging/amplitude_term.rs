//! Amplitudes without their phases: chi2 = sum of (|V| - A)^2 / sigma^2, with the noise bias taken from A.

use super::samples::Samples;
use crate::misfit::VisibilityTerm;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use num_complex::Complex;

/// Measured amplitudes.
#[derive(Debug, Clone)]
pub struct Amplitudes {
    amplitude: Vec<f64>,
    /// 1 / variance \[n\]; 0 for data that are not used.
    weight: Vec<f64>,
    used: usize,
}

impl Amplitudes {
    /// Amplitudes of the entries that `used` \[n\] admits, debiased: A^2 = |V|^2 - sigma^2, and 0 below one sigma. `fraction` is the
    /// relative error of every amplitude, added in quadrature.
    ///
    /// # Errors
    /// No entry can be used, or the fraction is negative or not finite.
    ///
    /// # Reference
    /// Thompson, Moran & Swenson 2017, eq. 9.33; Chael et al. 2018, ApJ 857, 23, eq. 9.
    pub fn new(samples: &Samples, used: &[bool], fraction: f64) -> Result<Self> {
        need("the relative error of amplitudes", fraction, fraction >= 0.0 && fraction.is_finite(), "a fraction of 0 or more")?;
        let amplitude: Vec<f64> = samples.vis().iter().zip(samples.sigma()).map(|(v, s)| (v.norm_sqr() - s * s).max(0.0).sqrt()).collect();
        let weight = |k: usize| if used[k] { 1.0 / (samples.sigma()[k].powi(2) + (fraction * amplitude[k]).powi(2)) } else { 0.0 };
        let weight: Vec<f64> = (0..samples.len()).map(weight).collect();
        let used = weight.iter().filter(|w| **w > 0.0).count();
        ensure!(used > 0, ChainError::NoData("no amplitude can be used: nothing constrains the image".into()));
        Ok(Self { amplitude, weight, used })
    }
}

impl VisibilityTerm for Amplitudes {
    fn name(&self) -> &'static str {
        "amplitudes"
    }

    fn data(&self) -> usize {
        self.used
    }

    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64 {
        let mut sum = 0.0;
        for (((m, g), a), w) in model.iter().zip(gradient).zip(&self.amplitude).zip(&self.weight) {
            let size = m.norm();
            if *w == 0.0 || size == 0.0 {
                sum += w * a * a;
                continue; // at 0 the amplitude has no gradient
            }
            let d = size - a;
            sum += w * d * d;
            *g += m * (2.0 * weight * w * d / size);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::fixture::{model, samples, with};
    use super::*;
    use crate::misfit::check::gradient_error;
    use num_complex::Complex64;

    #[test]
    fn the_gradient_agrees_with_finite_differences_and_phases_do_not_matter() {
        let s = samples(5, 3);
        let mut used = vec![true; s.len()];
        used[2] = false;
        let term = Amplitudes::new(&s, &used, 0.02).unwrap();
        assert_eq!(term.data(), s.len() - 1);
        assert!(gradient_error(&term, &model(&s)) < 1e-6);
        let turned: Vec<Complex64> = model(&s).iter().enumerate().map(|(k, v)| v * Complex64::from_polar(1.0, k as f64)).collect();
        let mut g = vec![Complex64::default(); s.len()];
        let (a, b) = (term.add(&model(&s), 1.0, &mut g), term.add(&turned, 1.0, &mut g));
        assert!((a - b).abs() < 1e-9 * a);
        assert!(term.add(&vec![Complex64::default(); s.len()], 1.0, &mut g).is_finite());
    }

    #[test]
    fn the_noise_bias_is_gone_from_five_sigma() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let s = samples(8, 400);
        let noisy = s.sigma().iter().map(|s| Complex64::new(5.0 * s + s * normal(), s * normal())).collect();
        let noisy = with(&s, noisy);
        let term = Amplitudes::new(&noisy, &vec![true; s.len()], 0.0).unwrap();
        let bias = |a: &dyn Fn(usize) -> f64| (0..s.len()).map(|k| a(k) / s.sigma()[k] - 5.0).sum::<f64>() / s.len() as f64;
        let (raw, debiased) = (bias(&|k| noisy.vis()[k].norm()), bias(&|k| term.amplitude[k]));
        // The bias is 1 / (2 x 5) sigma without the correction. With it the bias is of third order. The scatter of the mean is 1 / sqrt(n).
        assert!((raw - 0.1).abs() < 0.03 && debiased.abs() < 0.03, "{raw} {debiased} of {}", s.len());
    }
}
