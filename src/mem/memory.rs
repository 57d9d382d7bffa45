//! The two-loop recursion of L-BFGS. The gradients of data and penalty are stored separately.
//!
//! J = lambda (chi2 / 2) + R, so a difference of gradients is lambda times that of the data plus that of the penalty. The separate
//! differences are valid for any lambda. The multiplier may therefore change at every step without loss of the stored curvature.
//!
//! # Reference
//! Nocedal 1980, Math. Comput. 35, 773.

use ndarray::Array2;
use rayon::prelude::*;
use std::collections::VecDeque;

/// Differences of the last steps.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    pairs: VecDeque<Pair>,
    depth: usize,
}

#[derive(Debug, Clone)]
struct Pair {
    step: Vec<f32>,
    data: Vec<f32>,
    penalty: Vec<f32>,
    /// Scalar products of the step with itself, the data and the penalty, and of the latter two with each other (data data, data penalty,
    /// penalty penalty). All products for any lambda follow from these.
    step_with: [f64; 3],
    sides: [f64; 3],
}

/// Step times step, step times y, y times y.
struct Products {
    ss: f64,
    sy: f64,
    yy: f64,
}

/// Pixels of one task. The length is fixed, so that any number of threads gives the same sums.
const SHARE: usize = 1 << 15;

fn dot(a: &[f32], b: &[f32]) -> f64 {
    let parts = a.par_chunks(SHARE).zip(b.par_chunks(SHARE));
    let sums: Vec<f64> = parts.map(|(a, b)| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()).collect();
    sums.iter().sum()
}

/// A pair that contributes to a direction, with its coefficient of the first loop.
struct Used<'a> {
    pair: &'a Pair,
    curvature: f64,
    yy: f64,
    a: f64,
}

impl Pair {
    fn new(step: Vec<f32>, data: Vec<f32>, penalty: Vec<f32>) -> Self {
        let step_with = [dot(&step, &step), dot(&step, &data), dot(&step, &penalty)];
        let sides = [dot(&data, &data), dot(&data, &penalty), dot(&penalty, &penalty)];
        Self { step, data, penalty, step_with, sides }
    }

    /// Scalar products of step and y = penalty + lambda data.
    fn products(&self, lambda: f64) -> Products {
        let [ss, sd, sp] = self.step_with;
        let [dd, dp, pp] = self.sides;
        Products { ss, sy: sp + lambda * sd, yy: pp + lambda * (2.0 * dp + lambda * dd) }
    }

    /// Add a multiple of y to q.
    fn add_y(&self, factor: f64, lambda: f64, q: &mut [f32]) {
        let sides = self.data.par_chunks(SHARE).zip(self.penalty.par_chunks(SHARE));
        q.par_chunks_mut(SHARE).zip(sides).for_each(|(q, (data, penalty))| {
            for ((q, d), p) in q.iter_mut().zip(data).zip(penalty) {
                *q += (factor * (f64::from(*p) + lambda * f64::from(*d))) as f32;
            }
        });
    }

    fn y_times(&self, lambda: f64, q: &[f32]) -> f64 {
        dot(&self.penalty, q) + lambda * dot(&self.data, q)
    }

    fn add_step(&self, factor: f64, q: &mut [f32]) {
        let add = |(q, s): (&mut f32, &f32)| *q += (factor * f64::from(*s)) as f32;
        q.par_chunks_mut(SHARE).zip(self.step.par_chunks(SHARE)).for_each(|(q, s)| q.iter_mut().zip(s).for_each(add));
    }
}

impl Memory {
    pub(super) fn new(depth: usize) -> Self {
        Self { pairs: VecDeque::with_capacity(depth), depth }
    }

    pub(super) fn clear(&mut self) {
        self.pairs.clear();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Store a step, and the differences of the gradients of chi2 / 2 and of the penalty with respect to s.
    pub(super) fn push(&mut self, step: Array2<f32>, data: Array2<f32>, penalty: Array2<f32>) {
        if self.pairs.len() == self.depth {
            self.pairs.pop_front();
        }
        let flat = |a: Array2<f32>| a.into_iter().collect::<Vec<f32>>();
        self.pairs.push_back(Pair::new(flat(step), flat(data), flat(penalty)));
    }

    /// The direction -B g for this lambda; minus the gradient while the memory is empty.
    pub(super) fn direction(&self, gradient: &Array2<f32>, lambda: f64) -> Array2<f32> {
        let mut q: Vec<f32> = gradient.iter().map(|g| -g).collect();
        let mut used = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let Products { ss, sy: curvature, yy } = pair.products(lambda);
            if !(curvature > 1e-10 * (yy * ss).sqrt()) {
                continue;
            }
            let a = dot(&pair.step, &q) / curvature;
            pair.add_y(-a, lambda, &mut q);
            used.push(Used { pair, curvature, yy, a });
        }
        if let Some(Used { curvature, yy, .. }) = used.first() {
            let scale = (curvature / yy) as f32;
            q.iter_mut().for_each(|q| *q *= scale);
        }
        for Used { pair, curvature, a, .. } in used.iter().rev() {
            let b = pair.y_times(lambda, &q) / curvature;
            pair.add_step(a - b, &mut q);
        }
        let mut direction = Array2::zeros(gradient.dim());
        direction.iter_mut().zip(q).for_each(|(d, q)| *d = q);
        direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_solves_a_quadratic_for_any_multiplier_from_the_steps_of_another() {
        let (a, b) = ([1.0, 4.0, 9.0], [2.0, 1.0, 3.0]);
        let mut memory = Memory::new(3);
        assert!(memory.is_empty());
        for k in 0..3 {
            let mut step = Array2::zeros((1, 3));
            step[(0, k)] = 0.5;
            let along = |c: [f32; 3]| Array2::from_shape_fn((1, 3), |(_, j)| c[j] * step[(0, j)]);
            memory.push(step.clone(), along(a), along(b));
        }
        for lambda in [0.1, 1.0, 20.0] {
            let gradient = Array2::from_shape_fn((1, 3), |(_, j)| 1.0 + j as f32);
            let d = memory.direction(&gradient, lambda);
            for j in 0..3 {
                let newton = -f64::from(gradient[(0, j)]) / (lambda * f64::from(a[j]) + f64::from(b[j]));
                assert!((f64::from(d[(0, j)]) - newton).abs() < 1e-6, "{lambda} {j}");
            }
        }
        memory.clear();
        assert_eq!(memory.direction(&Array2::ones((1, 1)), 1.0)[(0, 0)], -1.0);
    }
}
