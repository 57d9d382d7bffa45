//! A layout whose elements are moved one by one, by searches that do not use gradients.

use super::freedom::Freedom;
use super::lobes::LobeGrid;
use super::moving_lobes::MovingLobes;
use super::problem::{Evaluator, Problem};
use crate::Result;

/// Distance of the directions of side lobes. Tops between them are higher by a few per cent at most.
const GRID_STEP: f64 = 0.25;

/// A layout whose elements can be moved one by one.
pub(super) trait Movable {
    /// Its score. For peak side lobes it is that of a grid of directions.
    fn score(&self) -> f64;
    /// Move free element `k` if the score does not rise above `limit`. Returns whether it was moved.
    fn attempt(&mut self, k: usize, to: [f64; 2], limit: f64) -> Result<bool>;
    /// The place of free element `k`.
    fn place(&self, k: usize) -> [f64; 2];
    /// The variables.
    fn variables(&self) -> Vec<f64>;
}

/// True if a move is looked at by its change alone: for peak side lobes, without symmetry.
pub(super) fn is_quick(problem: &Problem) -> bool {
    problem.only_peak() && problem.freedom.symmetry == 1
}

/// A layout to move.
///
/// # Errors
/// The chain behind a figure fails.
pub(super) fn movable<'a>(problem: &'a Problem, evaluator: &'a mut Evaluator, x: Vec<f64>) -> Result<Box<dyn Movable + 'a>> {
    if is_quick(problem) {
        return Ok(Box::new(Lobes::new(problem, &x)));
    }
    let score = evaluator.score(&problem.freedom.positions(&x))?;
    Ok(Box::new(Whole { freedom: &problem.freedom, evaluator, x, score }))
}

/// Any objectives: the figures are computed anew for each move.
struct Whole<'a> {
    freedom: &'a Freedom,
    evaluator: &'a mut Evaluator,
    x: Vec<f64>,
    score: f64,
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
