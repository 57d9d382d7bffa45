//! The Newton direction in s, by conjugate gradients. The Hessian comes from the dirty beam, and the preconditioner is a circulant.
//!
//! The Hessian of J is E + lambda D H D + rho D 1 1^T D + (s/2) L (s/2), with D = R s / 2, R the response of the elements, H the beam, E diagonal, and L the
//! differences of neighbours in the smoothness. Bright and dark pixels differ
//! by orders of magnitude in D. A circulant matrix has one value for all pixels, so the preconditioner blends two inverses: that of
//! the circulant for the mean brightness where pixels are bright, and that of E alone where they are dark.
//!
//! # Reference
//! Nocedal & Wright 2006, Numerical Optimization, alg. 7.1 (inexact Newton).

use super::beam::BeamHessian;
use super::control::Effort;
use super::objective::{Multipliers, Point};
use super::response::Response;
use super::smoothness::Smoothness;
use crate::fourier::RealSpectrum;
use crate::{ChainError, Result};
use ndarray::Array2;
use rayon::prelude::*;
use std::borrow::Cow;

/// Fraction of the mean brightness at which the preconditioner treats a pixel as half bright and half dark. It changes the number of steps
/// of the conjugate gradients, but not their solution.
const HALF_BRIGHT: f32 = 0.1;

/// Number of pixels that one task works on.
const PART: usize = 1 << 14;

/// The linear system of one Newton step.
pub(super) struct NewtonSystem<'a> {
    beam: &'a BeamHessian,
    /// The variable times the response, 2 D.
    s: Cow<'a, Array2<f32>>,
    /// Curvature of all terms except the data.
    e: Array2<f32>,
    /// lambda times the diagonal of the beam's Hessian.
    weight: f32,
    rho: f32,
    bright: Array2<f32>,
    /// The argument of the circulant, see [`BeamHessian::damping`].
    damping: f32,
    smooth: Option<Smooth<'a>>,
}

/// The part of the smoothness.
struct Smooth<'a> {
    links: &'a Smoothness,
    /// The variable, without the response.
    s: &'a Array2<f32>,
    /// Squared differences of neighbours in the circulant approximation, and their factor.
    spectrum: RealSpectrum<f32>,
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

/// Change each pixel of an image by those of three others, on all threads.
fn each(out: &mut Array2<f32>, [a, b, c]: [&Array2<f32>; 3], f: impl Fn(&mut f32, f32, f32, f32) + Sync) -> Result<()> {
    let parts =
        flat_mut(out)?.par_chunks_mut(PART).zip(flat(a)?.par_chunks(PART)).zip(flat(b)?.par_chunks(PART)).zip(flat(c)?.par_chunks(PART));
    parts.for_each(|(((o, a), b), c)| o.iter_mut().zip(a).zip(b).zip(c).for_each(|(((o, a), b), c)| f(o, *a, *b, *c)));
    Ok(())
}

/// The largest absolute value, at least `least`.
fn top(a: &Array2<f32>, least: f32) -> Result<f32> {
    let parts = flat(a)?.par_chunks(PART).map(|part| part.iter().fold(least, |top, v| top.max(v.abs())));
    Ok(parts.reduce(|| least, f32::max))
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
    let long = |(a, b): (&[f32], &[f32])| a.chunks(256).zip(b.chunks(256)).map(part).sum();
    // The sums of the parts are added in their order, whatever number of threads made them.
    let sums: Vec<f64> = flat(a)?.par_chunks(PART).zip(flat(b)?.par_chunks(PART)).map(long).collect();
    Ok(sums.iter().sum())
}

/// The mean of s^2 / (4 E), weighted with itself.
fn bright_mean(s: &Array2<f32>, e: &Array2<f32>) -> Result<f32> {
    let part = |(s, e): (&[f32], &[f32])| {
        s.iter().zip(e).fold((0.0, 0.0), |(first, second), (s, e)| {
            let x = f64::from(0.25 * s * s / e);
            (first + x, second + x * x)
        })
    };
    let sums: Vec<(f64, f64)> = flat(s)?.par_chunks(PART).zip(flat(e)?.par_chunks(PART)).map(part).collect();
    let (first, second) = sums.iter().fold((0.0, 0.0), |(a, b), (first, second)| (a + first, b + second));
    Ok(if first > 0.0 { (second / first) as f32 } else { 0.0 })
}

impl<'a> NewtonSystem<'a> {
    /// At a point. `residual` is dJ/dI there; its memory is used again.
    pub(super) fn new(
        (beam, response, links): (&'a BeamHessian, &Response, Option<&'a Smoothness>),
        point: &'a Point,
        residual: Array2<f32>,
        m: &Multipliers,
    ) -> Result<Self> {
        let mut s = Cow::Borrowed(&point.s);
        if !response.is_one() {
            response.multiply_single(s.to_mut());
        }
        let mut e = residual;
        // The variable s adds curvature where the image must decrease. Where the image must increase, s would reduce the curvature. This
        // part is left out.
        let stiff = &point.stiffness;
        each(&mut e, [stiff; 3], |e, c, _, _| *e = (c + (0.5 * *e).clamp(0.0, 1e6)).max(1e-4))?;
        let weight = (m.lambda * beam.diagonal()) as f32;
        let mean = bright_mean(&s, &e)?;
        // Smooth scenes are bright everywhere: the response decides only how much the data say.
        let (lit, half) = if links.is_some() { (&point.s, bright_mean(&point.s, &e)?) } else { (s.as_ref(), mean) };
        let mut bright = Array2::zeros(e.dim());
        each(&mut bright, [lit, &e, &e], |b, s, e, _| {
            let x = 0.25 * s * s / e;
            *b = if x > 0.0 { (x / (x + HALF_BRIGHT * half)).sqrt() } else { 0.0 };
        })?;
        let smooth = links.map(|links| {
            let damping = half * links.stencil() as f32;
            Smooth { links, s: &point.s, spectrum: beam.differences(), damping }
        });
        Ok(Self { beam, s, e, weight, rho: m.rho as f32, bright, damping: weight * mean, smooth })
    }

    /// The Hessian times `v`, written over `out`.
    fn hessian(&self, v: &Array2<f32>, out: &mut Array2<f32>) -> Result<()> {
        each(out, [v, &self.s, &self.s], |o, v, s, _| *o = v * (0.5 * s))?;
        let common = if self.rho == 0.0 { 0.0 } else { self.rho * flat(out)?.iter().map(|x| f64::from(*x)).sum::<f64>() as f32 };
        self.beam.apply_to(out);
        let weight = self.weight;
        each(out, [v, &self.s, &self.e], |o, v, s, e| *o = e * v + 0.5 * s * (weight * *o + common))?;
        if let Some(Smooth { links, s, .. }) = &self.smooth {
            let mut bent = Array2::zeros(v.dim());
            links.bend(1.0, |at| f64::from(0.5 * s[at] * v[at]), &mut bent);
            each(out, [s, &bent, &bent], |o, s, b, _| *o += 0.5 * s * b)?;
        }
        Ok(())
    }

    /// The curvature of the data along two directions, x D H D y.
    pub(super) fn data_curvature(&self, x: &Array2<f32>, y: &Array2<f32>) -> Result<f64> {
        let top = top(x, top(y, f32::MIN_POSITIVE)?)?;
        let seen = |v: &Array2<f32>| -> Result<Array2<f32>> {
            let mut out = Array2::zeros(v.dim());
            each(&mut out, [v, &self.s, &self.s], |o, v, s, _| *o = s * (0.5 * (v / top)))?;
            Ok(out)
        };
        let mut h = seen(x)?;
        self.beam.apply_to(&mut h);
        Ok(dot(&h, &seen(y)?)? * self.beam.diagonal() * f64::from(top).powi(2))
    }

    /// The preconditioner applied to `v`, written over `out`.
    fn precondition(&self, v: &Array2<f32>, out: &mut Array2<f32>) -> Result<()> {
        each(out, [v, &self.bright, &self.e], |p, v, b, e| *p = v * (b / e.sqrt()))?;
        match &self.smooth {
            None => self.beam.filter(out, &self.beam.damping(self.damping)),
            Some(smooth) => self.beam.filter(out, &self.beam.damping_with(self.damping, &smooth.spectrum, smooth.damping)),
        }
        each(out, [v, &self.bright, &self.e], |o, v, b, e| {
            let root = e.sqrt();
            *o = ((1.0 - b * b) * v / root + b * *o) / root;
        })
    }

    /// The solution of Hessian x = `rhs` and the number of steps of conjugate gradients that it took.
    pub(super) fn solve(&self, rhs: Array2<f32>, effort: Effort) -> Result<(Array2<f32>, usize)> {
        // On a thread of the pool, because work is handed to the other threads faster from there.
        rayon::scope(|_| self.solve_in_turn(rhs, effort))
    }

    fn solve_in_turn(&self, mut rhs: Array2<f32>, effort: Effort) -> Result<(Array2<f32>, usize)> {
        let mut x = Array2::<f32>::zeros(rhs.dim());
        // The scale keeps the squares within the range of single precision for every unit of flux.
        let top = top(&rhs, 0.0)?;
        if !(top > 0.0) {
            return Ok((x, 0));
        }
        rhs.mapv_inplace(|v| v / top);
        let mut r = rhs;
        let mut p = Array2::zeros(r.dim());
        self.precondition(&r, &mut p)?;
        let mut rz = dot(&r, &p)?;
        // The Hessian times p, and then the preconditioned residual.
        let mut work = Array2::zeros(r.dim());
        let goal = effort.tolerance * dot(&r, &r)?.sqrt();
        let mut steps = 0;
        while steps < effort.steps && rz > 0.0 {
            self.hessian(&p, &mut work)?;
            let curvature = dot(&p, &work)?;
            if !(curvature > 0.0) {
                break;
            }
            let a = (rz / curvature) as f32;
            each(&mut x, [&p; 3], |x, p, _, _| *x += a * p)?;
            each(&mut r, [&work; 3], |r, h, _, _| *r -= a * h)?;
            steps += 1;
            if dot(&r, &r)?.sqrt() <= goal {
                break;
            }
            self.precondition(&r, &mut work)?;
            let next = dot(&r, &work)?;
            let b = (next / rz) as f32;
            each(&mut p, [&work; 3], |p, z, _, _| *p = z + b * *p)?;
            rz = next;
        }
        x.mapv_inplace(|v| v * top);
        Ok((x, steps))
    }
}
