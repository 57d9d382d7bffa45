//! One step towards the lowest maximum of many functions.
//!
//! Near a point, each function is its value plus its slope. The step minimises the highest of these plus (damping / 2) times the squared length:
//! a quadratic program, solved by an interior-point method.
//!
//! # Reference
//! Mehrotra 1992, SIAM J. Optim. 2, 575 (predictor and corrector); Nocedal & Wright 2006, Numerical Optimization, section 16.6.

use super::kernels::{LANES, products};
use crate::linalg::{Cholesky, Matrix, dot};

/// Iterations at most.
const ITERATIONS: usize = 40;

/// Some functions at a point.
#[derive(Debug, Clone, Default)]
pub(super) struct Functions {
    /// Their values \[function\].
    pub(super) values: Vec<f64>,
    /// Their slopes \[function\]\[variable\].
    pub(super) slopes: Vec<Vec<f64>>,
}

impl Functions {
    pub(super) fn push(&mut self, value: f64, slope: Vec<f64>) {
        self.values.push(value);
        self.slopes.push(slope);
    }
}

/// The step, and the highest value that the slopes promise after it. `None` where rounding prevents a solution.
pub(super) fn step(f: &Functions, variables: usize, damping: f64) -> Option<(Vec<f64>, f64)> {
    let m = f.values.len();
    let highest = f.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = f.values.iter().copied().fold(f64::INFINITY, f64::min);
    let room = (highest - lowest).max(1e-3 * highest.abs()).max(1e-12);
    let (mut x, mut t) = (vec![0.0; variables], highest + 0.1 * room);
    let (mut slack, mut dual) = (f.values.iter().map(|v| t - v).collect::<Vec<_>>(), vec![1.0 / m as f64; m]);
    let columns = columns(f, variables);
    for _ in 0..ITERATIONS {
        let rise: Vec<f64> = f.slopes.iter().map(|s| dot(s, &x)).collect();
        let mut r_x: Vec<f64> = x.iter().map(|x| damping * x).collect();
        for (s, d) in f.slopes.iter().zip(&dual) {
            r_x.iter_mut().zip(s).for_each(|(r, s)| *r += d * s);
        }
        let r_t = 1.0 - dual.iter().sum::<f64>();
        let r_p: Vec<f64> = (0..m).map(|i| f.values[i] + rise[i] - t + slack[i]).collect();
        let gap = dot(&slack, &dual) / m as f64;
        if gap * m as f64 <= 1e-7 * room && r_t.abs() < 1e-9 {
            break;
        }
        let ratio: Vec<f64> = dual.iter().zip(&slack).map(|(d, s)| d / s).collect();
        let system = System::new(&columns, damping, &ratio)?;
        let newton = |r_c: &[f64]| {
            let shift: Vec<f64> = (0..m).map(|i| ratio[i] * r_p[i] - r_c[i] / slack[i]).collect();
            let (dx, dt) = system.solve(f, &r_x, r_t, &shift);
            let d_rise: Vec<f64> = f.slopes.iter().map(|s| dot(s, &dx)).collect();
            let d_slack: Vec<f64> = (0..m).map(|i| -r_p[i] - d_rise[i] + dt).collect();
            let d_dual: Vec<f64> = (0..m).map(|i| (-r_c[i] - dual[i] * d_slack[i]) / slack[i]).collect();
            (dx, dt, d_slack, d_dual)
        };
        let predictor: Vec<f64> = (0..m).map(|i| slack[i] * dual[i]).collect();
        let (_, _, d_slack, d_dual) = newton(&predictor);
        let (a_p, a_d) = (longest(&slack, &d_slack), longest(&dual, &d_dual));
        let after = (0..m).map(|i| (slack[i] + a_p * d_slack[i]) * (dual[i] + a_d * d_dual[i])).sum::<f64>() / m as f64;
        let center = (after / gap).powi(3) * gap;
        let corrector: Vec<f64> = (0..m).map(|i| slack[i] * dual[i] + d_slack[i] * d_dual[i] - center).collect();
        let (dx, dt, d_slack, d_dual) = newton(&corrector);
        let length = 0.99 * longest(&slack, &d_slack).min(longest(&dual, &d_dual));
        if !length.is_finite() || length < 1e-10 {
            break;
        }
        x.iter_mut().zip(&dx).for_each(|(x, d)| *x += length * d);
        t += length * dt;
        slack.iter_mut().zip(&d_slack).for_each(|(s, d)| *s += length * d);
        dual.iter_mut().zip(&d_dual).for_each(|(s, d)| *s += length * d);
    }
    let promised = (0..m).map(|i| f.values[i] + dot(&f.slopes[i], &x)).fold(f64::NEG_INFINITY, f64::max);
    (promised.is_finite() && x.iter().all(|x| x.is_finite())).then_some((x, promised))
}

/// The slopes by each variable \[variable\]\[function\], with zeros at the end up to a multiple of [`LANES`].
fn columns(f: &Functions, variables: usize) -> Vec<Vec<f64>> {
    let mut out = vec![vec![0.0; f.slopes.len().next_multiple_of(LANES)]; variables];
    for (i, slope) in f.slopes.iter().enumerate() {
        out.iter_mut().zip(slope).for_each(|(column, s)| column[i] = *s);
    }
    out
}

/// The largest part of a step, up to 1, that leaves all numbers positive.
fn longest(values: &[f64], steps: &[f64]) -> f64 {
    values.iter().zip(steps).filter(|(_, d)| **d < 0.0).fold(1.0, |a, (v, d)| a.min(-v / d))
}

/// The linear system of one iteration.
struct System {
    factor: Cholesky,
    ratio: Vec<f64>,
    pull: Vec<f64>,
    solved_pull: Vec<f64>,
}

impl System {
    fn new(columns: &[Vec<f64>], damping: f64, ratio: &[f64]) -> Option<Self> {
        let n = columns.len();
        let (mut h, mut pull) = (Matrix::zeros(n, n), vec![0.0; n]);
        let mut scaled = vec![0.0; columns.first().map_or(0, Vec::len)];
        for (i, column) in columns.iter().enumerate() {
            scaled.iter_mut().zip(column.iter().zip(ratio)).for_each(|(s, (c, r))| *s = c * r);
            pull[i] = scaled.iter().sum();
            products(&scaled, &columns[..=i], &mut h.row_mut(i)[..=i]);
        }
        (0..n).for_each(|i| h[(i, i)] += damping);
        let factor = Cholesky::new(&h)?;
        let solved_pull = factor.solve(&pull);
        Some(Self { factor, ratio: ratio.to_vec(), pull, solved_pull })
    }

    fn solve(&self, f: &Functions, r_x: &[f64], r_t: f64, shift: &[f64]) -> (Vec<f64>, f64) {
        let mut b: Vec<f64> = r_x.iter().map(|r| -r).collect();
        for (slope, s) in f.slopes.iter().zip(shift) {
            b.iter_mut().zip(slope).for_each(|(b, g)| *b -= s * g);
        }
        let solved = self.factor.solve(&b);
        let right = r_t - shift.iter().sum::<f64>() - dot(&self.pull, &solved);
        let dt = right / (dot(&self.pull, &self.solved_pull) - self.ratio.iter().sum::<f64>());
        (solved.iter().zip(&self.solved_pull).map(|(a, b)| a + dt * b).collect(), dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_at_their_lowest_common_point() {
        // max(x, y, -x - y + 1) is lowest where all three are 1/3.
        let mut f = Functions::default();
        f.push(0.0, vec![1.0, 0.0]);
        f.push(0.0, vec![0.0, 1.0]);
        f.push(1.0, vec![-1.0, -1.0]);
        let (x, t) = step(&f, 2, 1e-6).unwrap();
        assert!((t - 1.0 / 3.0).abs() < 1e-6 && x.iter().all(|x| (x - 1.0 / 3.0).abs() < 1e-4), "{x:?} {t}");
    }

    #[test]
    fn damping_shortens_the_step() {
        // One function of slope 1: the minimum of x + (d / 2) x^2 is at -1 / d.
        let mut f = Functions::default();
        f.push(5.0, vec![1.0]);
        let (x, t) = step(&f, 1, 4.0).unwrap();
        assert!((x[0] + 0.25).abs() < 1e-6 && (t - 4.75).abs() < 1e-6, "{x:?} {t}");
    }
}
