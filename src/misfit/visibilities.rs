//! Complex visibilities with their weights: chi2 = sum of w |V - model|^2.

use super::term::VisibilityTerm;
use crate::{ChainError, Result, ensure};
use cittert_arrays::ArrayError;
use num_complex::{Complex, Complex32};
use rayon::prelude::*;

/// Number of data that one task sums. It is large compared with the cost of starting a task, and small enough that all threads have work.
const SHARE: usize = 1 << 14;

/// Measured visibilities. Those of weight 0 are not used.
#[derive(Debug, Clone)]
pub struct Visibilities {
    vis: Vec<Complex32>,
    weight: Vec<f32>,
    used: usize,
}

impl Visibilities {
    /// Visibilities \[n\] and their weights 1/sigma^2 \[n\], sigma being that of the real and of the imaginary part.
    ///
    /// # Errors
    /// Lists of different lengths, negative weights, no datum with a positive weight, a datum that has a weight and is not finite.
    pub fn new(vis: Vec<Complex32>, weight: Vec<f32>) -> Result<Self> {
        if vis.len() != weight.len() {
            let (expected, found) = (vec![vis.len()], vec![weight.len()]);
            return Err(ArrayError::ShapeMismatch { what: "weights of the data term", expected, found }.into());
        }
        let bad = |(v, w): &(&Complex32, &f32)| !(**w >= 0.0 && w.is_finite()) || (**w > 0.0 && !v.is_finite());
        if let Some((v, w)) = vis.iter().zip(&weight).find(bad) {
            let message = format!("visibility {v} with weight {w} in the data term, expected finite data with weights of 0 or more");
            return Err(ChainError::Incompatible(message));
        }
        let used = weight.iter().filter(|w| **w > 0.0).count();
        ensure!(used > 0, ChainError::NoData("no visibility has a weight: nothing constrains the image".into()));
        Ok(Self { vis, weight, used })
    }
}

impl VisibilityTerm for Visibilities {
    fn name(&self) -> &'static str {
        "visibilities"
    }

    fn data(&self) -> usize {
        2 * self.used
    }

    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64 {
        let parts = self.vis.par_chunks(SHARE).zip(self.weight.par_chunks(SHARE)).zip(model.par_chunks(SHARE));
        let sums: Vec<f64> = parts
            .zip(gradient.par_chunks_mut(SHARE))
            .map(|(((vis, w), model), gradient)| {
                let mut sum = 0.0;
                for (((v, w), m), g) in vis.iter().zip(w).zip(model).zip(gradient) {
                    if *w > 0.0 {
                        let w = f64::from(*w);
                        let d = Complex::new(m.re - f64::from(v.re), m.im - f64::from(v.im));
                        sum += w * d.norm_sqr();
                        *g += d * (2.0 * weight * w);
                    }
                }
                sum
            })
            .collect();
        // The sum has a fixed order, so that it is the same for any number of threads.
        sums.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::term::check::gradient_error;
    use super::*;

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        let vis: Vec<Complex32> = (0..9).map(|k| Complex32::from_polar(1.0 + k as f32, 0.7 * k as f32)).collect();
        let weight: Vec<f32> = (0..9).map(|k| (k % 4) as f32).collect();
        let model: Vec<Complex<f64>> = (0..9).map(|k| Complex::new(0.3 * f64::from(k), -0.1)).collect();
        let term = Visibilities::new(vis, weight).unwrap();
        assert_eq!(term.data(), 12);
        assert!(gradient_error(&term, &model) < 1e-8);
    }

    #[test]
    fn noise_of_the_stated_weight_gives_one_a_datum_and_flagged_data_count_for_nothing() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> f32 { StandardNormal.sample(&mut rng) };
        let n = 40_000;
        let mut vis: Vec<Complex32> = (0..n).map(|_| Complex32::new(2.0 + 0.5 * normal(), 0.5 * normal())).collect();
        let mut weight = vec![4.0; n];
        (vis[7], weight[7]) = (Complex32::new(f32::NAN, 0.0), 0.0);
        let term = Visibilities::new(vis, weight).unwrap();
        let model = vec![Complex::new(2.0, 0.0); n];
        let mut gradient = vec![Complex::default(); n];
        let chi2 = term.add(&model, 1.0, &mut gradient);
        assert!((chi2 / term.data() as f64 - 1.0).abs() < 0.02, "{chi2}");
        assert_eq!(gradient[7], Complex::default());
    }

    #[test]
    fn bad_data_are_refused() {
        let v = |n| vec![Complex32::new(1.0, 0.0); n];
        assert!(matches!(Visibilities::new(v(2), vec![1.0]), Err(ChainError::Array(_))));
        assert!(matches!(Visibilities::new(v(2), vec![0.0; 2]), Err(ChainError::NoData(_))));
        for w in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(Visibilities::new(v(1), vec![w]), Err(ChainError::Incompatible(_))));
        }
        assert!(matches!(Visibilities::new(vec![Complex32::new(f32::NAN, 0.0)], vec![1.0]), Err(ChainError::Incompatible(_))));
    }
}
