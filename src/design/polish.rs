//! The finish: lower all high side lobes together until no move of the elements lowers the highest.
//!
//! The p-norm of a grid of directions stops some per cent above the lowest peak, because it also lowers what is not high, and because tops lie
//! between the points of the grid. The finish knows the tops themselves. Each step solves for the move that lowers the highest of them most, as
//! their slopes promise it, and tries it; the damping of the steps follows from how much of the promise comes true.

use super::array_factor::power_gradient;
use super::freedom::Freedom;
use super::limits::Limits;
use super::minimax::{Functions, step};
use super::peaks::{Lobe, PeakFinder};
use super::views::View;

/// How far to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolishControl {
    /// Steps at most.
    pub steps: usize,
    /// Side lobes of at least this share of the highest are watched. A lower share is slower, a higher one meets lobes that it did not see.
    pub share: f64,
    /// Stop after a step that lowers the peak by less than this, relative.
    pub decrease: f64,
}

impl Default for PolishControl {
    fn default() -> Self {
        Self { steps: 40, share: 0.8, decrease: 1e-4 }
    }
}

/// Lower the highest side lobe from a start. The limits are treated like side lobes that may not exceed their height at the start.
///
/// Returns the variables and the highest side lobe.
pub fn polish(
    freedom: &Freedom,
    limits: &Limits,
    finder: &mut PeakFinder,
    views: &[View],
    start: Vec<f64>,
    control: PolishControl,
) -> (Vec<f64>, f64) {
    let mut x = start;
    limits.put_inside(freedom, &mut x);
    let mut at = State::new(freedom, limits, finder, &x, control.share);
    let mut damping = at.peak;
    let mut little = 0;
    for _ in 0..control.steps {
        let functions = functions(freedom, limits, views, &x, &at);
        let now = at.merit();
        let mut accepted = false;
        for _ in 0..8 {
            let Some((move_by, promised)) = step(&functions, freedom.variables(), damping) else { break };
            let gain = now - promised;
            if !(gain > 1e-9 * now) {
                break;
            }
            let mut tried: Vec<f64> = x.iter().zip(&move_by).map(|(x, d)| x + d).collect();
            limits.put_inside(freedom, &mut tried);
            let after = State::new(freedom, limits, finder, &tried, control.share);
            let share = (now - after.merit()) / gain;
            if share > 0.05 {
                little = if now - after.merit() < control.decrease * now { little + 1 } else { 0 };
                (x, at, accepted) = (tried, after, true);
                damping *= if share > 0.7 {
                    0.3
                } else if share < 0.3 {
                    2.0
                } else {
                    1.0
                };
                break;
            }
            damping *= 4.0;
        }
        if !accepted || little >= 3 {
            break;
        }
    }
    (x, at.peak)
}

/// A layout with its side lobes.
struct State {
    lobes: Vec<Lobe>,
    peak: f64,
    worst: f64,
}

impl State {
    fn new(freedom: &Freedom, limits: &Limits, finder: &mut PeakFinder, x: &[f64], share: f64) -> Self {
        let xy = freedom.positions(x);
        let lobes = finder.find(&xy, share);
        let peak = lobes.first().map_or(0.0, |l| l.value);
        Self { lobes, peak, worst: limits.worst(&xy) }
    }

    /// The height of the highest side lobe, with what violates a limit on top of it.
    fn merit(&self) -> f64 {
        self.peak + self.worst
    }
}

/// The side lobes and the limits as functions of the variables.
fn functions(freedom: &Freedom, limits: &Limits, views: &[View], x: &[f64], at: &State) -> Functions {
    let xy = freedom.positions(x);
    let n = xy.len() as f64;
    let scale = 1.0 / (n * (n - 1.0));
    let (mut by_view, mut total) = (vec![[0.0; 2]; xy.len()], vec![[0.0; 2]; xy.len()]);
    let mut out = Functions::default();
    let mut slope = vec![0.0; freedom.variables()];
    for lobe in &at.lobes {
        total.fill([0.0; 2]);
        for view in views {
            power_gradient(&xy, view.direction(lobe.direction), &mut by_view);
            let w = scale * view.weight;
            total.iter_mut().zip(&by_view).for_each(|(t, g)| *t = [t[0] + w * g[0], t[1] + w * g[1]]);
        }
        freedom.pull_back(&total, &mut slope);
        out.push(lobe.value, slope.clone());
    }
    for v in limits.near(&xy, 0.3 * at.peak) {
        total.fill([0.0; 2]);
        for (k, d) in v.by_element {
            total[k] = [total[k][0] + d[0], total[k][1] + d[1]];
        }
        freedom.pull_back(&total, &mut slope);
        out.push(at.peak + v.amount, slope.clone());
    }
    out
}
