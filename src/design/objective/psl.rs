//! The peak side lobe: the highest value of the mean beam in the ring of directions. Its smooth form is the p-norm of the power pattern.

use super::kind::{Objective, Setting};
use crate::Result;
use crate::design::lobe_norm::LobeNorm;
use crate::design::lobes::LobeGrid;
use crate::design::peaks::PeakFinder;

/// Distance of the directions of the norm. The beam contains no wave shorter than 1, so it is sampled well.
const GRID_STEP: f64 = 0.4;
/// Distance of the directions from which tops are searched.
const PEAK_STEP: f64 = 0.1;

struct PeakSideLobe {
    norm: LobeNorm,
    finder: PeakFinder,
    by_position: Vec<[f64; 2]>,
}

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    let grid = LobeGrid::new(setting.ring.inner, setting.ring.outer, GRID_STEP);
    let norm = LobeNorm::new(&setting.views, &grid);
    let finder = PeakFinder::new(&setting.views, setting.ring, PEAK_STEP);
    Ok(Box::new(PeakSideLobe { norm, finder, by_position: Vec::new() }))
}

impl Objective for PeakSideLobe {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        Ok(self.finder.highest(xy))
    }

    fn smooth(&mut self, xy: &[[f64; 2]], doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        self.by_position.clear();
        self.by_position.resize(xy.len(), [0.0; 2]);
        let value = self.norm.value(xy, doublings, &mut self.by_position);
        for (g, b) in gradient.iter_mut().zip(&self.by_position) {
            *g = [g[0] + weight * b[0], g[1] + weight * b[1]];
        }
        Some(value)
    }
}
