//! Limited-memory quasi-Newton minimisation, value and gradient together.
//!
//! The solvers of argmin ask for value and gradient separately, which doubles the number of transforms. This solver evaluates both together
//! and accepts most steps at the first trial.
//!
//! # Reference
//! Nocedal & Wright 2006, Numerical Optimization, algorithms 7.4 and 7.5 (two loops), 3.5 and 3.6 (strong Wolfe conditions).

use std::collections::VecDeque;

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Most iterations.
    pub(crate) iterations: usize,
    /// Relative decrease in one iteration below which it has converged.
    pub(crate) decrease: f64,
}

/// The result of a minimisation.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub(crate) x: Vec<f64>,
    pub(crate) value: f64,
    pub(crate) evaluations: usize,
}

/// Pairs of steps that are remembered.
const MEMORY: usize = 10;
const SUFFICIENT: f64 = 1e-4;
const CURVATURE: f64 = 0.9;
/// Evaluations that a line search may take.
const TRIES: usize = 20;

/// The sum consists of eight independent partial sums, which the processor can compute at the same time.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(s, (a, b))| *s += a * b);
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// One step and the change of the gradient along it, with 1 / (step times change).
struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
    rho: f64,
}

#[derive(Clone)]
struct State {
    step: f64,
    value: f64,
    slope: f64,
    x: Vec<f64>,
    gradient: Vec<f64>,
}

/// Minimise `f`, which writes its gradient, from `x`.
pub(crate) fn minimise(x: Vec<f64>, limits: Limits, f: &mut dyn FnMut(&[f64], &mut [f64]) -> f64) -> Minimum {
    let mut gradient = vec![0.0; x.len()];
    let value = f(&x, &mut gradient);
    let mut evaluations = 1;
    let mut at = State { step: 0.0, value, slope: 0.0, x, gradient };
    let mut memory: VecDeque<Pair> = VecDeque::with_capacity(MEMORY);
    for _ in 0..limits.iterations {
        let mut direction = downhill(&memory, &at.gradient);
        let mut slope = dot(&direction, &at.gradient);
        if !(slope < 0.0) {
            memory.clear();
            direction = at.gradient.iter().map(|g| -g).collect();
            slope = -dot(&at.gradient, &at.gradient);
        }
        if slope == 0.0 || !slope.is_finite() {
            break;
        }
        let first = if memory.is_empty() { 1.0_f64.min(1.0 / dot(&at.gradient, &at.gradient).sqrt()) } else { 1.0 };
        at.slope = slope;
        at.step = 0.0;
        let found = search(&at, &direction, first, &mut evaluations, f);
        let Some(next) = found else {
            if memory.is_empty() {
                break;
            }
            memory.clear();
            continue;
        };
        let s: Vec<f64> = next.x.iter().zip(&at.x).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = next.gradient.iter().zip(&at.gradient).map(|(a, b)| a - b).collect();
        let sy = dot(&s, &y);
        if sy > 1e-12 * dot(&y, &y).sqrt() * dot(&s, &s).sqrt() {
            if memory.len() == MEMORY {
                memory.pop_front();
            }
            memory.push_back(Pair { step: s, change: y, rho: 1.0 / sy });
        }
        let gained = (at.value - next.value) / at.value.abs().max(next.value.abs()).max(1e-300);
        at = next;
        if gained <= limits.decrease {
            break;
        }
    }
    Minimum { x: at.x, value: at.value, evaluations }
}

/// Minus the approximate inverse Hessian times the gradient.
fn downhill(memory: &VecDeque<Pair>, gradient: &[f64]) -> Vec<f64> {
    let mut q: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut alpha = Vec::with_capacity(memory.len());
    for Pair { step: s, change: y, rho } in memory.iter().rev() {
        let a = rho * dot(s, &q);
        q.iter_mut().zip(y).for_each(|(q, y)| *q -= a * y);
        alpha.push(a);
    }
    if let Some(Pair { change: y, rho, .. }) = memory.back() {
        let scale = 1.0 / (rho * dot(y, y));
        q.iter_mut().for_each(|q| *q *= scale);
    }
    for (Pair { step: s, change: y, rho }, a) in memory.iter().zip(alpha.iter().rev()) {
        let b = rho * dot(y, &q);
        q.iter_mut().zip(s).for_each(|(q, s)| *q += (a - b) * s);
    }
    q
}

/// A step that meets the strong Wolfe conditions, or at least decreases the value. `None` if there is no such step.
fn search(
    start: &State,
    direction: &[f64],
    first: f64,
    evaluations: &mut usize,
    f: &mut dyn FnMut(&[f64], &mut [f64]) -> f64,
) -> Option<State> {
    let mut probe = |step: f64| {
        let x: Vec<f64> = start.x.iter().zip(direction).map(|(x, d)| x + step * d).collect();
        let mut gradient = vec![0.0; x.len()];
        let value = f(&x, &mut gradient);
        *evaluations += 1;
        let slope = dot(&gradient, direction);
        let finite = value.is_finite() && slope.is_finite();
        State { step, value: if finite { value } else { f64::INFINITY }, slope, x, gradient }
    };
    let too_high = |s: &State| !(s.value <= start.value + SUFFICIENT * s.step * start.slope);
    let (mut low, mut high): (State, Option<State>) = (start.clone(), None);
    let mut step = first;
    for _ in 0..TRIES {
        let now = probe(step);
        if too_high(&now) || (low.step > 0.0 && now.value >= low.value) {
            high = Some(now);
        } else {
            if now.slope.abs() <= -CURVATURE * start.slope {
                return Some(now);
            }
            // The minimum lies between the new lowest point and the end towards which the value decreases.
            let turns = now.slope * (high.as_ref().map_or(1.0, |h| h.step) - now.step);
            let beyond = high.is_none() && now.slope > 0.0;
            if beyond || (high.is_some() && turns >= 0.0) {
                high = Some(std::mem::replace(&mut low, now));
            } else {
                low = now;
            }
        }
        step = match &high {
            None => 2.0 * low.step.max(first),
            Some(high) => between(&low, high),
        };
    }
    (low.step > 0.0).then_some(low)
}

/// The minimum of the cubic through two points and their slopes, limited to a range inside the two points.
fn between(low: &State, high: &State) -> f64 {
    let width = high.step - low.step;
    let cubic = if high.value.is_finite() {
        let d1 = low.slope + high.slope - 3.0 * (low.value - high.value) / (low.step - high.step);
        let d2 = (d1 * d1 - low.slope * high.slope).max(0.0).sqrt() * width.signum();
        1.0 - (high.slope + d2 - d1) / (high.slope - low.slope + 2.0 * d2)
    } else {
        0.1
    };
    let part = if cubic.is_finite() { cubic.clamp(0.1, 0.9) } else { 0.5 };
    low.step + part * width
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_banana_valley_is_followed_to_its_end() {
        let mut f = |x: &[f64], g: &mut [f64]| {
            let mut sum = 0.0;
            g.fill(0.0);
            for i in (0..x.len()).step_by(2) {
                let (a, b) = (1.0 - x[i], x[i + 1] - x[i] * x[i]);
                sum += a * a + 100.0 * b * b;
                g[i] += -2.0 * a - 400.0 * b * x[i];
                g[i + 1] += 200.0 * b;
            }
            sum
        };
        let limits = Limits { iterations: 200, decrease: 1e-16 };
        let found = minimise([-1.2, 1.0].repeat(10), limits, &mut f);
        assert!(found.value < 1e-10 && found.evaluations < 150, "{} after {}", found.value, found.evaluations);
        assert!(found.x.iter().all(|x| (x - 1.0).abs() < 1e-4));
    }

    #[test]
    fn values_that_are_not_finite_are_walked_back_from() {
        let mut f = |x: &[f64], g: &mut [f64]| {
            g[0] = 1.0 - 1.0 / x[0];
            if x[0] > 0.0 { x[0] - x[0].ln() } else { f64::NAN }
        };
        let found = minimise(vec![0.01], Limits { iterations: 50, decrease: 1e-15 }, &mut f);
        assert!((found.x[0] - 1.0).abs() < 1e-5, "{:?}", found.x);
    }
}
