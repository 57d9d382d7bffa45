//! The objective J = lambda chi2 / 2 + R + beta (F - F0) + rho (F - F0)^2 / 2, which is minimised over positive images I = s^2 / 4.
//!
//! R is the penalty (minus the entropy) and F the total flux that the elements see: that of the image times their response. The variable s keeps the image positive and makes the metric of the entropy
//! the identity: d2R/ds2 is 1 for the relative entropy. lambda and beta are the Lagrange multipliers of chi squared and of the flux. rho is
//! the strength of the augmented Lagrangian. It does not change the solution, but beta is then found in a few steps.
//!
//! # Reference
//! Nocedal & Wright 2006, Numerical Optimization, sect. 17.3 (augmented Lagrangian).

use super::beam::BeamHessian;
use super::chi2::ChiSquared;
use super::regulariser::{Regulariser, WeightedSum};
use super::smoothness::Smoothness;
use crate::Result;
use ndarray::{Array2, Axis, Zip};
use rayon::prelude::*;

/// Curvature of the flux constraint in units of that of the entropy. It changes the number of steps, but not the solution.
const FLUX_STIFFNESS: f64 = 100.0;

/// All terms of the objective.
#[derive(Debug)]
pub struct Objective<'a> {
    /// Chi squared of the data.
    pub chi2: ChiSquared<'a>,
    /// The penalty.
    pub penalty: WeightedSum,
    /// The expectation that neighbours are alike, a penalty whose curvature is not diagonal.
    pub smoothness: Option<Smoothness>,
    /// The pixels where the image may be bright \[m, l\]. Without a mask these are all pixels.
    pub inside: Option<Array2<bool>>,
    /// Subtracted from the image before it is compared with the data \[m, l\], flux a pixel. An example is a pedestal that the data do not
    /// contain.
    pub offset: Option<Array2<f32>>,
    /// The total flux, where it is known.
    pub flux: Option<f64>,
    /// Curvature of the data term, where a beam describes it.
    pub beam: Option<BeamHessian>,
    /// Mean prior, flux per pixel. It is the natural unit of lambda.
    pub unit: f64,
}

/// Lagrange multipliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Multipliers {
    /// Of chi2 / 2, flux.
    pub lambda: f64,
    /// Of the total flux.
    pub beta: f64,
    /// Stiffness of the flux constraint, 1 / flux; 0 without one.
    pub rho: f64,
}

/// The objective at one image. Arrays \[m, l\] are in single precision, which is far below the error of the data term. All sums over them are
/// in double precision.
#[derive(Debug, Clone)]
pub struct Point {
    /// The variable, +- 2 sqrt(I), where I is the image in flux a pixel.
    pub s: Array2<f32>,
    /// Chi squared.
    pub chi2: f64,
    /// Half of the gradient of chi squared by the image.
    pub slope: Array2<f32>,
    /// The penalty.
    pub penalty: f64,
    /// Its gradient.
    pub penalty_slope: Array2<f32>,
    /// Image times second derivative of the penalty: its curvature in s.
    pub stiffness: Array2<f32>,
    /// Sum of the image times the response of the elements.
    pub flux: f64,
}

impl Point {
    /// The image, flux a pixel \[m, l\].
    #[must_use]
    pub fn image(&self) -> Array2<f64> {
        bright(&self.s)
    }
}

/// The image at the values of the variable.
fn bright(s: &Array2<f32>) -> Array2<f64> {
    Zip::from(s).par_map_collect(|s| brightness(*s))
}

/// The image at a value of the variable.
pub(super) fn brightness(s: f32) -> f64 {
    0.25 * f64::from(s) * f64::from(s)
}

impl Objective<'_> {
    /// Stiffness of the flux constraint.
    #[must_use]
    pub fn rho(&self) -> f64 {
        self.flux.map_or(0.0, |f| FLUX_STIFFNESS / f)
    }

    /// The variable s of an image; pixels outside the mask become 0.
    #[must_use]
    pub fn variable(&self, image: &Array2<f64>) -> Array2<f32> {
        let mut s = Zip::from(image).par_map_collect(|v| (2.0 * v.max(0.0).sqrt()) as f32);
        self.darken(&mut s);
        s
    }

    /// Set the pixels outside the mask to 0.
    pub(super) fn darken<T: Default>(&self, values: &mut Array2<T>) {
        if let Some(inside) = &self.inside {
            Zip::from(values).and(inside).for_each(|v, inside| {
                if !*inside {
                    *v = T::default();
                }
            });
        }
    }

    /// What the data see of an image \[m, l\]: the image without the offset.
    #[must_use]
    pub fn seen(&self, mut image: Array2<f64>) -> Array2<f64> {
        if let Some(offset) = &self.offset {
            Zip::from(&mut image).and(offset).par_for_each(|i, o| *i -= f64::from(*o));
        }
        image
    }

    /// All values and gradients at `s`. This takes one evaluation of the data term.
    ///
    /// # Errors
    /// Values that are not finite.
    pub fn evaluate(&mut self, s: Array2<f32>) -> Result<Point> {
        let model = self.seen(bright(&s));
        let misfit = self.chi2.evaluate(model.into())?;
        let slope = Zip::from(&misfit.gradient).par_map_collect(|g| (0.5 * g) as f32);
        drop(misfit.gradient);
        Ok(self.assemble(s, misfit.chi2, slope))
    }

    /// A point whose chi squared and gradient are known already.
    pub(super) fn assemble(&self, s: Array2<f32>, chi2: f64, slope: Array2<f32>) -> Point {
        let image = bright(&s);
        let (mut penalty_slope, mut stiffness) = (Array2::zeros(image.dim()), Array2::zeros(image.dim()));
        let mut penalty = self.penalty.add(&image, 1.0, &mut penalty_slope, &mut stiffness);
        if let Some(smoothness) = &self.smoothness {
            penalty += smoothness.bend(1.0, |at| image[at], &mut penalty_slope);
        }
        Zip::from(&mut stiffness).and(&image).par_for_each(|c, i| {
            if !(*i > 0.0) {
                *c = 1.0
            }
        });
        let flux = self.chi2.response().total(&image);
        Point { s, chi2, slope, penalty, penalty_slope, stiffness, flux }
    }

    /// Departure of the flux from its constraint; 0 without one.
    #[must_use]
    pub fn excess(&self, point: &Point) -> f64 {
        self.flux.map_or(0.0, |f| point.flux - f)
    }

    /// The objective J.
    #[must_use]
    pub fn value(&self, point: &Point, m: &Multipliers) -> f64 {
        let excess = self.excess(point);
        0.5 * m.lambda * point.chi2 + point.penalty + excess * (m.beta + 0.5 * m.rho * excess)
    }

    /// dJ/dI for each pixel.
    #[must_use]
    pub fn residual(&self, point: &Point, m: &Multipliers) -> Array2<f32> {
        let beta = m.beta + m.rho * self.excess(point);
        let response = self.chi2.response();
        let common = if response.is_one() { beta } else { 0.0 };
        let mut out = point.slope.clone();
        Zip::from(&mut out).and(&point.penalty_slope).par_for_each(|o, p| *o = (m.lambda * f64::from(*o) + f64::from(*p) + common) as f32);
        response.add_to(beta, &mut out);
        out
    }

    /// dJ/ds.
    #[must_use]
    pub fn gradient(&self, point: &Point, m: &Multipliers) -> Array2<f32> {
        let mut out = self.residual(point, m);
        Zip::from(&mut out).and(&point.s).par_for_each(|o, s| *o *= 0.5 * s);
        out
    }

    /// The residual of the Karush-Kuhn-Tucker conditions: the length of the gradient of J over the sum of the lengths of its data side and
    /// its entropy side, in the metric of the entropy. It is 0 at the solution and near 1 where the two sides do not balance.
    #[must_use]
    pub fn kkt(&self, point: &Point, m: &Multipliers) -> f64 {
        let beta = m.beta + m.rho * self.excess(point);
        let with_flux;
        let (sides, common) = match self.chi2.response().plane().filter(|_| beta != 0.0) {
            // Without a flux constraint beta is 0.
            None => (&point.penalty_slope, beta),
            Some(_) => {
                let mut side = point.penalty_slope.clone();
                self.chi2.response().add_to(beta, &mut side);
                with_flux = side;
                (&with_flux, 0.0)
            }
        };
        let pixel = |sums: [f64; 3], ((s, g), p): ((&f32, &f32), &f32)| {
            let (i, a, b) = (brightness(*s), m.lambda * f64::from(*g), f64::from(*p) + common);
            add(sums, [i * (a + b) * (a + b), i * a * a, i * b * b])
        };
        let rows = point.s.axis_iter(Axis(0)).into_par_iter().zip(point.slope.axis_iter(Axis(0))).zip(sides.axis_iter(Axis(0)));
        let sums: Vec<[f64; 3]> = rows.map(|((s, g), p)| s.iter().zip(g).zip(p).fold([0.0; 3], pixel)).collect();
        let [all, data, prior] = sums.into_iter().fold([0.0; 3], add);
        let sides = data.sqrt() + prior.sqrt();
        if sides > 0.0 { all.sqrt() / sides } else { 0.0 }
    }
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// In single precision.
pub(crate) fn single(values: Array2<f64>) -> Array2<f32> {
    Zip::from(&values).par_map_collect(|v| *v as f32)
}
