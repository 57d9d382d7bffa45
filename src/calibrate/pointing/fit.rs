//! The least squares problem of one interval: a gain and two offsets for each antenna, by Gauss and Newton's method with Levenberg's damping.

use super::basis::{NODES, OffsetBasis, Weights, product};
use super::data::{Products, Row};
use crate::linalg::{Cholesky, Matrix};
use ndarray::parallel::prelude::*;
use num_complex::Complex64;

/// Unknowns of an antenna: log amplitude, phase, offsets along l and m in units of the reach of the basis.
const UNKNOWNS: usize = 4;
/// Rows whose derivatives are held at a time.
const ROWS: usize = 4096;
/// Most iterations.
const MOST: usize = 40;
/// A step that lowers chi squared by a smaller part is the last one.
const CONVERGED: f64 = 1e-10;

/// The solution of one interval.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// Gain of each antenna.
    pub(super) gains: Vec<Complex64>,
    /// Offset of each antenna, rad.
    pub(super) offsets: Vec<[f64; 2]>,
    /// Standard deviation of the offset, rad.
    pub(super) sigma: Vec<[f64; 2]>,
}

/// What is fitted.
pub(super) struct Problem<'a> {
    pub(super) rows: &'a [Row],
    /// Rows of this interval.
    pub(super) members: &'a [usize],
    pub(super) products: &'a Products,
    pub(super) basis: &'a OffsetBasis,
    pub(super) n_ant: usize,
    /// Standard deviation of offsets that nothing else tells, rad.
    pub(super) prior_rad: f64,
    /// False leaves the offsets at 0.
    pub(super) offsets: bool,
}

/// Visibility of the model on a row and channel, and its derivatives by the offsets of the two antennas.
pub(super) fn model(products: &Products, weights: [&Weights; 2], row: usize, chan: usize) -> [Complex64; 5] {
    let mut out = [Complex64::ZERO; 5];
    let [p, q] = weights;
    for k in 0..NODES {
        let (mut sum, mut by) = (Complex64::ZERO, [Complex64::ZERO; 2]);
        for l in 0..NODES {
            let v = products.of[product(k, l)][[row, chan]];
            let v = Complex64::new(v.re.into(), v.im.into());
            sum += v * q.value[l];
            by[0] += v * q.by[0][l];
            by[1] += v * q.by[1][l];
        }
        out[0] += sum * p.value[k];
        out[1] += sum * p.by[0][k];
        out[2] += sum * p.by[1][k];
        out[3] += by[0] * p.value[k];
        out[4] += by[1] * p.value[k];
    }
    out
}

/// Normal equations at a point.
struct Normal {
    matrix: Matrix,
    right: Vec<f64>,
    /// Sum of w |V - M|^2.
    misfit: f64,
    samples: usize,
}

impl Problem<'_> {
    fn normal(&self, x: &[[f64; UNKNOWNS]], only_misfit: bool) -> Normal {
        let n = UNKNOWNS * self.n_ant;
        let size = if only_misfit { 0 } else { n };
        let mut out = Normal { matrix: Matrix::zeros(size, size), right: vec![0.0; size], misfit: 0.0, samples: 0 };
        let weights: Vec<Weights> = x.iter().map(|a| self.basis.at([a[2] * self.basis.reach, a[3] * self.basis.reach])).collect();
        for part in self.members.chunks(ROWS) {
            let of_row = |index: &usize| -> Vec<[Complex64; 5]> {
                let row = &self.rows[*index];
                let (p, q) = (&weights[row.ants[0]], &weights[row.ants[1]]);
                let used = |chan: usize| row.weight[chan] > 0.0;
                let none = [Complex64::ZERO; 5];
                (0..row.vis.len()).map(|c| if used(c) { model(self.products, [p, q], *index, c) } else { none }).collect()
            };
            let models: Vec<Vec<[Complex64; 5]>> = part.par_iter().map(of_row).collect();
            // The sums are in the order of the rows, whatever the number of threads.
            for (index, models) in part.iter().zip(models) {
                let row = &self.rows[*index];
                let [p, q] = row.ants;
                let gain = Complex64::from_polar((x[p][0] + x[q][0]).exp(), x[p][1] - x[q][1]);
                for (chan, m) in models.iter().enumerate() {
                    let w = row.weight[chan];
                    if w == 0.0 {
                        continue;
                    }
                    let seen = gain * m[0];
                    let left = row.vis[chan] - seen;
                    out.misfit += w * left.norm_sqr();
                    out.samples += 1;
                    if only_misfit {
                        continue;
                    }
                    let i = Complex64::i();
                    let r = self.basis.reach;
                    let by = [
                        (UNKNOWNS * p, seen),
                        (UNKNOWNS * p + 1, i * seen),
                        (UNKNOWNS * p + 2, gain * m[1] * r),
                        (UNKNOWNS * p + 3, gain * m[2] * r),
                        (UNKNOWNS * q, seen),
                        (UNKNOWNS * q + 1, -i * seen),
                        (UNKNOWNS * q + 2, gain * m[3] * r),
                        (UNKNOWNS * q + 3, gain * m[4] * r),
                    ];
                    for (a, da) in by {
                        out.right[a] += w * (da.conj() * left).re;
                        for (b, db) in by {
                            out.matrix[(a, b)] += w * (da.conj() * db).re;
                        }
                    }
                }
            }
        }
        out
    }

    /// Noise variance over that of the weights, from what the fit leaves.
    fn scale(&self, normal: &Normal) -> f64 {
        let free = (2 * normal.samples) as f64 - (UNKNOWNS * self.n_ant) as f64;
        normal.misfit / free.max(1.0)
    }

    /// The regularised matrix: the prior of the offsets, a small weight for gains that nothing determines (the common phase), and damping.
    fn regularised(&self, normal: &Normal, scale: f64, damping: f64) -> Matrix {
        let mut a = normal.matrix.clone();
        let largest = (0..a.rows).map(|k| a[(k, k)]).fold(f64::MIN_POSITIVE, f64::max);
        let prior = scale * (self.basis.reach / self.prior_rad).powi(2);
        for k in 0..a.rows {
            if k % UNKNOWNS < 2 {
                a[(k, k)] += 1e-9 * largest;
            } else if self.offsets {
                a[(k, k)] += prior + 1e-12 * largest;
            } else {
                // Offsets that are not solved do not move.
                a[(k, k)] = largest;
                for j in (0..a.cols).filter(|j| *j != k) {
                    (a[(k, j)], a[(j, k)]) = (0.0, 0.0);
                }
            }
            a[(k, k)] *= 1.0 + damping;
        }
        a
    }

    fn prior_term(&self, x: &[[f64; UNKNOWNS]], scale: f64) -> f64 {
        let unit = (self.basis.reach / self.prior_rad).powi(2);
        scale * unit * x.iter().map(|a| a[2] * a[2] + a[3] * a[3]).sum::<f64>()
    }

    /// Solve it.
    pub(super) fn solve(&self) -> Fit {
        let mut x = vec![[0.0; UNKNOWNS]; self.n_ant];
        let mut damping = 1e-3;
        let mut now = self.normal(&x, false);
        for _ in 0..MOST {
            let scale = self.scale(&now);
            let prior = scale * (self.basis.reach / self.prior_rad).powi(2);
            let mut right = now.right.clone();
            for (k, r) in right.iter_mut().enumerate().filter(|(k, _)| k % UNKNOWNS >= 2) {
                *r = if self.offsets { *r - prior * x[k / UNKNOWNS][k % UNKNOWNS] } else { 0.0 };
            }
            let Some(factor) = Cholesky::new(&self.regularised(&now, scale, damping)) else {
                damping = damping.max(1e-6) * 10.0;
                continue;
            };
            let step = factor.solve(&right);
            let mut next = x.clone();
            for (k, d) in step.iter().enumerate() {
                let value = &mut next[k / UNKNOWNS][k % UNKNOWNS];
                *value += d;
                if k % UNKNOWNS >= 2 {
                    // The polynomials hold within the reach.
                    *value = value.clamp(-1.5, 1.5);
                }
            }
            let tried = self.normal(&next, true);
            let (old, new) = (now.misfit + self.prior_term(&x, scale), tried.misfit + self.prior_term(&next, scale));
            if new <= old {
                x = next;
                now = self.normal(&x, false);
                damping *= 0.1;
                if old - new <= CONVERGED * old {
                    break;
                }
            } else if damping > 1e6 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        let scale = self.scale(&now);
        let n = UNKNOWNS * self.n_ant;
        let factor = Cholesky::new(&self.regularised(&now, scale, 0.0));
        let variance = |k: usize| {
            let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j == k))).collect();
            let prior = (self.prior_rad / self.basis.reach).powi(2);
            factor.as_ref().map_or(prior, |f| scale * f.solve(&unit)[k])
        };
        let r = self.basis.reach;
        let sigma = |ant: usize| [2, 3].map(|k| if self.offsets { variance(UNKNOWNS * ant + k).max(0.0).sqrt() * r } else { 0.0 });
        Fit {
            gains: x.iter().map(|a| Complex64::from_polar(a[0].exp(), a[1])).collect(),
            offsets: x.iter().map(|a| [a[2] * r, a[3] * r]).collect(),
            sigma: (0..self.n_ant).map(sigma).collect(),
        }
    }
}
