//! From a layout that violates its limits a little to one nearby that meets them.

use super::freedom::Freedom;
use super::limits::Limits;
use crate::lbfgs::{self, minimise};

/// Rounds at most.
const ROUNDS: usize = 20;

/// Move elements until all limits are met, or as nearly as a few rounds can.
pub(super) fn repair(freedom: &Freedom, limits: &Limits, mut x: Vec<f64>) -> Vec<f64> {
    let strict = limits.stricter();
    let mut by_position = vec![[0.0; 2]; freedom.elements()];
    for _ in 0..ROUNDS {
        limits.put_inside(freedom, &mut x);
        if limits.worst(&freedom.positions(&x)) <= 0.0 {
            break;
        }
        let mut f = |x: &[f64], gradient: &mut [f64]| {
            by_position.fill([0.0; 2]);
            let value = strict.penalty(&freedom.positions(x), 1.0, &mut by_position);
            freedom.pull_back(&by_position, gradient);
            value
        };
        x = minimise(x, lbfgs::Limits { iterations: 100, decrease: 1e-9 }, &mut f).x;
    }
    x
}
