//! The two-loop recursion of L-BFGS with the gradients of the two sides of the objective kept apart.
//!
//! J = lambda (chi2 / 2) + R, so a difference of gradients is lambda times one of the data plus one of the penalty. Kept apart they serve
//! any lambda: the multiplier may change at every step and no curvature is forgotten.
//!
//! # Reference
//! Nocedal 1980, Math. Comput. 35, 773.

use ndarray::{Array2, Zip};
use std::collections::VecDeque;

/// Differences of the last steps.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    pairs: VecDeque<Pair>,
    depth: usize,
}

#[derive(Debug, Clone)]
struct Pair {
    step: Array2<f64>,
    data: Array2<f64>,
    penalty: Array2<f64>,
}

fn dot(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let mut sum = 0.0;
    Zip::from(a).and(b).for_each(|a, b| sum += a * b);
    sum
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

    /// Remember a step and the differences of the gradients by s of chi2 / 2 and of the penalty.
    pub(super) fn push(&mut self, step: Array2<f64>, data: Array2<f64>, penalty: Array2<f64>) {
        if self.pairs.len() == self.depth {
            self.pairs.pop_front();
        }
        self.pairs.push_back(Pair { step, data, penalty });
    }

    /// The direction -B g for this lambda; minus the gradient where nothing is remembered.
    pub(super) fn direction(&self, gradient: &Array2<f64>, lambda: f64) -> Array2<f64> {
        let mut q = gradient.mapv(|g| -g);
        let mut used = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let mut y = pair.penalty.clone();
            y.scaled_add(lambda, &pair.data);
            let curvature = dot(&pair.step, &y);
            let (yy, ss) = (dot(&y, &y), dot(&pair.step, &pair.step));
            if !(curvature > 1e-10 * (yy * ss).sqrt()) {
                continue;
            }
            let a = dot(&pair.step, &q) / curvature;
            q.scaled_add(-a, &y);
            used.push((pair, y, curvature, yy, a));
        }
        if let Some((_, _, curvature, yy, _)) = used.first() {
            q *= curvature / yy;
        }
        for (pair, y, curvature, _, a) in used.iter().rev() {
            let b = dot(y, &q) / curvature;
            q.scaled_add(a - b, &pair.step);
        }
        q
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
            let along = |c: [f64; 3]| Array2::from_shape_fn((1, 3), |(_, j)| c[j] * step[(0, j)]);
            memory.push(step.clone(), along(a), along(b));
        }
        for lambda in [0.1, 1.0, 20.0] {
            let gradient = Array2::from_shape_fn((1, 3), |(_, j)| 1.0 + j as f64);
            let d = memory.direction(&gradient, lambda);
            for j in 0..3 {
                let newton = -gradient[(0, j)] / (lambda * a[j] + b[j]);
                assert!((d[(0, j)] - newton).abs() < 1e-12, "{lambda} {j}");
            }
        }
        memory.clear();
        assert_eq!(memory.direction(&Array2::ones((1, 1)), 1.0)[(0, 0)], -1.0);
    }
}
