//! Simulated annealing: one element moves at a time, and moves that make the layout worse are accepted as a falling temperature allows.
//!
//! The random number that decides on a move is drawn before the move is looked at. It sets the highest score that will be accepted, so for peak side
//! lobes most moves are refused after a few directions.
//!
//! # Reference
//! Kirkpatrick, Gelatt & Vecchi 1983, Science 220, 671; Murino, Trucco & Regazzoni 1996, IEEE Trans. Signal Process. 44, 119 (sparse arrays).

use super::kind::Work;
use crate::design::freedom::Freedom;
use crate::design::lobes::LobeGrid;
use crate::design::moving_lobes::MovingLobes;
use crate::design::problem::{Evaluator, Problem};
use crate::design::repair::repair;
use crate::{ChainError, Result, ensure};
use rand::RngExt;
use std::f64::consts::TAU;

/// Moves for each element, where a move is looked at by its change alone, and where the whole figure is computed.
const QUICK_MOVES: usize = 1500;
const SLOW_MOVES: usize = 100;
/// Temperature at the start and at the end, relative to the score of the start.
const HOT: f64 = 0.03;
const COLD: f64 = 2e-4;
/// Length of moves at the start and at the end, in apertures.
const FAR: f64 = 0.3;
const NEAR: f64 = 0.003;
/// Distance of the directions of side lobes. Tops between them are higher by a few per cent at most.
const GRID_STEP: f64 = 0.25;

/// A layout whose elements can be moved one by one.
trait Movable {
    fn score(&self) -> f64;
    /// Move free element `k` if the score does not rise above `limit`. Returns whether it was moved.
    fn attempt(&mut self, k: usize, to: [f64; 2], limit: f64) -> Result<bool>;
    /// The place of free element `k`.
    fn place(&self, k: usize) -> [f64; 2];
    fn variables(&self) -> Vec<f64>;
}

pub(super) fn run(work: Work<'_>) -> Result<Vec<f64>> {
    let Work { problem, evaluator, start, mut random, observer, .. } = work;
    let freedom = &problem.freedom;
    let quick = problem.only_peak() && freedom.symmetry == 1;
    let mut layout: Box<dyn Movable + '_> =
        if quick { Box::new(Lobes::new(problem, &start)) } else { Box::new(Whole::new(problem, evaluator, start)?) };
    let moves = freedom.free * if quick { QUICK_MOVES } else { SLOW_MOVES };
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

/// Any objectives: the figures are computed anew for each move.
struct Whole<'a> {
    freedom: &'a Freedom,
    evaluator: &'a mut Evaluator,
    x: Vec<f64>,
    score: f64,
}

impl<'a> Whole<'a> {
    fn new(problem: &'a Problem, evaluator: &'a mut Evaluator, x: Vec<f64>) -> Result<Self> {
        let score = evaluator.score(&problem.freedom.positions(&x))?;
        Ok(Self { freedom: &problem.freedom, evaluator, x, score })
    }
}

impl Movable for Whole<'_> {
    fn score(&self) -> f64 {
        self.score
    }

    fn attempt(&mut self, k: usize, to: [f64; 2], limit: f64) -> Result<bool> {
        let mut x = self.x.clone();
        x[2 * k..2 * k + 2].copy_from_slice(&to);
        let score = self.evaluator.score(&self.freedom.positions(&x))?;
        if score <= limit {
            (self.x, self.score) = (x, score);
        }
        Ok(score <= limit)
    }

    fn place(&self, k: usize) -> [f64; 2] {
        [self.x[2 * k], self.x[2 * k + 1]]
    }

    fn variables(&self) -> Vec<f64> {
        self.x.clone()
    }
}

/// Peak side lobes alone: a move changes one phasor.
struct Lobes<'a> {
    problem: &'a Problem,
    moving: MovingLobes,
    worst: f64,
    score: f64,
}

impl<'a> Lobes<'a> {
    fn new(problem: &'a Problem, x: &[f64]) -> Self {
        let (freedom, setting) = (&problem.freedom, &problem.setting);
        let xy = freedom.positions(x);
        let grid = LobeGrid::new(setting.ring.inner, setting.ring.outer, GRID_STEP);
        let moving = MovingLobes::new(&setting.views, &grid, &xy);
        let (worst, score) = (problem.limits.worst(&xy), moving.highest());
        Self { problem, moving, worst, score }
    }
}

impl Movable for Lobes<'_> {
    fn score(&self) -> f64 {
        self.score
    }

    fn attempt(&mut self, k: usize, to: [f64; 2], limit: f64) -> Result<bool> {
        let Some(score) = self.moving.try_move(k, to, limit) else { return Ok(false) };
        let mut xy = self.moving.xy().to_vec();
        xy[k] = to;
        // A layout never gets further from its limits.
        let worst = self.problem.limits.worst(&xy);
        if worst > self.worst {
            return Ok(false);
        }
        self.moving.accept();
        (self.worst, self.score) = (worst, score);
        Ok(true)
    }

    fn place(&self, k: usize) -> [f64; 2] {
        // Without symmetry the free elements come first, in their order.
        self.moving.xy()[k]
    }

    fn variables(&self) -> Vec<f64> {
        self.problem.freedom.variables_of(self.moving.xy())
    }
}
