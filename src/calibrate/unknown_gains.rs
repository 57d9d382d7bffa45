//! Chi squared of visibilities with unknown antenna gains, at the gains that fit a model best.
//!
//! For every model of the sky the gains that minimise chi squared are found. At this minimum the gradient of chi squared with respect to
//! the model equals the gradient at fixed gains. An image can therefore be optimised as if the data were calibrated: gains and image are
//! solved as one problem instead of in turns.
//!
//! # Reference
//! Golub & Pereyra 1973, SIAM J. Numer. Anal. 10, 413 (variable projection); Cornwell & Wilkinson 1981, MNRAS 196, 1067.

use super::gains_over_ranks::{OfBaselines, Sharing};
use super::least_squares::{Pairs, refine_pairs, solve_pairs};
use crate::Result;
use crate::misfit::VisibilityTerm;
use cittert_arrays::Ranks;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard};

pub(super) const ONE: Complex64 = Complex64::new(1.0, 0.0);
/// Rows that one task sums.
const SHARE: usize = 256;
/// Iterations of the gains for each new model; they begin at the gains of the last one.
const ITERATIONS: usize = 50;
/// Largest last change of a phase (rad) or log amplitude, so that chi squared is exact to rounding.
const TOLERANCE: f64 = 1e-7;

/// Where a row belongs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) ant1: u32,
    pub(super) ant2: u32,
    /// Index of its solution interval.
    pub(super) interval: u32,
}

/// One gain problem: an interval, a group of channels and a feed.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    /// Index of each antenna among those that are solved \[ant\].
    pub(super) place: Vec<Option<u32>>,
    pub(super) active: usize,
    /// Gains of the antennas that are solved; empty before the first solution.
    pub(super) gains: Vec<Complex64>,
}

/// The data of a set with unknown gains: a [`VisibilityTerm`] over the flat list row by row, channel by channel.
///
/// Every parallel hand measures the same unpolarised model. Antennas that cannot be solved in an interval are not used there.
///
/// Several processes may have a part of the rows each. What takes a model is then called by all of them, each with the model of its rows.
#[derive(Debug)]
pub struct UnknownGains {
    pub(super) sharing: Sharing,
    pub(super) rows: Vec<Row>,
    pub(super) n_chan: usize,
    pub(super) group_of: Vec<usize>,
    pub(super) n_group: usize,
    /// Feed of each hand.
    pub(super) hands: Vec<usize>,
    pub(super) n_feed: usize,
    /// \[row, chan, hand\].
    pub(super) vis: Vec<Complex32>,
    /// \[row, chan, hand\]; 0 for data that are not used.
    pub(super) weight: Vec<f32>,
    pub(super) amplitudes: bool,
    pub(super) data: usize,
    pub(super) problems: Mutex<Vec<Problem>>,
    /// Weight of the expectation that each gain is 1; 0 without one.
    pub(super) prior: Mutex<f64>,
    /// What of the gains is held.
    pub(super) held: Mutex<Held>,
    /// Factors of the data \[row, chan\] where the sky, with the pattern of the elements, is taken to lie elsewhere; empty where it does not.
    pub(super) frame: RwLock<Vec<Complex32>>,
}

/// What of the gains does not follow the model.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Held {
    /// All of them, once they are solved.
    pub(super) all: bool,
    /// Their amplitudes are 1.
    pub(super) amplitudes: bool,
    /// The geometric mean of their amplitudes has this value.
    pub(super) scale: Option<f64>,
}

/// Sums of a row for one problem.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    vm: Complex64,
    mm: f64,
}

impl UnknownGains {
    /// Number of model visibilities: rows times channels.
    #[must_use]
    pub fn n_model(&self) -> usize {
        self.rows.len() * self.n_chan
    }

    /// Drop the gains. For the next model they are solved from the start, not from the last ones.
    pub fn restart(&self) {
        self.lock().iter_mut().for_each(|p| p.gains.clear());
    }

    /// Expect each gain to be 1, up to a phase that all antennas share: adds `weight` |1 - g|^2 to chi squared for each gain. The weight is
    /// the reciprocal of the variance that is expected of a phase (rad^2). With 0 nothing is expected.
    ///
    /// Gains absorb more than the common phase where the image is free: a shift of the image, and in a Y the phases that grow along each
    /// arm. The data do not determine these parts. The expectation does.
    pub fn expect_unity(&self, weight: f64) {
        let mut problems = self.lock();
        *self.prior.lock().unwrap_or_else(PoisonError::into_inner) = weight;
        for p in problems.iter_mut().filter(|p| !p.gains.is_empty()) {
            p.gains.truncate(p.active);
            if weight > 0.0 {
                let sum: Complex64 = p.gains.iter().sum();
                p.gains.push(if sum.norm() > 0.0 { sum / sum.norm() } else { ONE });
            }
        }
    }

    /// Solve the gains for `model` \[n\].
    pub fn fit(&self, model: &[Complex64]) {
        drop(self.solve(model));
    }

    /// The rms of what is expected to be 0: the phases of the gains (rad), less the common phase; with amplitudes |1 - g|.
    #[must_use]
    pub fn rms_from_unity(&self) -> f64 {
        let problems = self.lock();
        let (mut sum, mut count) = (0.0, 0_usize);
        for p in self.counted(&problems).filter(|p| p.gains.len() > p.active) {
            let reference = p.gains[p.active].conj();
            for g in &p.gains[..p.active] {
                let ratio = g * reference;
                sum += if self.amplitudes { (ratio - ONE).norm_sqr() } else { ratio.arg().powi(2) };
                count += 1;
            }
        }
        let [sum, count] = self.sharing.sum([sum, count as f64]);
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }

    /// The problems that this process counts for all.
    fn counted<'a>(&'a self, problems: &'a [Problem]) -> impl Iterator<Item = &'a Problem> {
        let n = self.n_group * self.n_feed;
        problems.iter().enumerate().filter(move |(k, _)| self.sharing.counts(k / n)).map(|(_, p)| p)
    }

    /// True if amplitudes are solved, not phases alone.
    pub(super) fn has_amplitudes(&self) -> bool {
        self.amplitudes
    }

    /// Hold a part of the gains until the next call.
    pub(super) fn hold(&self, held: Held) {
        *self.held.lock().unwrap_or_else(PoisonError::into_inner) = held;
    }

    pub(super) fn held(&self) -> Held {
        *self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Take the sky, with the pattern of the elements, to lie at `place`, in the unit that makes `u` and `v` \[n\] cycles.
    pub(super) fn look_at(&self, place: [f64; 2], u: &[f64], v: &[f64]) {
        let factor = |(u, v): (&f64, &f64)| {
            let (sin, cos) = (TAU * (u * place[0] + v * place[1])).sin_cos();
            Complex32::new(cos as f32, -sin as f32)
        };
        let factors = if place == [0.0, 0.0] { Vec::new() } else { u.par_iter().zip(v).map(factor).collect() };
        *self.frame.write().unwrap_or_else(PoisonError::into_inner) = factors;
    }

    fn frame(&self) -> RwLockReadGuard<'_, Vec<Complex32>> {
        self.frame.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn prior(&self) -> f64 {
        *self.prior.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sum of the weights of all hands for each model visibility \[n\].
    #[must_use]
    pub fn weights(&self) -> Vec<f32> {
        self.weight.chunks(self.hands.len()).map(|w| w.iter().sum()).collect()
    }

    /// Sum of the weights of the data of all processes.
    #[must_use]
    pub fn weight_of_all(&self) -> f64 {
        self.sharing.sum([self.weights().iter().map(|w| f64::from(*w)).sum()])[0]
    }

    /// The data calibrated with the gains that fit `model` \[n\] best, averaged over the hands \[n\].
    #[must_use]
    pub fn calibrated(&self, model: &[Complex64]) -> Vec<Complex32> {
        let problems = self.solve(model);
        let mut out = vec![Complex32::default(); self.n_model()];
        out.par_chunks_mut(self.n_chan).enumerate().for_each(|(r, out)| {
            let mut sum = vec![(Complex64::default(), 0.0); self.n_chan];
            self.each(r, &problems, |chan, g, v, w| {
                // Of data w |V - G M|^2 = w |G|^2 |V / G - M|^2.
                sum[chan].0 += g.conj() * v * w;
                sum[chan].1 += g.norm_sqr() * w;
            });
            for (out, (vw, w)) in out.iter_mut().zip(&sum).filter(|(_, s)| s.1 > 0.0) {
                *out = Complex32::new((vw.re / w) as f32, (vw.im / w) as f32);
            }
        });
        out
    }

    /// The variance of the data over that of their weights, from the difference of two calibrated hands, which measure the same sky; `None`
    /// for a single hand.
    #[must_use]
    pub fn noise_factor(&self, model: &[Complex64]) -> Option<f64> {
        let problems = self.solve(model);
        let (mut sum, mut count) = (0.0, 0_u64);
        for r in 0..self.rows.len() {
            let mut first: Option<(usize, Complex64, f64)> = None;
            self.each(r, &problems, |chan, g, v, w| {
                let power = g.norm_sqr();
                let (seen, variance) = (v * g.conj() / power, 1.0 / (w * power));
                match first.take() {
                    Some((at, other, and)) if at == chan => {
                        sum += (seen - other).norm_sqr() / (2.0 * (variance + and));
                        count += 1;
                    }
                    _ => first = Some((chan, seen, variance)),
                }
            });
        }
        let [sum, count] = self.sharing.sum([sum, count as f64]);
        (count > 0.0).then(|| sum / count)
    }

    /// The shift of the image, in the unit that makes `u` and `v` \[n\] cycles, that fits the data best with free gains,
    /// and its standard deviation; `None` where the data do not determine it.
    ///
    /// Gains can absorb every shift of a single channel at a single time. They cannot absorb a shift over a band or a rotation of the
    /// Earth: a shift changes phases in proportion to the frequency, and gains of the whole band are constant.
    ///
    /// # Errors
    /// Another process has failed.
    pub fn shift(&self, model: &[Complex64], u: &[f64], v: &[f64]) -> Result<Option<([f64; 2], [f64; 2])>> {
        let problems = self.solve(model);
        let n = self.n_group * self.n_feed;
        let mut s = [0.0; 5];
        // For each baseline and problem: the parts of the shift derivatives and of the residual that a change of the phase can absorb.
        let mut phase = OfBaselines::new();
        for (r, row) in self.rows.iter().enumerate() {
            let first = r * self.n_chan;
            let mut here = vec![[0.0; 4]; n];
            self.each_indexed(r, &problems, |sample, chan, g, vis, w| {
                let m = model[first + chan] * g;
                let residual = vis - m;
                let (du, dv) = (TAU * u[first + chan], TAU * v[first + chan]);
                let power = w * m.norm_sqr();
                // w Re(conj(i m) residual).
                let pull = w * (m.re * residual.im - m.im * residual.re);
                let add = |to: &mut [f64], what: &[f64]| to.iter_mut().zip(what).for_each(|(t, x)| *t += x);
                add(&mut s, &[power * du * du, power * du * dv, power * dv * dv, pull * du, pull * dv]);
                add(&mut here[self.problem_of(row, sample) % n], &[power, power * du, power * dv, pull]);
            });
            for (i, h) in here.iter().enumerate() {
                let p = phase.entry((row.ant1, row.ant2, row.interval as usize * n + i)).or_default();
                p.iter_mut().zip(h).for_each(|(p, h)| *p += h);
            }
        }
        let common = self.sharing.of_common(n, &phase)?;
        phase.retain(|(.., problem), _| !self.sharing.is_common(n, *problem));
        let absorbed = |phase: &OfBaselines| {
            let each = phase.values().filter(|p| p[0] > 0.0);
            each.fold([0.0; 5], |mut sum: [f64; 5], p| {
                let parts = [p[1] * p[1], p[1] * p[2], p[2] * p[2], p[1] * p[3], p[2] * p[3]];
                sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part / p[0]);
                sum
            })
        };
        let (s, own) = (self.sharing.sum(s), self.sharing.sum(absorbed(&phase)));
        let (whole, common) = ([s[0], s[2]], absorbed(&common));
        let s: [f64; 5] = std::array::from_fn(|k| s[k] - own[k] - common[k]);
        let det = s[0] * s[2] - s[1] * s[1];
        // If the phases can absorb the shift completely, only rounding errors remain.
        if !(det > 1e-9 * s[0] * s[2] && s[0] > 1e-9 * whole[0] && s[2] > 1e-9 * whole[1]) {
            return Ok(None);
        }
        let shift = [(s[2] * s[3] - s[1] * s[4]) / det, (s[0] * s[4] - s[1] * s[3]) / det];
        Ok(Some((shift, [(s[2] / det).sqrt(), (s[0] / det).sqrt()])))
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Problem>> {
        // After a panic in another thread the gains are still a valid start.
        self.problems.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn samples(&self, row: usize) -> std::ops::Range<usize> {
        let n = self.n_chan * self.hands.len();
        row * n..(row + 1) * n
    }

    /// Problem of sample k (channel and hand) of a row.
    pub(super) fn problem_of(&self, row: &Row, k: usize) -> usize {
        let (chan, hand) = (k / self.hands.len(), k % self.hands.len());
        (row.interval as usize * self.n_group + self.group_of[chan]) * self.n_feed + self.hands[hand]
    }

    /// Gain product, datum and weight of every sample of a row that takes part, with its channel.
    fn each(&self, r: usize, problems: &[Problem], mut work: impl FnMut(usize, Complex64, Complex64, f64)) {
        self.each_indexed(r, problems, |_, chan, g, v, w| work(chan, g, v, w));
    }

    fn each_indexed(&self, r: usize, problems: &[Problem], mut work: impl FnMut(usize, usize, Complex64, Complex64, f64)) {
        let row = self.rows[r];
        let n = self.n_group * self.n_feed;
        let here = &problems[row.interval as usize * n..(row.interval as usize + 1) * n];
        let products: Vec<Complex64> = here.iter().map(|p| p.product(&row)).collect();
        let samples = self.samples(r);
        let frame = self.frame();
        for (k, (v, w)) in self.vis[samples.clone()].iter().zip(&self.weight[samples]).enumerate() {
            if *w > 0.0 {
                let g = products[self.problem_of(&row, k) % n];
                let chan = k / self.hands.len();
                work(k, chan, g, placed(*v, &frame, r * self.n_chan + chan), f64::from(*w));
            }
        }
    }

    /// Gains of every problem for a model \[n\], starting from those of the last model.
    fn solve(&self, model: &[Complex64]) -> MutexGuard<'_, Vec<Problem>> {
        let (n, n_hand) = (self.n_group * self.n_feed, self.hands.len());
        let held = self.held();
        if held.all {
            let problems = self.lock();
            if self.sharing.all(problems.iter().all(|p| p.active < 2 || !p.gains.is_empty())) {
                return problems;
            }
        }
        let amplitudes = self.amplitudes && !held.amplitudes;
        let frame = self.frame();
        let frame: &[Complex32] = &frame;
        let mut sums = vec![Sum::default(); self.rows.len() * n];
        sums.par_chunks_mut(n * SHARE).enumerate().for_each(|(share, sums)| {
            for (i, sums) in sums.chunks_mut(n).enumerate() {
                let r = share * SHARE + i;
                let row = &self.rows[r];
                let samples = self.samples(r);
                for (k, (v, w)) in self.vis[samples.clone()].iter().zip(&self.weight[samples]).enumerate() {
                    if *w > 0.0 {
                        let at = r * self.n_chan + k / n_hand;
                        let (m, w) = (model[at], f64::from(*w));
                        let s = &mut sums[self.problem_of(row, k) % n];
                        s.vm += placed(*v, frame, at) * m.conj() * w;
                        s.mm += w * m.norm_sqr();
                    }
                }
            }
        });
        let prior = self.prior();
        let mut problems = self.lock();
        let more = usize::from(prior > 0.0);
        let mut pairs: Vec<Pairs> = problems.iter().map(|p| Pairs::new(p.active + more)).collect();
        for (row, sums) in self.rows.iter().zip(sums.chunks(n)) {
            for (i, s) in sums.iter().enumerate().filter(|(_, s)| s.mm > 0.0) {
                let at = row.interval as usize * n + i;
                if let Some((p, q)) = problems[at].ends(row) {
                    pairs[at].add(p, q, s.vm, s.mm);
                }
            }
        }
        self.sharing.add_up(n, &mut pairs);
        // The expectation is one more antenna of gain 1, which measures every gain with the weight of the expectation.
        if prior > 0.0 {
            for (pairs, p) in pairs.iter_mut().zip(problems.iter()) {
                (0..p.active).for_each(|a| pairs.add(a, p.active, Complex64::new(prior, 0.0), prior));
            }
        }
        problems.par_iter_mut().zip(&pairs).filter(|(p, _)| p.active > 1).for_each(|(problem, pairs)| {
            if problem.gains.is_empty() {
                if let Some(fit) = solve_pairs(pairs, amplitudes, ITERATIONS, TOLERANCE) {
                    problem.gains = fit.gains;
                }
            } else {
                refine_pairs(pairs, &mut problem.gains, amplitudes, ITERATIONS, TOLERANCE);
            }
            if let Some(scale) = held.scale.filter(|_| amplitudes) {
                to_scale(&mut problem.gains, scale);
            }
        });
        problems
    }
}

/// A datum with its factor, if there are any.
fn placed(vis: Complex32, frame: &[Complex32], at: usize) -> Complex64 {
    let vis = Complex64::new(f64::from(vis.re), f64::from(vis.im));
    match frame.get(at) {
        Some(factor) => vis * Complex64::new(f64::from(factor.re), f64::from(factor.im)),
        None => vis,
    }
}

/// Give the amplitudes of gains this geometric mean.
fn to_scale(gains: &mut [Complex64], scale: f64) {
    let logs: f64 = gains.iter().map(|g| g.norm().max(f64::MIN_POSITIVE).ln()).sum();
    let factor = scale / (logs / gains.len().max(1) as f64).exp();
    if factor.is_finite() {
        gains.iter_mut().for_each(|g| *g *= factor);
    }
}

impl Problem {
    fn ends(&self, row: &Row) -> Option<(usize, usize)> {
        Some((self.place[row.ant1 as usize]? as usize, self.place[row.ant2 as usize]? as usize))
    }

    fn product(&self, row: &Row) -> Complex64 {
        match self.ends(row) {
            Some((p, q)) if !self.gains.is_empty() => self.gains[p] * self.gains[q].conj(),
            // While the model does not connect the antennas, their gains stay 1.
            _ => ONE,
        }
    }
}

/// The term is shared, because the objective of the image and the code that reads the gains use the same one.
impl VisibilityTerm for Arc<UnknownGains> {
    fn name(&self) -> &'static str {
        self.as_ref().name()
    }

    fn data(&self) -> usize {
        self.as_ref().data()
    }

    fn add(&self, model: &[Complex64], weight: f64, gradient: &mut [Complex64]) -> f64 {
        self.as_ref().add(model, weight, gradient)
    }

    fn ranks(&self) -> Arc<dyn Ranks> {
        self.as_ref().ranks()
    }
}

impl VisibilityTerm for UnknownGains {
    fn name(&self) -> &'static str {
        "visibilities with unknown gains"
    }

    fn data(&self) -> usize {
        self.data
    }

    fn ranks(&self) -> Arc<dyn Ranks> {
        self.sharing.ranks()
    }

    fn add(&self, model: &[Complex64], weight: f64, gradient: &mut [Complex64]) -> f64 {
        let problems = self.solve(model);
        let problems: &[Problem] = &problems;
        let sums: Vec<f64> = gradient
            .par_chunks_mut(self.n_chan * SHARE)
            .enumerate()
            .map(|(share, gradient)| {
                let mut chi2 = 0.0;
                for (i, gradient) in gradient.chunks_mut(self.n_chan).enumerate() {
                    let r = share * SHARE + i;
                    let model = &model[r * self.n_chan..(r + 1) * self.n_chan];
                    self.each(r, problems, |chan, g, v, w| {
                        let d = g * model[chan] - v;
                        chi2 += w * d.norm_sqr();
                        gradient[chan] += g.conj() * d * (2.0 * weight * w);
                    });
                }
                chi2
            })
            .collect();
        let prior = self.prior();
        let apart = |p: &Problem| -> f64 { p.gains[..p.active].iter().map(|g| (g * p.gains[p.active].conj() - ONE).norm_sqr()).sum() };
        let expected: f64 = self.counted(problems).filter(|p| p.gains.len() > p.active).map(apart).sum();
        // Gains of the expected size add 1 each, which is not a misfit of the data.
        let usual = if prior > 0.0 { self.counted(problems).map(|p| p.active as f64).sum() } else { 0.0 };
        // The sum has a fixed order, so that it is the same for any number of threads.
        self.sharing.sum([sums.iter().sum::<f64>() + prior * expected - usual])[0]
    }
}
