//! The standard deviation of each pixel, from the diagonal of the inverse Hessian.
//!
//! With chi2 / 2 as minus the logarithm of the likelihood and R / lambda as that of the prior, the Hessian at the solution is H = A^T W A +
//! diag(R'') / lambda, and the standard deviation of a pixel is the root of the diagonal of its inverse. The circulant approximation gives
//! this as a function of the brightness I of the pixel and of the response of the elements there: where the response falls, the standard
//! deviation grows to that of the prior. Random signs give it for the true Hessian. With n vectors of random signs the
//! relative error is 1 / sqrt(2 n).
//!
//! # Reference
//! Bekas, Kokiopoulou & Saad 2007, Appl. Numer. Math. 57, 1214 (the diagonal from probes); Hutchinson 1990, Commun. Stat. 19, 433.

use super::beam::BeamHessian;
use super::control::Effort;
use super::newton::NewtonSystem;
use super::objective::{Multipliers, Objective, Point, brightness};
use super::response::Response;
use super::smoothness::Smoothness;
use crate::Result;
use crate::values::{by_text, need};
use ndarray::{Array2, Zip};
use rand::{RngExt, SeedableRng};
use std::fmt;
use std::str::FromStr;

/// Points of the table of the circulant approximation.
const TABLE: usize = 64;
/// Weights of the links of a smoothness that have a table each, doubling from one to the next.
const WEIGHTS: [f64; 8] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// How exactly the system is solved for a probe.
const EXACT: Effort = Effort { tolerance: 1e-2, steps: 100 };
/// Tolerance of the solution for the single probe that scales the circulant map.
const ROUGH: Effort = Effort { tolerance: 0.05, steps: 60 };

/// How the map of uncertainties is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Uncertainty {
    /// No map.
    None,
    /// The map of the circulant approximation next to the beam, scaled to the total variance of one random probe. It takes as long as one or
    /// two steps.
    #[default]
    Beam,
    /// From this number of random probes.
    Probes(usize),
}
by_text!(Uncertainty, ["string", "integer"], "none, beam, or a number of random probes up to 10000.");

impl fmt::Display for Uncertainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Beam => f.write_str("beam"),
            Self::Probes(n) => n.fmt(f),
        }
    }
}

impl FromStr for Uncertainty {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match (text, text.parse::<usize>()) {
            ("none", _) | (_, Ok(0)) => Ok(Self::None),
            ("beam", _) => Ok(Self::Beam),
            (_, Ok(n)) if n <= 10_000 => Ok(Self::Probes(n)),
            _ => Err(format!("{text:?} is not a map: use none, beam or a number of probes up to 10000")),
        }
    }
}

/// Standard deviation of each pixel \[m, l\], flux per pixel. The probes have their own seed. `None` if it is not requested or the data have no beam.
///
/// # Errors
/// The number of probes is 0.
pub fn uncertainty(o: &Objective<'_>, point: &Point, m: &Multipliers, (how, seed): (Uncertainty, u64)) -> Result<Option<Array2<f64>>> {
    let Some(beam) = &o.beam else { return Ok(None) };
    let smoothness = o.smoothness.as_ref().map(|links| links.supported(o.chi2.response()));
    let links = smoothness.as_ref();
    match how {
        Uncertainty::None => Ok(None),
        Uncertainty::Beam => {
            // The circulant gives some weight to spatial frequencies without data, which makes the map too small everywhere.
            let probe = Probe::new((beam, o.chi2.response(), links), point, m, 1)?.next(ROUGH)?;
            let mut true_sum = 0.0;
            Zip::from(&point.s).and(&probe).for_each(|s, p| true_sum += m.lambda * brightness(*s) * f64::from(*p));
            drop(probe);
            // The variance of a pixel with x = I / (I R'') and the response r is lambda x times the mean over the spectrum of
            // 1 / (1 + lambda x r^2 k).
            let x = |s: f32, e: f32| if s != 0.0 { m.lambda * brightness(s) / f64::from(e).max(1e-6) } else { 0.0 };
            let ones;
            let response = match o.chi2.response().plane() {
                Some(plane) => plane.view(),
                None => {
                    ones = ndarray::arr2(&[[1.0_f32]]);
                    ones.broadcast(point.s.dim()).ok_or_else(|| crate::ChainError::Internal("one number fills no image".into()))?
                }
            };
            let seen = |x: f64, r: f32| x * f64::from(r * r);
            let scale = beam.diagonal();
            let (mut lo, mut hi) = (f64::INFINITY, 0.0_f64);
            Zip::from(&point.s).and(&point.stiffness).and(&response).for_each(|s, e, r| {
                let x = seen(x(*s, *e), *r);
                if x > 0.0 {
                    (lo, hi) = (lo.min(x), hi.max(x));
                }
            });
            if !(hi > 0.0) {
                return Ok(Some(Array2::zeros(point.s.dim())));
            }
            // The data do not constrain pixels below a millionth of the brightest pixel.
            let (from, to) = (lo.max(1e-9 * hi).ln(), hi.ln());
            let at = |k: usize| from + (to - from) * k as f64 / (TABLE - 1) as f64;
            // A smooth scene is bright everywhere, so one mean of lambda x serves all pixels. The weights of the links differ.
            let smooth = links.map(|links| {
                let mut sum = 0.0;
                Zip::from(&point.s).and(&point.stiffness).for_each(|s, e| sum += x(*s, *e));
                (beam.differences(), links.even_stencil() * sum / (m.lambda * point.s.len() as f64))
            });
            let tables: Vec<Vec<f64>> = match &smooth {
                None => vec![(0..TABLE).map(|k| beam.mean_damping(at(k).exp() * scale)).collect()],
                Some((differences, t)) => {
                    WEIGHTS.map(|w| (0..TABLE).map(|k| beam.mean_damping_with(at(k).exp() * scale, differences, *t * w)).collect()).to_vec()
                }
            };
            // By interpolation along a table, and between those of two weights.
            let along = |table: &[f64], x: f64| {
                let place = ((x.max(f64::MIN_POSITIVE).ln() - from) / (to - from).max(1e-12)).clamp(0.0, 1.0) * (TABLE - 1) as f64;
                let k = (place as usize).min(TABLE - 2);
                let f = place - k as f64;
                table[k] * (1.0 - f) + table[k + 1] * f
            };
            let mut out = Array2::zeros(point.s.dim());
            Zip::indexed(&mut out).and(&point.s).and(&point.stiffness).and(&response).par_for_each(|place, o, s, e, r| {
                let x = x(*s, *e);
                if x > 0.0 {
                    let mean = match links {
                        None => along(&tables[0], seen(x, *r)),
                        Some(links) => {
                            let w = (links.weight(place).max(f64::MIN_POSITIVE) / WEIGHTS[0]).log2().clamp(0.0, (WEIGHTS.len() - 1) as f64);
                            let k = (w as usize).min(WEIGHTS.len() - 2);
                            let f = w - k as f64;
                            along(&tables[k], seen(x, *r)) * (1.0 - f) + along(&tables[k + 1], seen(x, *r)) * f
                        }
                    };
                    *o = (x * mean).sqrt();
                }
            });
            let sum: f64 = out.iter().map(|o| o * o).sum();
            if true_sum > 0.0 && sum > 0.0 {
                out *= (true_sum / sum).sqrt();
            }
            Ok(Some(out))
        }
        Uncertainty::Probes(n) => {
            need("uncertainty", "0 probes", n > 0, "1 probe or more")?;
            let mut probes = Probe::new((beam, o.chi2.response(), links), point, m, seed)?;
            let mut sum = Array2::<f64>::zeros(point.s.dim());
            for _ in 0..n {
                Zip::from(&mut sum).and(&probes.next(EXACT)?).for_each(|s, p| *s += f64::from(*p));
            }
            // H in I is D^-1 (E + lambda D H D) D^-1 / lambda: the variance is lambda D (...)^-1 D.
            Zip::from(&mut sum).and(&point.s).for_each(|v, s| *v = (m.lambda * brightness(*s) * (*v / n as f64).max(0.0)).sqrt());
            Ok(Some(sum))
        }
    }
}

/// Random signs times the inverse applied to them.
struct Probe<'a> {
    system: NewtonSystem<'a>,
    rng: rand_chacha::ChaCha8Rng,
    shape: (usize, usize),
}

impl<'a> Probe<'a> {
    fn new(parts: (&'a BeamHessian, &Response, Option<&'a Smoothness>), point: &'a Point, m: &Multipliers, seed: u64) -> Result<Self> {
        let shape = point.s.dim();
        let system = NewtonSystem::new(parts, point, Array2::zeros(shape), m)?;
        Ok(Self { system, rng: rand_chacha::ChaCha8Rng::seed_from_u64(seed), shape })
    }

    fn next(&mut self, effort: Effort) -> Result<Array2<f32>> {
        let v = Array2::from_shape_fn(self.shape, |_| if self.rng.random::<bool>() { 1.0 } else { -1.0 });
        let (x, _) = self.system.solve(v.clone(), effort)?;
        Ok(v * x)
    }
}
