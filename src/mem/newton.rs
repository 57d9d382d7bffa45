//! The Newton direction in s: conjugate gradients on the beam's Hessian, with a circulant in place of its inverse.
//!
//! The Hessian of J is E + lambda D H D + rho D 1 1^T D, with D = s / 2, H the beam, and E diagonal. Bright and dark pixels differ
//! by orders of magnitude in D, which no circulant knows. So the inverse is blended: the circulant's for the mean brightness where
//! pixels are bright, that of E alone where they are dark.
//!
//! # Reference
//! Nocedal & Wright 2006, Numerical Optimization, alg. 7.1 (inexact Newton).

use super::beam::BeamHessian;
use super::objective::{Multipliers, Point};
use crate::fourier::Spectrum;
use ndarray::{Array2, Zip};

/// Part of the mean brightness at which a pixel counts half as bright, half as dark.
const HALF_BRIGHT: f32 = 0.1;

/// The linear system of one Newton step.
pub(super) struct NewtonSystem<'a> {
    beam: &'a BeamHessian,
    /// s / 2.
    d: Array2<f32>,
    /// Curvature of everything but the data.
    e: Array2<f32>,
    /// lambda times the diagonal of the beam's Hessian.
    weight: f32,
    rho: f32,
    bright: Array2<f32>,
    circulant: Spectrum<f32>,
}

fn dot(a: &Array2<f32>, b: &Array2<f32>) -> f64 {
    let mut sum = 0.0;
    Zip::from(a).and(b).for_each(|a, b| sum += f64::from(*a) * f64::from(*b));
    sum
}

impl<'a> NewtonSystem<'a> {
    /// At a point; `residual` is dJ/dI there.
    pub(super) fn new(beam: &'a BeamHessian, point: &Point, residual: &Array2<f64>, m: &Multipliers) -> Self {
        let d = point.s.mapv(|s| (0.5 * s) as f32);
        let mut e = point.stiffness.mapv(|c| c as f32);
        // Where the image must come down the parametrisation adds stiffness; where it must rise it would take some away.
        Zip::from(&mut e).and(residual).for_each(|e, r| *e = (*e + (0.5 * r).clamp(0.0, 1e6) as f32).max(1e-4));
        let weight = (m.lambda * beam.diagonal()) as f32;
        let (mut first, mut second) = (0.0, 0.0);
        Zip::from(&d).and(&e).for_each(|d, e| {
            let x = f64::from(d * d / e);
            first += x;
            second += x * x;
        });
        let mean = if first > 0.0 { (second / first) as f32 } else { 0.0 };
        let mut bright = Array2::zeros(d.dim());
        Zip::from(&mut bright).and(&d).and(&e).for_each(|b, d, e| {
            let x = d * d / e;
            *b = if x > 0.0 { (x / (x + HALF_BRIGHT * mean)).sqrt() } else { 0.0 };
        });
        let circulant = beam.damping(weight * mean);
        Self { beam, d, e, weight, rho: m.rho as f32, bright, circulant }
    }

    fn hessian(&self, v: &Array2<f32>) -> Array2<f32> {
        let seen = v * &self.d;
        let common = self.rho * seen.iter().map(|x| f64::from(*x)).sum::<f64>() as f32;
        let mut out = self.beam.apply(seen.view());
        Zip::from(&mut out).and(v).and(&self.d).and(&self.e).for_each(|o, v, d, e| *o = e * v + d * (self.weight * *o + common));
        out
    }

    /// The curvature of the data along two directions, x D H D y.
    pub(super) fn data_curvature(&self, x: &Array2<f64>, y: &Array2<f64>) -> f64 {
        let top = x.iter().chain(y).fold(f64::MIN_POSITIVE, |a, v| a.max(v.abs()));
        let seen = |v: &Array2<f64>| {
            let mut out = self.d.clone();
            Zip::from(&mut out).and(v).for_each(|o, v| *o *= (v / top) as f32);
            out
        };
        let h = self.beam.apply(seen(x).view());
        dot(&h, &seen(y)) * self.beam.diagonal() * top * top
    }

    fn precondition(&self, v: &Array2<f32>) -> Array2<f32> {
        let mut part = v.clone();
        Zip::from(&mut part).and(&self.e).and(&self.bright).for_each(|p, e, b| *p *= b / e.sqrt());
        let mut out = self.beam.filter(part.view(), &self.circulant);
        Zip::from(&mut out).and(v).and(&self.e).and(&self.bright).for_each(|o, v, e, b| {
            let root = e.sqrt();
            *o = ((1.0 - b * b) * v / root + b * *o) / root;
        });
        out
    }

    /// The solution of Hessian x = `rhs`, to a residual of `tolerance` times the right hand side or after `limit` steps, and the steps.
    pub(super) fn solve(&self, rhs: &Array2<f64>, tolerance: f64, limit: usize) -> (Array2<f64>, usize) {
        // The scale keeps single precision in its range whatever the unit of flux.
        let top = rhs.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        if !(top > 0.0) {
            return (Array2::zeros(rhs.dim()), 0);
        }
        let mut r = rhs.mapv(|v| (v / top) as f32);
        let mut x = Array2::<f32>::zeros(rhs.dim());
        let mut z = self.precondition(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let goal = tolerance * dot(&r, &r).sqrt();
        let mut steps = 0;
        while steps < limit && rz > 0.0 {
            let h = self.hessian(&p);
            let curvature = dot(&p, &h);
            if !(curvature > 0.0) {
                break;
            }
            let a = (rz / curvature) as f32;
            Zip::from(&mut x).and(&p).for_each(|x, p| *x += a * p);
            Zip::from(&mut r).and(&h).for_each(|r, h| *r -= a * h);
            steps += 1;
            if dot(&r, &r).sqrt() <= goal {
                break;
            }
            z = self.precondition(&r);
            let next = dot(&r, &z);
            let b = (next / rz) as f32;
            Zip::from(&mut p).and(&z).for_each(|p, z| *p = z + b * *p);
            rz = next;
        }
        (x.mapv(|v| f64::from(v) * top), steps)
    }
}
