//! Robustness: the highest peak side lobe that is left when any one element is lost.

use super::kind::{Objective, Setting};
use crate::Result;
use crate::design::lobe_norm::LobeNorm;
use crate::design::lobes::LobeGrid;
use crate::design::peaks::PeakFinder;

/// Distances of directions, as for the peak side lobe of the whole array.
const GRID_STEP: f64 = 0.4;
const PEAK_STEP: f64 = 0.2;

struct Robust {
    norm: LobeNorm,
    finder: PeakFinder,
}

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    let grid = LobeGrid::new(setting.ring.inner, setting.ring.outer, GRID_STEP);
    Ok(Box::new(Robust { norm: LobeNorm::new(&setting.views, &grid), finder: PeakFinder::new(&setting.views, setting.ring, PEAK_STEP) }))
}

fn without(xy: &[[f64; 2]], lost: usize) -> Vec<[f64; 2]> {
    xy.iter().enumerate().filter(|(k, _)| *k != lost).map(|(_, p)| *p).collect()
}

impl Objective for Robust {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        if xy.len() < 3 {
            return Ok(1.0);
        }
        Ok((0..xy.len()).map(|k| self.finder.highest(&without(xy, k))).fold(0.0, f64::max))
    }

    fn smooth(&mut self, xy: &[[f64; 2]], doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        if xy.len() < 3 {
            return Some(1.0);
        }
        // The p-norm over the lost element of the p-norms over directions.
        let p = f64::from(doublings).exp2();
        let mut slopes = vec![vec![[0.0; 2]; xy.len() - 1]; xy.len()];
        let values: Vec<f64> = slopes.iter_mut().enumerate().map(|(k, s)| self.norm.value(&without(xy, k), doublings, s)).collect();
        let largest = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let sum: f64 = values.iter().map(|v| (v / largest).powf(p)).sum();
        for (k, (value, slope)) in values.iter().zip(&slopes).enumerate() {
            let factor = weight * (value / largest).powf(p - 1.0) * sum.powf(1.0 / p - 1.0);
            let others = gradient.iter_mut().enumerate().filter(|(i, _)| *i != k);
            others.zip(slope).for_each(|((_, g), s)| *g = [g[0] + factor * s[0], g[1] + factor * s[1]]);
        }
        Some(largest * sum.powf(1.0 / p))
    }
}
