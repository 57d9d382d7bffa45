//! Closure phases: combinations of phases that antenna errors do not change.
//!
//! Chi squared of a difference d has two forms. `OneMinusCos` is 2 (1 - cos d) / sigma^2: it is smooth, exact for small errors and bounded
//! for large ones. `Wrapped` is d^2 / sigma^2 with d in -pi..pi, and has a corner at pi.

use super::samples::{Formed, Samples};
use crate::closure::{ClosureSet, triangles};
use crate::misfit::VisibilityTerm;
use crate::{ChainError, Result, ensure};
use num_complex::{Complex, Complex64};

/// Measured closure phases arg(V_ab V_bc V_ca), a < b < c.
#[derive(Debug, Clone)]
pub struct ClosurePhases {
    /// On V_ab, V_bc and V_ac.
    closures: Formed<3>,
    /// exp(i phase) of the data.
    phasor: Vec<Complex64>,
}

impl ClosurePhases {
    /// The closure phases of every time, from the entries that `used` \[n\] marks. Their variance is the sum of sigma^2 / |V|^2 over the
    /// three sides. A minimal set is formed around the antenna with the most information. With all triangles, the weight of each is
    /// multiplied by the number of independent triangles divided by the number of all triangles.
    ///
    /// # Errors
    /// No triangle with data.
    ///
    /// # Reference
    /// Chael et al. 2018, ApJ 857, 23, eqs. 11 and 13; Blackburn et al. 2020, ApJ 894, 31.
    pub fn new(samples: &Samples, used: &[bool], set: ClosureSet) -> Result<Self> {
        let closures = samples.formed(used, set, triangles, |[a, b, c]| [(a, b), (b, c), (a, c)])?;
        let none = ChainError::NoData("no triangle of antennas has data at one time: there are no closure phases".into());
        ensure!(!closures.sides.is_empty(), none);
        let phasor = |sides: &[usize; 3]| {
            let [ab, bc, ac] = sides.map(|k| samples.vis()[k]);
            let bispectrum = ab * bc * ac.conj();
            bispectrum / bispectrum.norm()
        };
        Ok(Self { phasor: closures.sides.iter().map(phasor).collect(), closures })
    }
}

impl VisibilityTerm for ClosurePhases {
    fn name(&self) -> &'static str {
        "closure phases"
    }

    /// Independent ones.
    fn data(&self) -> usize {
        self.closures.independent
    }

    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64 {
        let mut sum = 0.0;
        for ((sides, phasor), w) in self.closures.sides.iter().zip(&self.phasor).zip(&self.closures.weight) {
            let [ab, bc, ac] = sides.map(|k| model[k]);
            let b = ab * bc * ac.conj();
            let size = b.norm();
            if !(size > 0.0) {
                sum += 2.0 * w; // a model without flux has no phase: the mean over all phases
                continue;
            }
            let d = b * phasor.conj() / size;
            // 2 (1 - cos of the difference) is chi2, and 2 sin its derivative with respect to the model's closure phase.
            sum += w * 2.0 * (1.0 - d.re);
            if weight != 0.0 {
                let step = weight * w * 2.0 * d.im;
                for (k, v, sign) in [(sides[0], ab, 1.0), (sides[1], bc, 1.0), (sides[2], ac, -1.0)] {
                    // d arg V = Im(dV / V), so the gradient is i V / |V|^2.
                    gradient[k] += Complex::new(-v.im, v.re) * (sign * step / v.norm_sqr());
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

    fn term(s: &Samples, set: ClosureSet) -> ClosurePhases {
        ClosurePhases::new(s, &vec![true; s.len()], set).unwrap()
    }

    fn chi2(t: &ClosurePhases, m: &[Complex64]) -> f64 {
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
    fn the_data_fit_themselves_whatever_the_phases_of_the_antennas() {
        let s = samples(6, 3);
        let gains = |t: usize, a: usize| Complex64::from_polar(1.0 + 0.1 * a as f64, (t * 7 + a * a) as f64);
        let turned = corrupted(&s, s.vis(), gains);
        for set in [ClosureSet::Minimal, ClosureSet::All] {
            let t = term(&s, set);
            assert!(chi2(&t, &turned) < 1e-9, "{}", chi2(&t, &turned));
            assert!(chi2(&t, &model(&s)) > 1.0);
        }
        assert!(term(&s, ClosureSet::All).phasor.len() > term(&s, ClosureSet::Minimal).phasor.len());
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
            // With all triangles the noise of the closure phases is correlated. The mean does not change. Its scatter over 4,000 data is
            // below 0.04.
            assert!((each - 1.0).abs() < 0.05, "{set:?} {each}");
        }
    }

    #[test]
    fn too_few_antennas_are_said() {
        let s = samples(2, 2);
        let e = ClosurePhases::new(&s, &vec![true; s.len()], ClosureSet::Minimal).unwrap_err();
        assert!(e.to_string().contains("no triangle"), "{e}");
    }
}
