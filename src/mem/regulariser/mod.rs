//! What makes one image better than another where the data leave a choice: penalties on a positive image, one a file, and their sum.
//!
//! A penalty is the negative of an entropy, has the unit of flux, and is smallest at the most featureless image.

mod burg;
mod gull_skilling;
mod l1;
mod relative;
mod total_variation;

pub use burg::Burg;
pub use gull_skilling::GullSkilling;
pub use l1::L1;
pub use relative::RelativeEntropy;
pub use total_variation::TotalVariation;

use crate::{ChainError, Result};
use ndarray::Array2;
use std::fmt::Debug;

/// Images below this part of the prior count as this much, so that no logarithm is of 0.
const FLOOR: f64 = 1e-250;

/// A penalty on a positive image.
pub trait Regulariser: Debug + Send + Sync {
    /// A short name for options and reports.
    fn name(&self) -> &'static str;

    /// The penalty of an image in flux a pixel \[m, l\], in flux.
    ///
    /// Adds `weight` times the derivative by each pixel to `gradient`, and `weight` times the second derivative, where that is not
    /// negative, to `curvature`.
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64;
}

/// A row of the table of entropies: each is made from a prior image.
#[derive(Debug)]
pub struct Entry {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Make it from a prior \[m, l\], flux a pixel, that [`check_prior`] has passed.
    pub make: fn(Array2<f64>) -> Box<dyn Regulariser>,
}

/// Entropies by name; the first is the default.
pub const ENTROPIES: [Entry; 3] = [
    Entry { name: "relative", about: "-sum I (ln(I/M) - 1)", make: |m| Box::new(RelativeEntropy::new(m)) },
    Entry { name: "gull-skilling", about: "sum I - M - I ln(I/M), which is 0 at the prior", make: |m| Box::new(GullSkilling::new(m)) },
    Entry { name: "log", about: "sum M (ln(I/M) - I/M + 1), Burg's", make: |m| Box::new(Burg::new(m)) },
];

/// An entropy of the table.
///
/// # Errors
/// A name that is not in it.
pub fn entropy_by_name(name: &str) -> Result<&'static Entry> {
    ENTROPIES.iter().find(|e| e.name == name).ok_or_else(|| {
        let names: Vec<&str> = ENTROPIES.iter().map(|e| e.name).collect();
        ChainError::BadOption { option: "--entropy", value: format!("{name:?}"), expected: names.join(", ") }
    })
}

/// Refuse a prior that no positive image can be compared with.
///
/// # Errors
/// A pixel that is not positive and finite, inside the mask where there is one.
pub fn check_prior(prior: &Array2<f64>, inside: Option<&Array2<bool>>) -> Result<()> {
    let bad = |((i, j), v): &((usize, usize), &f64)| !(**v > 0.0 && v.is_finite()) && inside.is_none_or(|m| m[(*i, *j)]);
    match prior.indexed_iter().find(bad) {
        None => Ok(()),
        Some(((row, column), v)) => Err(ChainError::BadOption {
            option: "--prior",
            value: format!("{v} at column {column}, row {row}"),
            expected: "a prior that is positive and finite in every pixel".into(),
        }),
    }
}

/// A weighted sum of penalties.
#[derive(Debug, Default)]
pub struct WeightedSum(Vec<(f64, Box<dyn Regulariser>)>);

impl WeightedSum {
    /// The first penalty with weight 1.
    #[must_use]
    pub fn of(first: Box<dyn Regulariser>) -> Self {
        Self(vec![(1.0, first)])
    }

    /// One more.
    ///
    /// # Errors
    /// A weight that is negative or not finite.
    pub fn and(mut self, weight: f64, next: Box<dyn Regulariser>) -> Result<Self> {
        if !(weight >= 0.0 && weight.is_finite()) {
            let expected = format!("a weight of 0 or more for {}", next.name());
            return Err(ChainError::BadOption { option: "regulariser", value: weight.to_string(), expected });
        }
        self.0.push((weight, next));
        Ok(self)
    }

    /// Names and weights.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.0.iter().map(|(w, r)| (r.name(), *w))
    }
}

impl Regulariser for WeightedSum {
    fn name(&self) -> &'static str {
        "sum"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64 {
        self.0.iter().map(|(w, r)| w * r.add(image, weight * w, gradient, curvature)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(prior: &Array2<f64>) -> Vec<Box<dyn Regulariser>> {
        let mut all: Vec<Box<dyn Regulariser>> = ENTROPIES.iter().map(|e| (e.make)(prior.clone())).collect();
        all.push(Box::new(TotalVariation::new(0.3).unwrap()));
        all.push(Box::new(L1));
        let sum = WeightedSum::of(Box::new(RelativeEntropy::new(prior.clone())));
        all.push(Box::new(sum.and(0.4, Box::new(TotalVariation::new(0.2).unwrap())).unwrap().and(2.0, Box::new(L1)).unwrap()));
        all
    }

    fn at(r: &dyn Regulariser, image: &Array2<f64>) -> (f64, Array2<f64>, Array2<f64>) {
        let (mut g, mut c) = (Array2::zeros(image.dim()), Array2::zeros(image.dim()));
        let value = r.add(image, 1.0, &mut g, &mut c);
        (value, g, c)
    }

    #[test]
    fn gradients_and_curvatures_agree_with_finite_differences() {
        let prior = Array2::from_shape_fn((4, 5), |(i, j)| 1.0 + 0.1 * (i * 3 + j) as f64);
        let image = Array2::from_shape_fn((4, 5), |(i, j)| 0.5 + ((i * 5 + j * 7) % 6) as f64 * 0.4);
        for r in all(&prior) {
            let (_, gradient, curvature) = at(&*r, &image);
            for ((i, j), v) in image.indexed_iter() {
                let h = 1e-4 * v;
                let moved = |x: f64| {
                    let mut m = image.clone();
                    m[(i, j)] += x;
                    at(&*r, &m)
                };
                let slope = (8.0 * (moved(h).0 - moved(-h).0) - (moved(2.0 * h).0 - moved(-2.0 * h).0)) / (12.0 * h);
                let g = gradient[(i, j)];
                assert!((slope - g).abs() < 1e-7 * (1.0 + g.abs()), "{} at {i} {j}: {slope} {g}", r.name());
                let bend = (moved(h).1[(i, j)] - moved(-h).1[(i, j)]) / (2.0 * h);
                let c = curvature[(i, j)];
                // The curvature of total variation is a bound; all others are exact.
                let exact = !r.name().contains("variation") && r.name() != "sum";
                assert!(c >= bend - 1e-5 && (!exact || (bend - c).abs() < 1e-5 * (1.0 + c)), "{} at {i} {j}: {bend} {c}", r.name());
            }
        }
    }

    #[test]
    fn entropies_are_best_at_their_prior_and_know_black_pixels() {
        let prior = Array2::from_shape_fn((3, 4), |(i, j)| 1.0 + (i + j) as f64);
        for entry in &ENTROPIES {
            let r = (entry.make)(prior.clone());
            let (best, gradient, _) = at(&*r, &prior);
            assert!(gradient.iter().all(|g| g.abs() < 1e-12), "{}", entry.name);
            for factor in [0.5, 1.5] {
                assert!(at(&*r, &(&prior * factor)).0 > best, "{}", entry.name);
            }
            let (value, gradient, curvature) = at(&*r, &Array2::zeros((3, 4)));
            assert!(value.is_finite() && gradient.iter().chain(&curvature).all(|x| !x.is_nan()), "{}", entry.name);
        }
        assert_eq!(at(&GullSkilling::new(prior.clone()), &prior).0, 0.0);
    }

    #[test]
    fn bad_priors_weights_and_names_are_refused() {
        for v in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut prior = Array2::ones((2, 3));
            prior[(1, 2)] = v;
            let text = check_prior(&prior, None).unwrap_err().to_string();
            assert!(text.contains("--prior") && text.contains("column 2, row 1"), "{text}");
            let mut inside = Array2::from_elem((2, 3), true);
            inside[(1, 2)] = false;
            assert!(check_prior(&prior, Some(&inside)).is_ok());
        }
        assert!(WeightedSum::of(Box::new(L1)).and(-1.0, Box::new(L1)).is_err());
        assert!(entropy_by_name("tsallis").unwrap_err().to_string().contains("gull-skilling"));
        assert!(TotalVariation::new(0.0).is_err());
    }
}
