//! All terms of closure imaging as one function of the logarithm of the image.

use super::dft::SmallDft;
use super::penalty::Penalty;
use crate::misfit::VisibilityTerm;
use num_complex::Complex64;

/// The weighted sum of the terms (chi squared per datum) and of the penalties.
pub(super) struct Problem<'a> {
    pub transform: &'a SmallDft,
    pub terms: Vec<(f64, &'a dyn VisibilityTerm)>,
    pub penalty: &'a Penalty,
}

/// Larger logarithms come from steps that are much too long. The square of e^300 does not overflow.
const LARGEST_LOG: f64 = 300.0;

impl Problem<'_> {
    /// Value at ln I \[m * l\] and its gradient.
    pub(super) fn value(&self, log: &[f64], gradient: &mut [f64]) -> f64 {
        if log.iter().any(|x| !(x.abs() < LARGEST_LOG)) {
            return f64::INFINITY;
        }
        let image: Vec<f64> = log.iter().map(|x| x.exp()).collect();
        let vis = self.transform.forward(&image);
        let mut slope = vec![Complex64::default(); vis.len()];
        let mut value = 0.0;
        for (weight, term) in &self.terms {
            let each = weight / term.data().max(1) as f64;
            value += each * term.add(&vis, each, &mut slope);
        }
        gradient.copy_from_slice(&self.transform.adjoint(&slope));
        value += self.penalty.add(&image, gradient);
        gradient.iter_mut().zip(&image).for_each(|(g, i)| *g *= i);
        value
    }
}
