//! Phases and delays: antenna phases that grow linearly over the channels.
//!
//! The delays are first searched on a grid, one antenna against all others at a time, as in a fringe search. Least squares in phases and
//! slopes together then gives the solution.
//!
//! # Reference
//! Schwab & Cotton 1983, AJ 88, 688 (global fringe fitting).

use super::least_squares::{Fit, Pairs};
use crate::linalg::{Cholesky, Matrix, condition_number};
use num_complex::Complex64;

/// Phase (rad at the middle of the band) and slope (rad over half the band) of an antenna.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    phase: f64,
    slope: f64,
}

/// One sum for each baseline and channel. The channels have coordinates x in -1..1.
struct Band<'a> {
    pairs: &'a [Pairs],
    x: Vec<f64>,
    n: usize,
    /// Slopes searched.
    grid: Vec<f64>,
}

impl Band<'_> {
    fn gains(&self, lines: &[Line]) -> Vec<Vec<Complex64>> {
        self.x.iter().map(|x| lines.iter().map(|l| Complex64::from_polar(1.0, l.phase + l.slope * x)).collect()).collect()
    }

    fn alignment(&self, lines: &[Line]) -> f64 {
        self.gains(lines).iter().zip(self.pairs).map(|(g, p)| p.alignment(g)).sum()
    }

    /// The line that best aligns a spectrum \[chan\], by search over the grid.
    fn search(&self, spectrum: &[Complex64]) -> Line {
        let sum = |slope: f64| spectrum.iter().zip(&self.x).map(|(y, x)| y * Complex64::from_polar(1.0, -slope * x)).sum::<Complex64>();
        let best = self.grid.iter().map(|s| (*s, sum(*s))).max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()));
        best.map_or_else(Line::default, |(slope, z)| Line { phase: z.arg(), slope })
    }

    /// Lines that are found from antenna to antenna along the strongest baselines.
    fn tree(&self) -> Option<Vec<Line>> {
        let n = self.n;
        let strength = |p: usize, q: usize| self.pairs.iter().map(|c| c.vm(p, q).norm()).sum::<f64>();
        let mut lines = vec![Line::default(); n];
        let mut reached = vec![false; n];
        let mut best = vec![(0.0, 0); n];
        let mut newest = (0..n).max_by(|a, b| {
            let total = |p: usize| (0..n).map(|q| strength(p, q)).sum::<f64>();
            total(*a).total_cmp(&total(*b))
        })?;
        reached[newest] = true;
        for _ in 1..n {
            for q in (0..n).filter(|q| !reached[*q]) {
                let s = strength(q, newest);
                if s > best[q].0 {
                    best[q] = (s, newest);
                }
            }
            let q = (0..n).filter(|q| !reached[*q]).max_by(|a, b| best[*a].0.total_cmp(&best[*b].0))?;
            let parent = best[q].1;
            if best[q].0 <= 0.0 {
                return None;
            }
            let spectrum: Vec<Complex64> = self.pairs.iter().map(|c| c.vm(q, parent)).collect();
            let edge = self.search(&spectrum);
            lines[q] = Line { phase: lines[parent].phase + edge.phase, slope: lines[parent].slope + edge.slope };
            reached[q] = true;
            newest = q;
        }
        Some(lines)
    }

    /// Search each antenna again against all the others. The result is true if a better solution was found.
    fn sweep(&self, lines: &mut [Line]) -> bool {
        let mut better = false;
        let mut gains = self.gains(lines);
        for p in 0..self.n {
            let spectrum: Vec<Complex64> =
                self.pairs.iter().zip(&gains).map(|(c, g)| (0..self.n).map(|q| c.vm(p, q) * g[q]).sum()).collect();
            let score = |l: &Line| {
                let aligned = |(y, x): (&Complex64, &f64)| (y * Complex64::from_polar(1.0, -l.phase - l.slope * x)).re;
                spectrum.iter().zip(&self.x).map(aligned).sum::<f64>()
            };
            let found = self.search(&spectrum);
            if score(&found) > score(&lines[p]) {
                lines[p] = found;
                better = true;
                for (g, x) in gains.iter_mut().zip(&self.x) {
                    g[p] = Complex64::from_polar(1.0, found.phase + found.slope * x);
                }
            }
        }
        better
    }

    /// The Gauss-Newton system for phases (first n) and slopes (last n), and its gradient.
    fn system(&self, lines: &[Line], weight: impl Fn(Complex64) -> f64) -> (Matrix, Vec<f64>) {
        let n = self.n;
        let mut a = Matrix::zeros(2 * n, 2 * n);
        let mut gradient = vec![0.0; 2 * n];
        for ((pairs, g), x) in self.pairs.iter().zip(self.gains(lines)).zip(&self.x) {
            for p in 0..n {
                for q in p + 1..n {
                    let e = pairs.vm(p, q) * g[p].conj() * g[q];
                    let k = weight(e);
                    for (i, xi) in [(0, 1.0), (n, *x)] {
                        gradient[i + p] += e.im * xi;
                        gradient[i + q] -= e.im * xi;
                        for (j, xj) in [(0, 1.0), (n, *x)] {
                            a[(i + p, j + p)] += k * xi * xj;
                            a[(i + q, j + q)] += k * xi * xj;
                            a[(i + p, j + q)] -= k * xi * xj;
                            a[(i + q, j + p)] -= k * xi * xj;
                        }
                    }
                }
            }
        }
        // A common phase and a common slope have no curvature. They get the mean curvature.
        for block in [0, n] {
            let mean = (0..n).map(|p| a[(block + p, block + p)]).sum::<f64>() / (n * n) as f64;
            for p in 0..n {
                for q in 0..n {
                    a[(block + p, block + q)] += mean;
                }
            }
        }
        (a, gradient)
    }
}

/// Unit gains \[chan\]\[ant\] with phases linear in frequency. `None` where the antennas are not connected or a slope is not measured.
pub(crate) fn solve_delays(pairs: &[Pairs], freq_hz: &[f64], max_iterations: usize, tolerance: f64) -> Option<(Vec<Vec<Complex64>>, Fit)> {
    let n = pairs.first()?.n;
    let (low, high) = freq_hz.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), f| (l.min(*f), h.max(*f)));
    if !(high > low) {
        return None;
    }
    let x: Vec<f64> = freq_hz.iter().map(|f| (2.0 * f - low - high) / (high - low)).collect();
    let mut sorted = x.clone();
    sorted.sort_by(f64::total_cmp);
    let spacing = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 1e-9).fold(2.0, f64::min);
    // The channels cannot distinguish slopes above pi per channel. The peak of the search is about pi wide.
    let reach = std::f64::consts::PI / spacing;
    let steps = ((reach / (std::f64::consts::PI / 4.0)).ceil() as i64).min(8192);
    let grid = (-steps..=steps).map(|i| reach * i as f64 / steps as f64).collect();
    let band = Band { pairs, x, n, grid };
    let mut lines = band.tree()?;
    for _ in 0..5 {
        if !band.sweep(&mut lines) {
            break;
        }
    }
    let mut score = band.alignment(&lines);
    let (mut iterations, mut converged) = (0, false);
    while iterations < max_iterations && !converged {
        iterations += 1;
        let attempt = |clip: bool| {
            let weight = |e: Complex64| if clip { e.re.max(0.2 * e.norm()) } else { e.norm() };
            let (a, gradient) = band.system(&lines, weight);
            let d = Cholesky::new(&a)?.solve(&gradient);
            let moved: Vec<Line> =
                lines.iter().enumerate().map(|(p, l)| Line { phase: l.phase + d[p], slope: l.slope + d[n + p] }).collect();
            Some((band.alignment(&moved), moved, d))
        };
        let newton = attempt(true)?;
        let (new_score, moved, change) = if newton.0 >= score * (1.0 - 1e-13) { newton } else { attempt(false)? };
        (lines, score) = (moved, new_score);
        let relative = |d: &[f64]| {
            let mean = d.iter().sum::<f64>() / n as f64;
            d.iter().map(|d| (d - mean).abs()).fold(0.0, f64::max)
        };
        converged = relative(&change[..n]).max(relative(&change[n..])) < tolerance;
    }
    let (a, _) = band.system(&lines, |e| e.norm());
    let condition = Cholesky::new(&a).map_or(f64::INFINITY, |c| condition_number(&a, &c, None));
    let gains = band.gains(&lines);
    (condition < 1e12).then_some((gains, Fit { gains: Vec::new(), iterations, converged, condition }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn delays_of_many_turns_come_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let freq: Vec<f64> = (0..32).map(|c| 8e9 + 2e6 * f64::from(c)).collect();
        let n = 8;
        // Half the unambiguous range of 1 / (2 MHz).
        let truth: Vec<(f64, f64)> = (0..n).map(|_| (rng.random_range(-3.0..3.0), rng.random_range(-1.2e-7..1.2e-7))).collect();
        let gain = |p: usize, f: f64| Complex64::from_polar(1.0, truth[p].0 + std::f64::consts::TAU * truth[p].1 * (f - freq[0]));
        let pairs: Vec<Pairs> = freq
            .iter()
            .map(|f| {
                let mut c = Pairs::new(n);
                for p in 0..n {
                    for q in p + 1..n {
                        let noise = Complex64::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5)) * 1e-7;
                        c.add(p, q, gain(p, *f) * gain(q, *f).conj() + noise, 1.0);
                    }
                }
                c
            })
            .collect();
        let (gains, fit) = solve_delays(&pairs, &freq, 50, 1e-9).unwrap();
        assert!(fit.converged);
        for (g, f) in gains.iter().zip(&freq) {
            for p in 1..n {
                let error = (g[p] / g[0] / (gain(p, *f) / gain(0, *f))).arg();
                assert!(error.abs() < 1e-6, "{p} {error}");
            }
        }
    }
}
