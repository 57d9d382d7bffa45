//! One term of chi squared over model visibilities.

use cittert_arrays::{Alone, Ranks};
use num_complex::Complex;
use std::sync::Arc;

/// A term of chi squared over model visibilities: value and gradient together.
///
/// The model is one flat list, row after row and channel after channel of the problem, in the unit of the data. Where several processes share the data,
/// each has the model of its own rows, and value and number are those of all.
pub trait VisibilityTerm: Send + Sync {
    /// A short name for reports.
    fn name(&self) -> &'static str;

    /// Number of real, independent data, which is the expected value of chi squared.
    fn data(&self) -> usize;

    /// Chi squared of the model visibilities \[n\].
    ///
    /// Adds `weight` (d chi2 / d Re V + i d chi2 / d Im V) to `gradient` \[n\].
    fn add(&self, model: &[Complex<f64>], weight: f64, gradient: &mut [Complex<f64>]) -> f64;

    /// The processes that share the data.
    fn ranks(&self) -> Arc<dyn Ranks> {
        Arc::new(Alone)
    }
}

#[cfg(test)]
pub(crate) mod check {
    //! Gradients against finite differences, for the tests of every term.

    use super::VisibilityTerm;
    use num_complex::Complex;

    /// Largest difference of the gradient from central differences, relative to the largest element of the gradient.
    pub(crate) fn gradient_error(term: &dyn VisibilityTerm, model: &[Complex<f64>]) -> f64 {
        let mut gradient = vec![Complex::default(); model.len()];
        term.add(model, 1.0, &mut gradient);
        let value = |m: &[Complex<f64>]| term.add(m, 0.0, &mut vec![Complex::default(); m.len()]);
        let mut worst = 0.0_f64;
        for k in 0..model.len() {
            for unit in [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0)] {
                let h = 1e-5 * (1.0 + model[k].norm());
                let at = |x: f64| {
                    let mut m = model.to_vec();
                    m[k] += unit * x;
                    value(&m)
                };
                // Five points: the error is of fourth order in h.
                let numeric = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let exact = gradient[k].re * unit.re + gradient[k].im * unit.im;
                worst = worst.max((numeric - exact).abs());
            }
        }
        worst / gradient.iter().map(|g| g.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }
}
