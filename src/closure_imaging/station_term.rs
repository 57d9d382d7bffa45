//! Amplitudes of antennas whose gains are uncertain by a known fraction: the gains are integrated out.
//!
//! The logarithm of a measured amplitude is ln|V| + g_p + g_q plus noise, with an unknown log gain g for each antenna and moment that
//! is Gaussian around 0 with a standard deviation s_p. Integrating over the gains leaves a Gaussian with covariance
//! C = diag(sigma^2 / |V|^2) + A diag(s^2) A', where row k of A has a 1 at both antennas of baseline k. So s = 0 means calibrated
//! amplitudes, and infinite s means closure amplitudes with their full covariance. Any s between these has its proper weight. The marginal
//! likelihood also gives the most likely s of each antenna.

use super::samples::Samples;
use crate::linalg::{Cholesky, Matrix};
use crate::misfit::VisibilityTerm;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use num_complex::Complex;

/// Log amplitudes with the gains integrated out.
#[derive(Debug, Clone)]
pub struct StationAmplitudes {
    log: Vec<f64>,
    variance: Vec<f64>,
    pairs: Vec<(usize, usize)>,
    /// Entries of each moment that are used.
    moments: Vec<Vec<usize>>,
    /// Inverse covariance of each moment, row after row.
    precision: Vec<Vec<f64>>,
    /// Mean of ln det C per datum.
    log_determinant: f64,
    sigma: Vec<f64>,
    used: usize,
}

/// Log gains given a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogGains {
    /// Mean \[time, antenna\]. The amplitudes of the data are those of the model times exp(g_p + g_q).
    pub mean: Vec<Vec<Option<f64>>>,
    /// Variance \[moment, antenna\].
    pub variance: Vec<Vec<f64>>,
}

impl StationAmplitudes {
    /// Log amplitudes of the entries that `used` \[n\] marks; `sigma` \[antenna\] are the standard deviations of the log gains.
    ///
    /// # Errors
    /// No entry can be used, the number of sigma differs from that of the antennas, or a sigma is negative or not finite.
    ///
    /// # Reference
    /// Blackburn et al. 2020, ApJ 894, 31, sect. 4 (closures as the limit of unknown gains); Broderick et al. 2020, ApJ 904, 126.
    pub fn new(samples: &Samples, used: &[bool], sigma: &[f64]) -> Result<Self> {
        let good = |k: &usize| used[*k] && samples.vis()[*k].norm_sqr() > 0.0;
        let moments: Vec<Vec<usize>> = samples.moments().iter().map(|m| m.clone().filter(good).collect()).collect();
        let used = moments.iter().map(Vec::len).sum();
        ensure!(used > 0, ChainError::NoData("no amplitude can be used: nothing constrains the image".into()));
        let mut term = Self {
            log: samples.vis().iter().map(|v| v.norm().max(f64::MIN_POSITIVE).ln()).collect(),
            variance: (0..samples.len()).map(|k| samples.relative_variance(k)).collect(),
            pairs: samples.pairs().to_vec(),
            moments,
            precision: Vec::new(),
            log_determinant: 0.0,
            sigma: vec![0.0; samples.n_ant()],
            used,
        };
        term.set_gain_sigma(sigma)?;
        Ok(term)
    }

    /// Standard deviations of the log gains \[antenna\].
    #[must_use]
    pub fn gain_sigma(&self) -> &[f64] {
        &self.sigma
    }

    /// Mean of ln det C per datum. The sum of this and chi squared per datum is twice the negative log likelihood, except for a constant.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Change the standard deviations of the log gains.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn set_gain_sigma(&mut self, sigma: &[f64]) -> Result<()> {
        let good = sigma.len() == self.sigma.len() && sigma.iter().all(|s| *s >= 0.0 && s.is_finite());
        let expected = format!("{} numbers of 0 or more", self.sigma.len());
        need("the gain errors of the antennas", format!("{sigma:?}"), good, expected)?;
        let (mut precision, mut log_determinant) = (Vec::with_capacity(self.moments.len()), 0.0);
        for entries in &self.moments {
            let n = entries.len();
            let mut c = Matrix::zeros(n, n);
            for (i, k) in entries.iter().enumerate() {
                for (j, l) in entries.iter().enumerate() {
                    let ((p, q), (r, s)) = (self.pairs[*k], self.pairs[*l]);
                    let shared = [p, q].iter().filter(|a| **a == r || **a == s).map(|a| sigma[*a] * sigma[*a]).sum::<f64>();
                    c[(i, j)] = shared + if i == j { self.variance[*k] } else { 0.0 };
                }
            }
            // The matrix is scaled to a unit diagonal, because errors of a few per cent and errors of many times the signal occur together.
            let scale: Vec<f64> = (0..n).map(|i| c[(i, i)].sqrt().recip()).collect();
            (0..n).for_each(|i| (0..n).for_each(|j| c[(i, j)] *= scale[i] * scale[j]));
            let Some(factor) = Cholesky::new(&c) else {
                return Err(ChainError::NoData("the errors of the amplitudes are too unequal to be inverted: are some of them 0?".into()));
            };
            log_determinant += factor.log_determinant() - 2.0 * scale.iter().map(|s| s.ln()).sum::<f64>();
            let mut inverse = vec![0.0; n * n];
            for j in 0..n {
                let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == j))).collect();
                factor.solve(&unit).iter().enumerate().for_each(|(i, x)| inverse[i * n + j] = x * scale[i] * scale[j]);
            }
            precision.push(inverse);
        }
        self.sigma = sigma.to_vec();
        self.precision = precision;
        self.log_determinant = log_determinant / self.used as f64;
        Ok(())
    }

    /// Precision times the residuals ln|V| - ln|model| of a moment, which is written to `residual`.
    fn weighted(&self, moment: usize, model: &[Complex<f64>], residual: &mut Vec<f64>) -> Vec<f64> {
        let entries = &self.moments[moment];
        residual.clear();
        residual.extend(entries.iter().map(|k| self.log[*k] - 0.5 * model[*k].norm_sqr().max(f64::MIN_POSITIVE).ln()));
        let n = entries.len();
        self.precision[moment].chunks_exact(n.max(1)).map(|row| row.iter().zip(&*residual).map(|(a, b)| a * b).sum()).collect()
    }

    /// Mean and variance of the log gains of every time, given the model.
    #[must_use]
    pub fn gains(&self, model: &[Complex<f64>]) -> LogGains {
        let (n_ant, mut out, mut residual) = (self.sigma.len(), LogGains::default(), Vec::new());
        for (t, entries) in self.moments.iter().enumerate() {
            let q = self.weighted(t, model, &mut residual);
            let (mut mean, mut variance) = (vec![None; n_ant], vec![0.0; n_ant]);
            for a in 0..n_ant {
                let own: Vec<usize> =
                    (0..entries.len()).filter(|i| self.pairs[entries[*i]].0 == a || self.pairs[entries[*i]].1 == a).collect();
                let s2 = self.sigma[a] * self.sigma[a];
                if own.is_empty() {
                    continue;
                }
                mean[a] = Some(s2 * own.iter().map(|i| q[*i]).sum::<f64>());
                let n = entries.len();
                let information: f64 = own.iter().map(|i| own.iter().map(|j| self.precision[t][i * n + j]).sum::<f64>()).sum();
                variance[a] = (s2 - s2 * s2 * information).max(0.0);
            }
            out.mean.push(mean);
            out.variance.push(variance);
        }
        out
    }

    /// Estimate the standard deviations of the log gains from the data, given the model, by a few steps of expectation and maximisation.
    /// They stay above `floor` \[antenna\]. Two pseudo-observations at that value keep an antenna with little data near it.
    ///
    /// # Errors
    /// As [`Self::set_gain_sigma`].
    ///
    /// # Reference
    /// Dempster, Laird & Rubin 1977, J. R. Stat. Soc. B 39, 1.
    pub fn learn_gain_sigma(&mut self, model: &[Complex<f64>], floor: &[f64]) -> Result<()> {
        const STEPS: usize = 3;
        const PSEUDO: f64 = 2.0;
        for _ in 0..STEPS {
            let gains = self.gains(model);
            let mut sigma = self.sigma.clone();
            for (a, s) in sigma.iter_mut().enumerate() {
                let (mut sum, mut count) = (PSEUDO * floor[a] * floor[a], PSEUDO);
                for (mean, variance) in gains.mean.iter().zip(&gains.variance) {
                    if let Some(g) = mean[a] {
                        sum += g * g + variance[a];
                        count += 1.0;
                    }
                }
                *s = (sum / count).sqrt().max(floor[a]);
            }
            self.set_gain_sigma(&sigma)?;
        }
        Ok(())
    }
}

impl VisibilityTerm for StationAmplitudes {
    fn name(&self) -> &'static str {
        "amplitudes"
    }

    fn data(&self) -> usize {
        self.used
    }

    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64 {
        let (mut sum, mut residual) = (0.0, Vec::new());
        for (t, entries) in self.moments.iter().enumerate() {
            let q = self.weighted(t, model, &mut residual);
            for ((k, q), r) in entries.iter().zip(&q).zip(&residual) {
                sum += q * r;
                gradient[*k] -= model[*k] * (2.0 * weight * q / model[*k].norm_sqr().max(f64::MIN_POSITIVE));
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::closure_amplitude_term::ClosureAmplitudes;
    use super::super::samples::fixture::{corrupted, model, samples, with};
    use super::*;
    use crate::closure::ClosureSet;
    use crate::misfit::check::gradient_error;
    use num_complex::Complex64;

    fn chi2(t: &dyn VisibilityTerm, m: &[Complex64]) -> f64 {
        t.add(m, 0.0, &mut vec![Complex64::default(); m.len()])
    }

    fn term(s: &Samples, sigma: f64) -> StationAmplitudes {
        StationAmplitudes::new(s, &vec![true; s.len()], &vec![sigma; s.n_ant()]).unwrap()
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let s = samples(6, 2);
        for sigma in [0.0, 0.1, 3.0] {
            assert!(gradient_error(&term(&s, sigma), &model(&s)) < 1e-6, "{sigma}");
        }
    }

    #[test]
    fn without_gain_errors_it_is_the_sum_of_squares() {
        let s = samples(6, 2);
        let m = model(&s);
        let plain: f64 = (0..s.len()).map(|k| (s.vis()[k].norm() / m[k].norm()).ln().powi(2) / s.relative_variance(k)).sum();
        assert!((chi2(&term(&s, 0.0), &m) / plain - 1.0).abs() < 1e-9);
    }

    #[test]
    fn with_unknown_gains_it_knows_no_more_than_the_closure_amplitudes() {
        let s = samples(6, 2);
        let loose = term(&s, 1e3);
        let gain = |t: usize, a: usize| Complex64::from_polar(0.5 + 0.3 * ((a + t) % 4) as f64, a as f64);
        let m = model(&s);
        let (a, b) = (chi2(&loose, &m), chi2(&loose, &corrupted(&s, &m, gain)));
        assert!((a - b).abs() < 1e-3 * a, "{a} {b}");
        assert!(chi2(&loose, &corrupted(&s, s.vis(), gain)) < 1e-4);
        // The term of a minimal set of closures without its covariance has a similar value, but not the same value.
        let closures = ClosureAmplitudes::new(&s, &vec![true; s.len()], ClosureSet::Minimal).unwrap();
        assert!(closures.data() < loose.data() && chi2(&closures, &m) > 0.1 * a);
    }

    #[test]
    fn the_antenna_with_bad_gains_is_found() {
        let s = samples(8, 40);
        let wild = |t: usize| 1.0 * ((t * 13 % 7) as f64 / 3.0 - 1.0);
        let bad = with(&s, corrupted(&s, s.vis(), |t, a| Complex64::new(if a == 3 { wild(t).exp() } else { 1.0 }, 0.0)));
        let mut t = term(&bad, 0.05);
        let before = chi2(&t, s.vis()) / t.data() as f64 + t.log_determinant();
        t.learn_gain_sigma(s.vis(), &[0.05; 8]).unwrap();
        t.learn_gain_sigma(s.vis(), &[0.05; 8]).unwrap();
        let after = chi2(&t, s.vis()) / t.data() as f64 + t.log_determinant();
        assert!(after < before);
        let rms = ((0..40).map(|t| wild(t).powi(2)).sum::<f64>() / 40.0).sqrt();
        assert!((t.gain_sigma()[3] / rms - 1.0).abs() < 0.1, "{:?}", t.gain_sigma());
        assert!((0..8).filter(|a| *a != 3).all(|a| t.gain_sigma()[a] < 0.06), "{:?}", t.gain_sigma());
        let gains = t.gains(s.vis());
        for (k, mean) in gains.mean.iter().enumerate() {
            assert!((mean[3].unwrap() - wild(k)).abs() < 0.1);
        }
    }
}
