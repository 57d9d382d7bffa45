//! The Newton direction in s, by conjugate gradients. The Hessian comes from the dirty beam, and the preconditioner is a circulant.
//!
//! The Hessian of J is E + lambda D H D + rho D 1 1^T D, with D = s / 2, H the beam, and E diagonal. Bright and dark pixels differ
//! by orders of magnitude in D. A circulant matrix has one value for all pixels, so the preconditioner blends two inverses: that of
//! the circulant for the mean brightness where pixels are bright, and that of E alone where they are dark.
//!
//! # Reference
//! Nocedal & Wright 2006, Numerical Optimization, alg. 7.1 (inexact Newton).

use super::beam::BeamHessian;
use super::control::Effort;
use super::objective::{Multipliers, Point};
use crate::{ChainError, Result};
use ndarray::Array2;

/// Fraction of the mean brightness at which the preconditioner treats a pixel as half bright and half dark. It changes the number of steps
/// of the conjugate gradients, but not their solution.
const HALF_BRIGHT: f32 = 0.1;

/// The linear system of one Newton step.
pub(super) struct NewtonSystem<'a> {
    beam: &'a BeamHessian,
    /// s / 2.
    d: Array2<f32>,
    /// Curvature of all terms except the data.
    e: Array2<f32>,
    /// Square root of `e`.
    root: Vec<f32>,
    /// lambda times the diagonal of the beam's Hessian.
    weight: f32,
    rho: f32,
    bright: Array2<f32>,
    /// The argument of the circulant, see [`BeamHessian::damping`].
    damping: f32,
}

/// Pixels of an image, row after row. Compilers turn loops over plain slices into vector code in every build.
fn flat(a: &Array2<f32>) -> Result<&[f32]> {
    a.as_slice().ok_or_else(scattered)
}

fn flat_mut(a: &mut Array2<f32>) -> Result<&mut [f32]> {
    a.as_slice_mut().ok_or_else(scattered)
}

fn scattered() -> ChainError {
    ChainError::Incompatible("an image of the Newton step does not lie in memory row after row".into())
}

fn dot(a: &Array2<f32>, b: &Array2<f32>) -> Result<f64> {
    // Short sums in single precision, their sum in double.
    let part = |(a, b): (&[f32], &[f32])| {
        let mut sums = [0.0_f32; 8];
        for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
            for (s, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
                *s += a * b;
            }
        }
        let rest = a.chunks_exact(8).remainder().iter().zip(b.chunks_exact(8).remainder());
        sums.iter().map(|s| f64::from(*s)).sum::<f64>() + rest.map(|(a, b)| f64::from(a * b)).sum::<f64>()
    };
    Ok(flat(a)?.chunks(256).zip(flat(b)?.chunks(256)).map(part).sum())
}

impl<'a> NewtonSystem<'a> {
    /// At a point; `residual` is dJ/dI there.
    pub(super) fn new(beam: &'a BeamHessian, point: &Point, residual: &Array2<f64>, m: &Multipliers) -> Result<Self> {
        let d = point.s.mapv(|s| (0.5 * s) as f32);
        let mut e = point.stiffness.mapv(|c| c as f32);
        // The variable s adds curvature where the image must decrease. Where the image must increase, s would reduce the curvature. This
        // part is left out.
        flat_mut(&mut e)?.iter_mut().zip(residual).for_each(|(e, r)| *e = (*e + (0.5 * r).clamp(0.0, 1e6) as f32).max(1e-4));
        let weight = (m.lambda * beam.diagonal()) as f32;
        let (mut first, mut second) = (0.0, 0.0);
        flat(&d)?.iter().zip(flat(&e)?).for_each(|(d, e)| {
            let x = f64::from(d * d / e);
            first += x;
            second += x * x;
        });
        let mean = if first > 0.0 { (second / first) as f32 } else { 0.0 };
        let mut bright = Array2::zeros(d.dim());
        flat_mut(&mut bright)?.iter_mut().zip(flat(&d)?.iter().zip(flat(&e)?)).for_each(|(b, (d, e))| {
            let x = d * d / e;
            *b = if x > 0.0 { (x / (x + HALF_BRIGHT * mean)).sqrt() } else { 0.0 };
        });
        let root = flat(&e)?.iter().map(|e| e.sqrt()).collect();
        Ok(Self { beam, d, e, root, weight, rho: m.rho as f32, bright, damping: weight * mean })
    }

    fn hessian(&self, v: &Array2<f32>) -> Result<Array2<f32>> {
        let mut seen = v.clone();
        flat_mut(&mut seen)?.iter_mut().zip(flat(&self.d)?).for_each(|(s, d)| *s *= d);
        let common = if self.rho == 0.0 { 0.0 } else { self.rho * flat(&seen)?.iter().map(|x| f64::from(*x)).sum::<f64>() as f32 };
        let mut out = self.beam.apply(seen.view());
        let parts = flat(v)?.iter().zip(flat(&self.d)?).zip(flat(&self.e)?);
        let weight = self.weight;
        flat_mut(&mut out)?.iter_mut().zip(parts).for_each(|(o, ((v, d), e))| *o = e * v + d * (weight * *o + common));
        Ok(out)
    }

    /// The curvature of the data along two directions, x D H D y.
    pub(super) fn data_curvature(&self, x: &Array2<f64>, y: &Array2<f64>) -> Result<f64> {
        let top = x.iter().chain(y).fold(f64::MIN_POSITIVE, |a, v| a.max(v.abs()));
        let seen = |v: &Array2<f64>| -> Result<Array2<f32>> {
            let mut out = self.d.clone();
            flat_mut(&mut out)?.iter_mut().zip(v).for_each(|(o, v)| *o *= (v / top) as f32);
            Ok(out)
        };
        let h = self.beam.apply(seen(x)?.view());
        Ok(dot(&h, &seen(y)?)? * self.beam.diagonal() * top * top)
    }

    fn precondition(&self, v: &Array2<f32>) -> Result<Array2<f32>> {
        let mut part = v.clone();
        let bright = flat(&self.bright)?;
        let blend = || bright.iter().zip(&self.root);
        flat_mut(&mut part)?.iter_mut().zip(blend()).for_each(|(p, (b, root))| *p *= b / root);
        let mut out = self.beam.filter(part.view(), &self.beam.damping(self.damping));
        let given = flat(v)?.iter().zip(blend());
        flat_mut(&mut out)?.iter_mut().zip(given).for_each(|(o, (v, (b, root)))| *o = ((1.0 - b * b) * v / root + b * *o) / root);
        Ok(out)
    }

    /// The solution of Hessian x = `rhs` and the number of steps of conjugate gradients that it took.
    pub(super) fn solve(&self, rhs: &Array2<f64>, effort: Effort) -> Result<(Array2<f64>, usize)> {
        // The scale keeps the numbers within the range of single precision for every unit of flux.
        let top = rhs.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        if !(top > 0.0) {
            return Ok((Array2::zeros(rhs.dim()), 0));
        }
        let mut r = rhs.mapv(|v| (v / top) as f32);
        let mut x = Array2::<f32>::zeros(rhs.dim());
        let mut z = self.precondition(&r)?;
        let mut p = z.clone();
        let mut rz = dot(&r, &z)?;
        let goal = effort.tolerance * dot(&r, &r)?.sqrt();
        let mut steps = 0;
        while steps < effort.steps && rz > 0.0 {
            let h = self.hessian(&p)?;
            let curvature = dot(&p, &h)?;
            if !(curvature > 0.0) {
                break;
            }
            let a = (rz / curvature) as f32;
            flat_mut(&mut x)?.iter_mut().zip(flat(&p)?).for_each(|(x, p)| *x += a * p);
            flat_mut(&mut r)?.iter_mut().zip(flat(&h)?).for_each(|(r, h)| *r -= a * h);
            steps += 1;
            if dot(&r, &r)?.sqrt() <= goal {
                break;
            }
            z = self.precondition(&r)?;
            let next = dot(&r, &z)?;
            let b = (next / rz) as f32;
            flat_mut(&mut p)?.iter_mut().zip(flat(&z)?).for_each(|(p, z)| *p = z + b * *p);
            rz = next;
        }
        Ok((x.mapv(|v| f64::from(v) * top), steps))
    }
}
