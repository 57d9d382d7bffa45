//! The least squares problem of one solution interval: antenna gains from one sum for each baseline.
//!
//! Minimises sum w |V_pq - g_p conj(g_q) M_pq|^2 over the gains. The data enter only through `vm` = sum w V conj(M) and
//! `mm` = sum w |M|^2 of each baseline. The start is the better of a spanning tree and a leading eigenvector, so that no phase along a
//! closed loop of baselines is off by a whole turn. Alternating least squares (StefCal) gives the first amplitudes. Gauss-Newton steps
//! finish; they converge quadratically, where the alternation converges linearly. In log gains the two halves of the Gauss-Newton system
//! separate: a graph Laplacian for the phases, a signless one for the amplitudes.
//!
//! # Reference
//! Salvini & Wijnholds 2014, A&A 571, A97 (StefCal); Boonstra & van der Veen 2003, IEEE Trans. Signal Process. 51, 25
//! (eigenvector start); Cornwell & Wilkinson 1981, MNRAS 196, 1067 (self-calibration as least squares).

use crate::linalg::{Cholesky, Matrix, condition_number, dot};
use num_complex::Complex64;

const ZERO: Complex64 = Complex64::new(0.0, 0.0);
const ONE: Complex64 = Complex64::new(1.0, 0.0);
/// With a larger condition number, some combination of gains is not measured.
const SINGULAR: f64 = 1e12;

/// Sums of the baselines between `n` antennas: `vm` Hermitian, `mm` symmetric, both \[ant, ant\], zero where there are no data.
#[derive(Debug, Clone)]
pub(crate) struct Pairs {
    pub(crate) n: usize,
    vm: Vec<Complex64>,
    mm: Vec<f64>,
}

impl Pairs {
    pub(crate) fn new(n: usize) -> Self {
        Self { n, vm: vec![ZERO; n * n], mm: vec![0.0; n * n] }
    }

    /// Add to baseline p-q; `vm` belongs to p first, q second.
    pub(crate) fn add(&mut self, p: usize, q: usize, vm: Complex64, mm: f64) {
        self.vm[p * self.n + q] += vm;
        self.vm[q * self.n + p] += vm.conj();
        self.mm[p * self.n + q] += mm;
        self.mm[q * self.n + p] += mm;
    }

    pub(crate) fn vm(&self, p: usize, q: usize) -> Complex64 {
        self.vm[p * self.n + q]
    }

    pub(crate) fn mm(&self, p: usize, q: usize) -> f64 {
        self.mm[p * self.n + q]
    }

    /// True where the baseline constrains a gain.
    pub(crate) fn measured(&self, p: usize, q: usize) -> bool {
        self.mm(p, q) > 0.0 && self.vm(p, q) != ZERO
    }

    /// Numbers that all sums between `n` antennas are.
    pub(crate) fn n_sums(n: usize) -> usize {
        3 * n * n.saturating_sub(1) / 2
    }

    /// Append the sums as numbers.
    pub(crate) fn put_sums(&self, to: &mut Vec<f64>) {
        for p in 0..self.n {
            to.extend((p + 1..self.n).flat_map(|q| [self.vm(p, q).re, self.vm(p, q).im, self.mm(p, q)]));
        }
    }

    /// Take sums from the numbers of [`Pairs::put_sums`].
    pub(crate) fn set_sums(&mut self, from: &[f64]) {
        let n = self.n;
        let ends = (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q)));
        for ((p, q), sums) in ends.zip(from.chunks_exact(3)) {
            let vm = Complex64::new(sums[0], sums[1]);
            (self.vm[p * n + q], self.vm[q * n + p]) = (vm, vm.conj());
            (self.mm[p * n + q], self.mm[q * n + p]) = (sums[2], sums[2]);
        }
    }

    /// The baselines between some of the antennas.
    pub(crate) fn subset(&self, keep: &[usize]) -> Self {
        let mut s = Self::new(keep.len());
        for (i, &p) in keep.iter().enumerate() {
            for (j, &q) in keep.iter().enumerate() {
                s.vm[i * s.n + j] = self.vm(p, q);
                s.mm[i * s.n + j] = self.mm(p, q);
            }
        }
        s
    }

    /// sum over q of vm_pq g_q.
    fn pull(&self, p: usize, g: &[Complex64]) -> Complex64 {
        self.vm[p * self.n..(p + 1) * self.n].iter().zip(g).map(|(v, g)| v * g).sum()
    }

    /// Alignment of the data with the phases of `g`: the sum over p < q of Re(vm conj(g_p) g_q).
    pub(crate) fn alignment(&self, g: &[Complex64]) -> f64 {
        (0..self.n).map(|p| (self.pull(p, g) * g[p].conj()).re).sum::<f64>() / 2.0
    }

    /// sum over p < q of mm |g_p|^2 |g_q|^2.
    pub(crate) fn model_power(&self, g: &[Complex64]) -> f64 {
        let power: Vec<f64> = g.iter().map(Complex64::norm_sqr).collect();
        (0..self.n).map(|p| power[p] * dot(&self.mm[p * self.n..(p + 1) * self.n], &power)).sum::<f64>() / 2.0
    }

    /// chi^2 less sum w |V|^2.
    pub(crate) fn cost(&self, g: &[Complex64]) -> f64 {
        self.model_power(g) - 2.0 * self.alignment(g)
    }

    /// Signal to noise of the gain of antenna p as a matched filter against all the others.
    pub(crate) fn snr(&self, p: usize, g: &[Complex64]) -> f64 {
        let signal = (self.pull(p, g) * g[p].conj()).re;
        let power: f64 = (0..self.n).map(|q| self.mm(p, q) * g[q].norm_sqr()).sum::<f64>() * g[p].norm_sqr();
        if power > 0.0 { signal / power.sqrt() } else { 0.0 }
    }
}

/// Gains of one interval, up to one common phase.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) gains: Vec<Complex64>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    pub(crate) condition: f64,
}

/// Solve a connected set of antennas. `None` where some combination of the gains is not measured at all.
pub(crate) fn solve_pairs(pairs: &Pairs, amplitudes: bool, max_iterations: usize, tolerance: f64) -> Option<Fit> {
    let mut g = start(pairs)?;
    if amplitudes {
        let (signal, power) = (pairs.alignment(&g), pairs.model_power(&g));
        let scale = if signal > 0.0 && power > 0.0 { (signal / power).sqrt() } else { return None };
        g.iter_mut().for_each(|g| *g *= scale);
        stefcal(pairs, &mut g, 10);
    }
    let mut cost = objective(pairs, &g, amplitudes);
    for iteration in 1..=max_iterations {
        let (next, change) = step(pairs, &g, amplitudes, cost)?;
        g = next;
        cost = objective(pairs, &g, amplitudes);
        if change < tolerance {
            let condition = condition(pairs, &g, amplitudes);
            return (condition < SINGULAR).then_some(Fit { gains: g, iterations: iteration, converged: true, condition });
        }
    }
    let condition = condition(pairs, &g, amplitudes);
    (condition < SINGULAR).then_some(Fit { gains: g, iterations: max_iterations, converged: false, condition })
}

/// Improve gains that are near the solution, such as those of a slightly different model.
///
/// Gains that cannot be improved are not changed.
pub(crate) fn refine_pairs(pairs: &Pairs, g: &mut Vec<Complex64>, amplitudes: bool, max_iterations: usize, tolerance: f64) {
    let mut cost = objective(pairs, g, amplitudes);
    for _ in 0..max_iterations {
        let Some((next, change)) = step(pairs, g, amplitudes, cost) else { return };
        *g = next;
        cost = objective(pairs, g, amplitudes);
        if change < tolerance {
            return;
        }
    }
}

/// The function that the iteration reduces. For amplitudes it is chi^2, for phases the part of chi^2 that depends on phases.
fn objective(pairs: &Pairs, g: &[Complex64], amplitudes: bool) -> f64 {
    if amplitudes { pairs.cost(g) } else { -pairs.alignment(g) }
}

/// Unit gains near the solution. They come from the strongest spanning tree or from the leading eigenvector, whichever is aligned better
/// with the data.
fn start(pairs: &Pairs) -> Option<Vec<Complex64>> {
    let tree = spanning_tree(pairs)?;
    let spectral = leading_phases(pairs, tree.clone());
    Some(if pairs.alignment(&spectral) > pairs.alignment(&tree) { spectral } else { tree })
}

/// Phases that follow from antenna to antenna along the strongest baselines; `None` if the antennas are not connected.
fn spanning_tree(pairs: &Pairs) -> Option<Vec<Complex64>> {
    let n = pairs.n;
    let mut g = vec![ONE; n];
    let mut reached = vec![false; n];
    // Strongest baseline from the tree to each antenna outside: (|vm|, antenna in the tree).
    let mut best = vec![(0.0, 0); n];
    let mut newest = 0;
    reached[0] = true;
    for _ in 1..n {
        for q in (0..n).filter(|q| !reached[*q]) {
            let strength = pairs.vm(newest, q).norm();
            if strength > best[q].0 {
                best[q] = (strength, newest);
            }
        }
        let q = (0..n).filter(|q| !reached[*q]).max_by(|a, b| best[*a].0.total_cmp(&best[*b].0))?;
        if best[q].0 <= 0.0 {
            return None;
        }
        g[q] = unit(pairs.vm(q, best[q].1) * g[best[q].1], ONE);
        reached[q] = true;
        newest = q;
    }
    Some(g)
}

/// Phases of the leading eigenvector of the normalised matrix, by power iteration from `g`.
fn leading_phases(pairs: &Pairs, mut g: Vec<Complex64>) -> Vec<Complex64> {
    let n = pairs.n;
    let weight: Vec<f64> = (0..n).map(|p| (0..n).map(|q| pairs.vm(p, q).norm()).sum::<f64>().max(f64::MIN_POSITIVE).sqrt()).collect();
    for _ in 0..30 {
        let scaled: Vec<Complex64> = g.iter().zip(&weight).map(|(g, w)| g / w).collect();
        // The identity is added to move the spectrum of the normalised matrix (-1 to 1) above zero. A negative eigenvalue would make the
        // iteration oscillate.
        g = (0..n).map(|p| pairs.pull(p, &scaled) / weight[p] + g[p]).collect();
        let largest = g.iter().map(|g| g.norm()).fold(f64::MIN_POSITIVE, f64::max);
        g.iter_mut().for_each(|g| *g /= largest);
    }
    g.iter().map(|g| unit(*g, ONE)).collect()
}

fn unit(z: Complex64, otherwise: Complex64) -> Complex64 {
    let r = z.norm();
    if r > 0.0 && r.is_finite() { z / r } else { otherwise }
}

/// Alternating least squares with every second iterate averaged with the one before (Salvini & Wijnholds 2014, section 3.1).
fn stefcal(pairs: &Pairs, g: &mut Vec<Complex64>, iterations: usize) {
    for i in 0..iterations {
        let power: Vec<f64> = g.iter().map(Complex64::norm_sqr).collect();
        let next: Vec<Complex64> = (0..pairs.n)
            .map(|p| {
                let below: f64 = (0..pairs.n).map(|q| pairs.mm(p, q) * power[q]).sum();
                let new = if below > 0.0 { pairs.pull(p, g) / below } else { g[p] };
                if i % 2 == 1 { (new + g[p]) / 2.0 } else { new }
            })
            .collect();
        if next.iter().all(|g| g.re.is_finite() && g.im.is_finite() && *g != ZERO) {
            *g = next;
        }
    }
}

/// One descent step; returns the new gains and the largest change of a phase (rad) or log amplitude.
fn step(pairs: &Pairs, g: &[Complex64], amplitudes: bool, cost: f64) -> Option<(Vec<Complex64>, f64)> {
    let n = pairs.n;
    let pulls: Vec<Complex64> = (0..n).map(|p| pairs.pull(p, g) * g[p].conj()).collect();
    let phase_gradient: Vec<f64> = pulls.iter().map(|e| e.im).collect();
    let log_amp = if amplitudes {
        let power: Vec<f64> = g.iter().map(Complex64::norm_sqr).collect();
        let gradient: Vec<f64> = (0..n).map(|p| pulls[p].re - (0..n).map(|q| pairs.mm(p, q) * power[p] * power[q]).sum::<f64>()).collect();
        signless(pairs, g)?.solve(&gradient)
    } else {
        vec![0.0; n]
    };
    let moved = |phase: &[f64], fraction: f64| -> Vec<Complex64> {
        let one = |p: usize| {
            // Far from the solution the step of a log amplitude may be much too long.
            let a = (log_amp[p] * fraction).clamp(-1.0, 1.0);
            g[p] * Complex64::from_polar(a.exp(), phase[p] * fraction)
        };
        (0..n).map(one).collect()
    };
    let size = |phase: &[f64], fraction: f64| {
        let largest = |x: &[f64]| x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // A common phase is no change.
        let mean = phase.iter().sum::<f64>() / n as f64;
        let relative: Vec<f64> = phase.iter().map(|p| p - mean).collect();
        fraction * largest(&relative).max(largest(&log_amp))
    };
    let slack = 1e-13 * cost.abs();
    // The curvature of -|vm| cos(x). The first choice is the exact curvature, which converges quadratically even if noise moves baselines
    // far from alignment. The second choice is limited to positive values.
    let exact = |v: Complex64| v.re;
    let positive = |v: Complex64| v.re.max(0.2 * v.norm());
    let mut fraction = 1.0;
    let mut phase = Vec::new();
    for attempt in 0..2 {
        let system = if attempt == 0 { laplacian(pairs, g, exact) } else { laplacian(pairs, g, positive) };
        let Some(system) = system else { continue };
        phase = system.solve(&phase_gradient);
        fraction = 1.0;
        for _ in 0..3 {
            let trial = moved(&phase, fraction);
            if objective(pairs, &trial, amplitudes) <= cost + slack {
                return Some((trial, size(&phase, fraction)));
            }
            fraction *= 0.5;
        }
    }
    if amplitudes {
        if phase.is_empty() {
            return None;
        }
        // A short step along the descent direction of both blocks always lowers chi^2, unless the change is smaller than the rounding
        // errors.
        fraction *= 0.1;
        let trial = moved(&phase, fraction);
        return Some(if objective(pairs, &trial, true) <= cost + slack { (trial, size(&phase, fraction)) } else { (g.to_vec(), 0.0) });
    }
    // |vm| bounds the curvature of every cosine, so this step cannot increase chi^2.
    let phase = laplacian(pairs, g, |v| v.norm())?.solve(&phase_gradient);
    Some((moved(&phase, 1.0), size(&phase, 1.0)))
}

/// The matrix sum over the baselines of k (e_p - e_q)(e_p - e_q)^T (sign -1) or of k (e_p + e_q)(e_p + e_q)^T (sign +1),
/// with k a function of the two antennas.
fn graph_matrix(n: usize, sign: f64, weight: impl Fn(usize, usize) -> f64) -> Matrix {
    let mut m = Matrix::zeros(n, n);
    for p in 0..n {
        for q in (0..n).filter(|q| *q != p) {
            let k = weight(p, q);
            m[(p, q)] = sign * k;
            m[(p, p)] += k;
        }
    }
    m
}

/// The factored Laplacian of the phases. A common phase has no curvature; it gets the mean curvature. `None` if the matrix is not positive
/// definite.
fn laplacian(pairs: &Pairs, g: &[Complex64], weight: impl Fn(Complex64) -> f64) -> Option<Cholesky> {
    let mut l = graph_matrix(pairs.n, -1.0, |p, q| weight(pairs.vm(p, q) * g[p].conj() * g[q]));
    fill_null(&mut l);
    Cholesky::new(&l)
}

fn fill_null(l: &mut Matrix) {
    let n = l.rows;
    let mean = (0..n).map(|p| l[(p, p)]).sum::<f64>() / (n * n) as f64;
    for p in 0..n {
        l.row_mut(p).iter_mut().for_each(|x| *x += mean);
    }
}

/// The matrix of the amplitudes; `None` where amplitudes can be traded between antennas (a graph without an odd loop).
fn signless(pairs: &Pairs, g: &[Complex64]) -> Option<Cholesky> {
    Cholesky::new(&signless_matrix(pairs, g))
}

fn signless_matrix(pairs: &Pairs, g: &[Complex64]) -> Matrix {
    graph_matrix(pairs.n, 1.0, |p, q| pairs.mm(p, q) * g[p].norm_sqr() * g[q].norm_sqr())
}

/// Condition number of the Gauss-Newton system without the common phase; infinite where it cannot be factored.
fn condition(pairs: &Pairs, g: &[Complex64], amplitudes: bool) -> f64 {
    let n = pairs.n;
    let mut l = graph_matrix(n, -1.0, |p, q| pairs.mm(p, q) * g[p].norm_sqr() * g[q].norm_sqr());
    fill_null(&mut l);
    let common = vec![1.0 / (n as f64).sqrt(); n];
    let phase = Cholesky::new(&l).map_or(f64::INFINITY, |c| condition_number(&l, &c, Some(&common)));
    if !amplitudes {
        return phase;
    }
    let m = signless_matrix(pairs, g);
    phase.max(Cholesky::new(&m).map_or(f64::INFINITY, |c| condition_number(&m, &c, None)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random_gains(n: usize, amplitudes: bool, rng: &mut ChaCha8Rng) -> Vec<Complex64> {
        let one = |rng: &mut ChaCha8Rng| {
            let a = if amplitudes { rng.random_range(0.3..2.0) } else { 1.0 };
            Complex64::from_polar(a, rng.random_range(-3.1..3.1))
        };
        (0..n).map(|_| one(rng)).collect()
    }

    /// Baselines of a model with random complex visibilities, corrupted by `g`.
    fn corrupted(g: &[Complex64], links: impl Fn(usize, usize) -> bool, rng: &mut ChaCha8Rng) -> Pairs {
        let mut pairs = Pairs::new(g.len());
        for p in 0..g.len() {
            for q in p + 1..g.len() {
                let mm = rng.random_range(0.1..2.0);
                if links(p, q) {
                    pairs.add(p, q, g[p] * g[q].conj() * mm, mm);
                }
            }
        }
        pairs
    }

    fn worst(found: &[Complex64], truth: &[Complex64]) -> f64 {
        let common: Complex64 = found.iter().zip(truth).map(|(f, t)| f * t.conj()).sum();
        let turn = common / common.norm();
        found.iter().zip(truth).map(|(f, t)| (f / turn - t).norm() / t.norm()).fold(0.0, f64::max)
    }

    #[test]
    fn noiseless_gains_come_back_for_small_and_large_arrays() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in [3, 4, 5, 8, 27, 64, 200] {
            for amplitudes in [false, true] {
                let truth = random_gains(n, amplitudes, &mut rng);
                let fit = solve_pairs(&corrupted(&truth, |_, _| true, &mut rng), amplitudes, 100, 1e-9).unwrap();
                assert!(fit.converged && worst(&fit.gains, &truth) < 1e-10, "{n} {amplitudes} {}", worst(&fit.gains, &truth));
                assert!(fit.iterations <= 12, "{n} {amplitudes} {} iterations", fit.iterations);
            }
        }
    }

    #[test]
    fn a_long_loop_is_not_wound_the_wrong_way() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for n in [9, 31] {
            let truth = random_gains(n, false, &mut rng);
            let pairs = corrupted(&truth, |p, q| q - p == 1 || q - p == n - 1, &mut rng);
            let fit = solve_pairs(&pairs, false, 100, 1e-9).unwrap();
            assert!(worst(&fit.gains, &truth) < 1e-9, "{n}: {}", worst(&fit.gains, &truth));
            assert!(fit.condition > 5.0, "{}", fit.condition);
        }
    }

    #[test]
    fn amplitudes_on_a_graph_without_odd_loops_are_refused() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let truth = random_gains(6, true, &mut rng);
        let pairs = corrupted(&truth, |p, q| (p + q) % 2 == 1, &mut rng);
        assert!(solve_pairs(&pairs, true, 100, 1e-9).is_none());
        assert!(solve_pairs(&pairs, false, 100, 1e-9).is_some());
    }

    #[test]
    fn a_model_of_the_wrong_flux_still_gives_the_phases_quickly() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let truth = random_gains(10, false, &mut rng);
        let mut pairs = Pairs::new(10);
        for p in 0..10 {
            for q in p + 1..10 {
                pairs.add(p, q, truth[p] * truth[q].conj() * 7.0, 1.0);
            }
        }
        let fit = solve_pairs(&pairs, false, 100, 1e-9).unwrap();
        assert!(worst(&fit.gains, &truth) < 1e-10 && fit.iterations < 6);
    }

    #[test]
    fn noisy_gains_are_at_the_bottom_of_chi2() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let truth = random_gains(9, true, &mut rng);
        let mut pairs = corrupted(&truth, |p, q| (p + q) % 4 != 1, &mut rng);
        for p in 0..9 {
            for q in p + 1..9 {
                if pairs.mm(p, q) > 0.0 {
                    pairs.add(p, q, Complex64::new(rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3)), 0.0);
                }
            }
        }
        let fit = solve_pairs(&pairs, true, 100, 1e-9).unwrap();
        assert!(fit.converged);
        let bottom = pairs.cost(&fit.gains);
        for p in 0..9 {
            for nudge in
                [Complex64::new(1.0 + 1e-4, 0.0), Complex64::new(1.0 - 1e-4, 0.0), Complex64::new(1.0, 1e-4), Complex64::new(1.0, -1e-4)]
            {
                let mut g = fit.gains.clone();
                g[p] *= nudge;
                // The increase is quadratic, so the test detects a slope of 1e-5 of the curvature.
                assert!(pairs.cost(&g) > bottom, "{p} {nudge}");
            }
        }
    }

    #[test]
    fn noise_alone_is_solved_without_running_away() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for _ in 0..30 {
            let mut pairs = Pairs::new(12);
            for p in 0..12 {
                for q in p + 1..12 {
                    pairs.add(p, q, Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)), 1.0);
                }
            }
            for amplitudes in [false, true] {
                if let Some(fit) = solve_pairs(&pairs, amplitudes, 200, 1e-8) {
                    assert!(fit.gains.iter().all(|g| g.norm().is_finite()));
                }
            }
            assert!(solve_pairs(&pairs, false, 200, 1e-8).unwrap().converged);
        }
    }
}
