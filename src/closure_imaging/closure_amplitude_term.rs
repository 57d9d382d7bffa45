//! Logarithms of closure amplitudes: combinations of amplitudes that antenna errors do not change.

use super::samples::{Formed, Samples};
use crate::closure::{ClosureSet, quadrangles};
use crate::misfit::VisibilityTerm;
use crate::{ChainError, Result, ensure};
use num_complex::Complex;

/// Measured ln(|V_ab| |V_cd| / (|V_ac| |V_bd|)).
#[derive(Debug, Clone)]
pub struct ClosureAmplitudes {
    /// On V_ab, V_cd, V_ac and V_bd.
    closures: Formed<4>,
    log: Vec<f64>,
}

/// Signs of the logarithms of the four sides.
const SIGNS: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

impl ClosureAmplitudes {
    /// The log closure amplitudes of every time, from the entries that `used` \[n\] marks. Their variance is the sum of sigma^2 / |V|^2
    /// over the four sides. A minimal set is formed around the antenna with the most information. In a set of all quadrangles the weight of
    /// each is multiplied by the ratio of independent quadrangles to all.
    ///
    /// # Errors
    /// No quadrangle with data.
    ///
    /// # Reference
    /// Chael et al. 2018, ApJ 857, 23, eqs. 12 and 15; Blackburn et al. 2020, ApJ 894, 31.
    pub fn new(samples: &Samples, used: &[bool], set: ClosureSet) -> Result<Self> {
        let closures = samples.formed(used, set, quadrangles, |[a, b, c, d]| [(a, b), (c, d), (a, c), (b, d)])?;
        let none = ChainError::NoData("no four antennas have data at one time: there are no closure amplitudes".into());
        ensure!(!closures.sides.is_empty(), none);
        let log = |sides: &[usize; 4]| sides.iter().zip(SIGNS).map(|(k, s)| s * samples.vis()[*k].norm().ln()).sum();
        Ok(Self { log: closures.sides.iter().map(log).collect(), closures })
    }
}

impl VisibilityTerm for ClosureAmplitudes {
    fn name(&self) -> &'static str {
        "log closure amplitudes"
    }

    /// Independent ones.
    fn data(&self) -> usize {
        self.closures.independent
    }

    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64 {
        let mut sum = 0.0;
        for ((sides, log), w) in self.closures.sides.iter().zip(&self.log).zip(&self.closures.weight) {
            let power = sides.map(|k| model[k].norm_sqr().max(f64::MIN_POSITIVE));
            let d = 0.5 * (power[0] / power[2] * (power[1] / power[3])).ln() - log;
            sum += w * d * d;
            if weight != 0.0 {
                let step = 2.0 * weight * w * d;
                for ((k, p), sign) in sides.iter().zip(power).zip(SIGNS) {
                    gradient[*k] += model[*k] * (sign * step / p);
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::fixture::{corrupted, model, samples, with};
    use super::*;
    use crate::misfit::check::gradient_error;
    use num_complex::Complex64;

    fn term(s: &Samples, set: ClosureSet) -> ClosureAmplitudes {
        ClosureAmplitudes::new(s, &vec![true; s.len()], set).unwrap()
    }

    fn chi2(t: &ClosureAmplitudes, m: &[Complex64]) -> f64 {
        t.add(m, 0.0, &mut vec![Complex64::default(); m.len()])
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let s = samples(6, 2);
        for set in [ClosureSet::Minimal, ClosureSet::All] {
            assert!(gradient_error(&term(&s, set), &model(&s)) < 1e-6, "{set:?}");
        }
    }

    #[test]
    fn the_data_fit_themselves_whatever_the_gains_of_the_antennas() {
        let s = samples(7, 3);
        let gains = |t: usize, a: usize| Complex64::from_polar(0.3 + 0.2 * ((a + t) % 5) as f64, (t * 7 + a * a) as f64);
        for set in [ClosureSet::Minimal, ClosureSet::All] {
            let t = term(&s, set);
            assert!(chi2(&t, &corrupted(&s, s.vis(), gains)) < 1e-9);
            assert!(chi2(&t, &model(&s)) > 1.0);
        }
    }

    #[test]
    fn noise_gives_one_a_datum_in_both_sets() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let s = samples(7, 300);
        let noisy = s.vis().iter().zip(s.sigma()).map(|(v, s)| v + Complex64::new(s * normal(), s * normal())).collect();
        let noisy = with(&s, noisy);
        for set in [ClosureSet::Minimal, ClosureSet::All] {
            let t = term(&noisy, set);
            let each = chi2(&t, s.vis()) / t.data() as f64;
            assert!((each - 1.0).abs() < 0.05, "{set:?} {each}");
        }
    }

    #[test]
    fn three_antennas_are_too_few() {
        let s = samples(3, 2);
        let e = ClosureAmplitudes::new(&s, &vec![true; s.len()], ClosureSet::All).unwrap_err();
        assert!(e.to_string().contains("four antennas"), "{e}");
    }
}
