//! Simulated annealing: one element moves at a time, and moves that make the layout worse are accepted as a falling temperature allows.
//!
//! The random number that decides on a move is drawn before the move is looked at. It sets the highest score that will be accepted, so for peak side
//! lobes most moves are refused after a few directions.
//!
//! # Reference
//! Kirkpatrick, Gelatt & Vecchi 1983, Science 220, 671; Murino, Trucco & Regazzoni 1996, IEEE Trans. Signal Process. 44, 119 (sparse arrays).

use super::kind::Work;
use crate::design::movable::{is_quick, movable};
use crate::design::repair::repair;
use crate::{ChainError, Result, ensure};
use rand::RngExt;
use std::f64::consts::TAU;

/// Moves for each element, where a move is looked at by its change alone, where the whole figure is computed, and where this makes an image.
const QUICK_MOVES: usize = 1500;
const SLOW_MOVES: usize = 100;
const IMAGE_MOVES: usize = 8;
/// Temperature at the start and at the end, relative to the score of the start.
const HOT: f64 = 0.03;
const COLD: f64 = 2e-4;
/// Length of moves at the start and at the end, in apertures.
const FAR: f64 = 0.3;
const NEAR: f64 = 0.003;

pub(super) fn run(work: Work<'_>) -> Result<Vec<f64>> {
    let Work { problem, evaluator, start, mut random, observer, .. } = work;
    let freedom = &problem.freedom;
    let moves = freedom.free
        * match is_quick(problem) {
            true => QUICK_MOVES,
            false if problem.makes_images() => IMAGE_MOVES,
            false => SLOW_MOVES,
        };
    let mut layout = movable(problem, evaluator, start)?;
    let scale = layout.score().abs().max(1e-6);
    let (mut best, mut found) = (layout.score(), layout.variables());
    for m in 0..moves {
        if m % 256 == 0 {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
        }
        let part = m as f64 / moves as f64;
        let temperature = scale * HOT * (COLD / HOT).powf(part);
        let length = FAR * (NEAR / FAR).powf(part);
        let limit = layout.score() - temperature * random.random::<f64>().max(1e-300).ln();
        let k = random.random_range(0..freedom.free);
        let (step, angle) = (length * random.random::<f64>().sqrt(), TAU * random.random::<f64>());
        let from = layout.place(k);
        let Some(to) = problem.limits.region.nearest([from[0] + step * angle.cos(), from[1] + step * angle.sin()]) else { continue };
        if layout.attempt(k, to, limit)? && layout.score() < best {
            (best, found) = (layout.score(), layout.variables());
        }
    }
    Ok(repair(freedom, &problem.limits, found))
}
