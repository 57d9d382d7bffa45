//! Smoothness: pixels that lie near each other are expected to be alike.
//!
//! The brightness of natural scenes has a power spectrum that falls as the square of the spatial frequency (Burton & Moorhead 1987; Field 1987). A Gaussian
//! field with the spectrum a^2 / (1 + (k / k0)^2) has minus the logarithm of its probability (1/2) sum (x^2 + |grad x|^2 / (2 pi k0)^2) / a^2. The first
//! term is what the entropy is for small departures x from the prior, and this penalty is the second.
//!
//! Real scenes are not Gaussian: they have few edges and much between them, so that their gradients follow Laplace's law more nearly (Field 1994). A Laplace law
//! with the variance 1 / a of each component has minus the logarithm sqrt(2 a) |grad x|. It is the least upper parabola of weight sqrt(2 / a) / |grad x| that
//! touches it where the image is, so a solution with the weights of the image before it comes closer to it (iteratively reweighted least squares).
//!
//! # Reference
//! Burton & Moorhead 1987, Appl. Opt. 26, 157; Field 1987, J. Opt. Soc. Am. A 4, 2379 (the spectrum); Field 1994, Neural Computation 6, 559 (the gradients);
//! Holland & Welsch 1977, Commun. Stat. A 6, 813 (the weights); Gull 1989, in Maximum Entropy and Bayesian Methods, 53 (why an entropy needs the correlation of
//! neighbours).

use super::response::Response;
use crate::Result;
use crate::values::need;
use ndarray::{ArcArray2, Array2, ArrayViewMut1, Axis, Zip};
use rayon::prelude::*;

/// The sum of the squared differences of neighbours, each over the prior: unit strength / 2 sum (I_i / M_i - I_j / M_j)^2, in the unit of flux.
#[derive(Debug, Clone)]
pub struct Smoothness {
    prior: ArcArray2<f32>,
    inside: Option<Array2<bool>>,
    strength: f64,
    unit: f64,
    /// Weights of the links of a pixel with the next one along either axis \[m, l\], and their mean; `None` where all are 1.
    weights: Option<(Array2<f32>, f64)>,
}

/// Gradients below this part of the expected rms count by their square: a finer image cannot tell them from 0.
const SOFT: f64 = 0.3;

impl Smoothness {
    /// With the prior M \[m, l\] in flux a pixel, whose mean is `unit`. `strength` is 1 / (2 pi k0 cell)^2 for the frequency k0 at which the expected
    /// spectrum begins to fall. Pixels outside `inside` have no neighbours.
    ///
    /// # Errors
    /// A strength or unit that is not positive and finite.
    pub fn new(prior: ArcArray2<f32>, inside: Option<Array2<bool>>, strength: f64, unit: f64) -> Result<Self> {
        for (name, value) in [("strength of the smoothness", strength), ("mean prior", unit)] {
            need(name, value, value > 0.0 && value.is_finite(), "a positive number")?;
        }
        Ok(Self { prior, inside, strength, unit, weights: None })
    }

    /// Flux of the penalty for each square of a difference between neighbours of the mean prior, 1 / flux.
    #[must_use]
    pub fn stencil(&self) -> f64 {
        self.strength / self.unit * self.weights.as_ref().map_or(1.0, |w| w.1)
    }

    /// Give the links the weights of Laplace's law at an image \[m, l\], where `lambda` is the multiplier of chi squared in units of the mean prior.
    pub(crate) fn reweight(&mut self, image: &Array2<f64>, lambda: f64) {
        let variance = lambda / self.strength;
        let (n_m, n_l) = image.dim();
        let at = |place: (usize, usize)| self.inverse(place).map(|m| image[place] * f64::from(m));
        let weights = Array2::from_shape_fn((n_m, n_l), |(i, j)| {
            let Some(here) = at((i, j)) else { return 0.0 };
            let step = |place: (usize, usize)| at(place).map_or(0.0, |there| there - here);
            let along = if j + 1 < n_l { step((i, j + 1)) } else { 0.0 };
            let across = if i + 1 < n_m { step((i + 1, j)) } else { 0.0 };
            (2.0 * variance / (along * along + across * across + SOFT * SOFT * variance)).sqrt() as f32
        });
        let mean = weights.iter().map(|w| f64::from(*w)).sum::<f64>() / weights.len().max(1) as f64;
        self.weights = Some((weights, mean));
    }

    /// Give all links the weight 1.
    pub(crate) fn even(&mut self) {
        self.weights = None;
    }

    /// The weights as the data support them: in full where the elements see all, and 1 where they see nothing. The law of gradients alone knows nothing of an image.
    pub(super) fn supported(&self, response: &Response) -> Self {
        let mut out = self.clone();
        if let (Some((weights, mean)), Some(plane)) = (&mut out.weights, response.plane()) {
            Zip::from(&mut *weights).and(plane).for_each(|w, r| *w = r * *w + (1.0 - r));
            *mean = weights.iter().map(|w| f64::from(*w)).sum::<f64>() / weights.len().max(1) as f64;
        }
        out
    }

    /// Weight of the links of a pixel.
    pub(super) fn weight(&self, at: (usize, usize)) -> f64 {
        self.weights.as_ref().map_or(1.0, |w| f64::from(w.0[at]))
    }

    /// Factor of the squared differences where weights are 1, 1 / flux.
    pub(super) fn even_stencil(&self) -> f64 {
        self.strength / self.unit
    }

    /// 1 over the prior of a pixel that has neighbours.
    fn inverse(&self, at: (usize, usize)) -> Option<f32> {
        let inside = self.inside.as_ref().is_none_or(|m| m[at]);
        let prior = self.prior[at];
        (inside && prior > 0.0).then(|| 1.0 / prior)
    }

    /// Add `weight` times the gradient at an image in flux a pixel \[m, l\]; the penalty itself. The penalty is a square, so its gradient is its Hessian times the
    /// image.
    pub fn bend(&self, weight: f64, image: impl Fn((usize, usize)) -> f64 + Sync, out: &mut Array2<f32>) -> f64 {
        let (n_m, n_l) = out.dim();
        let factor = self.strength * self.unit;
        // The scaled difference along a link, and the factor of its square. A link belongs to the pixel from which it goes on along l or m.
        let link = |from: (usize, usize), to: (usize, usize)| {
            let (here, there) = (self.inverse(from)?, self.inverse(to)?);
            Some((image(from) * f64::from(here) - image(to) * f64::from(there), factor * self.weight(from)))
        };
        // Each pixel sums over its links, so that all rows can be made at once.
        let row = |(i, mut line): (usize, ArrayViewMut1<'_, f32>)| {
            let mut sum = 0.0;
            for (j, out) in line.iter_mut().enumerate() {
                let Some(here) = self.inverse((i, j)) else { continue };
                let mut slope = 0.0;
                for to in [(i, j + 1), (i + 1, j)].into_iter().filter(|to| to.0 < n_m && to.1 < n_l) {
                    let Some((difference, factor)) = link((i, j), to) else { continue };
                    sum += 0.5 * factor * difference * difference;
                    slope += factor * difference;
                }
                for from in [(i, j.wrapping_sub(1)), (i.wrapping_sub(1), j)].into_iter().filter(|from| from.0 < n_m && from.1 < n_l) {
                    let Some((difference, factor)) = link(from, (i, j)) else { continue };
                    slope -= factor * difference;
                }
                *out += (weight * slope * f64::from(here)) as f32;
            }
            sum
        };
        let sums: Vec<f64> = out.axis_iter_mut(Axis(0)).into_par_iter().enumerate().map(row).collect();
        sums.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_follow_the_law_of_laplace() {
        let prior = ArcArray2::from_elem((4, 40), 1.0_f32);
        let (strength, lambda) = (25.0_f64, 0.01_f64);
        let sigma = (lambda / strength).sqrt();
        let mut penalty = Smoothness::new(prior, None, strength, 1.0).unwrap();
        // A flat image with one step of `height` rms gradients.
        let image = |height: f64| Array2::from_shape_fn((4, 40), |(_, j)| 1.0 + if j < 20 { 0.0 } else { height * sigma });
        let cost = |penalty: &Smoothness, image: &Array2<f64>| penalty.bend(1.0, |at| image[at], &mut Array2::zeros((4, 40)));
        let even = cost(&penalty, &image(10.0));
        penalty.reweight(&image(10.0), lambda);
        // Half of sqrt(2) |g| / sigma for each row, in units of lambda: the parabola touches the law with twice its value's slope.
        let expected = 4.0 * lambda * 0.5 * 2.0_f64.sqrt() * 10.0;
        assert!((cost(&penalty, &image(10.0)) / expected - 1.0).abs() < 0.01, "{} {expected}", cost(&penalty, &image(10.0)));
        assert!(cost(&penalty, &image(10.0)) < 0.2 * even);
        // Where nothing is seen, a step costs more than before.
        assert!(penalty.stencil() > strength);
    }

    #[test]
    fn the_gradient_agrees_with_differences_of_the_penalty() {
        let prior = ArcArray2::from_shape_fn((5, 6), |(i, j)| 1.0 + 0.2 * ((i * 3 + j) % 4) as f32);
        let inside = Array2::from_shape_fn((5, 6), |(i, j)| (i, j) != (2, 3));
        let mut penalty = Smoothness::new(prior.clone(), Some(inside), 3.0, 1.3).unwrap();
        penalty.reweight(&Array2::from_shape_fn((5, 6), |(i, j)| ((i * 2 + j) % 5) as f64), 2.0);
        let image = Array2::from_shape_fn((5, 6), |(i, j)| 0.5 + ((i * 5 + j * 7) % 6) as f64 * 0.4);
        let at = |image: &Array2<f64>| {
            let mut gradient = Array2::zeros(image.dim());
            (penalty.bend(1.0, |at| image[at], &mut gradient), gradient)
        };
        let (_, gradient) = at(&image);
        for (place, g) in gradient.indexed_iter() {
            let moved = |h: f64| {
                let mut m = image.clone();
                m[place] += h;
                at(&m).0
            };
            let slope = (moved(0.1) - moved(-0.1)) / 0.2;
            assert!((slope - f64::from(*g)).abs() < 1e-5, "{place:?}: {slope} {g}");
        }
        assert!(gradient[(2, 3)] == 0.0);
        // Anything in proportion to the prior is as smooth as can be.
        assert!(at(&prior.mapv(|m| 2.0 * f64::from(m))).0 < 1e-12);
        assert!(Smoothness::new(prior.clone(), None, 0.0, 1.0).is_err() && Smoothness::new(prior, None, 1.0, f64::NAN).is_err());
    }
}
