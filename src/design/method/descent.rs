//! Descent along gradients: L-BFGS on the smooth objective, sharper from stage to stage. Peak side lobes are then lowered together to their minimax.

use super::kind::{Beginning, Work};
use crate::Result;
use crate::design::peaks::PeakFinder;
use crate::design::polish::{PolishControl, polish};
use crate::design::repair::repair;
use crate::lbfgs::{Limits, minimise};

/// The stages: p = 2^doublings of the norm of the side lobes.
const FRESH: &[u32] = &[3, 4, 5, 6];
const HOP: &[u32] = &[5, 6];
/// Without the finish for peaks alone, the norm must come close to the peak by itself.
const LAST: &[u32] = &[8, 10];
/// Iterations of each stage.
const ITERATIONS: usize = 75;
/// Relative decrease in one iteration at which a stage ends.
const DECREASE: f64 = 1e-5;
/// Weight of the squares of violations. At a violation of a thousandth of the aperture it balances the usual slopes of side lobes.
const PENALTY: f64 = 100.0;
/// Distance of the directions from which the tops of side lobes are searched.
const PEAK_STEP: f64 = 0.15;

pub(super) fn run(work: Work<'_>) -> Result<Vec<f64>> {
    let Work { problem, evaluator, start, beginning, .. } = work;
    let freedom = &problem.freedom;
    let (mut x, mut by_position) = (start, vec![[0.0; 2]; freedom.elements()]);
    let stages = if beginning == Beginning::Fresh { FRESH } else { HOP };
    let peak = problem.only_peak();
    for doublings in stages.iter().chain(if peak { &[] } else { LAST }) {
        let mut f = |x: &[f64], gradient: &mut [f64]| {
            by_position.fill([0.0; 2]);
            let value = evaluator.smooth(&freedom.positions(x), *doublings, PENALTY, &mut by_position);
            freedom.pull_back(&by_position, gradient);
            value.unwrap_or(f64::NAN)
        };
        x = minimise(x, Limits { iterations: ITERATIONS, decrease: DECREASE }, &mut f).x;
        problem.limits.put_inside(freedom, &mut x);
    }
    if !peak {
        return Ok(repair(freedom, &problem.limits, x));
    }
    let setting = &problem.setting;
    let mut finder = PeakFinder::new(&setting.views, setting.ring, PEAK_STEP);
    let (x, _) = polish(freedom, &problem.limits, &mut finder, &setting.views, x, PolishControl::default());
    Ok(repair(freedom, &problem.limits, x))
}
