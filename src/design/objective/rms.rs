//! The rms side lobe: the root mean square of the mean beam in the ring of directions.

use super::kind::{Objective, Setting};
use super::residual::{GRID_STEP, Residual};
use crate::Result;
use crate::design::lobes::LobeGrid;

struct RmsSideLobe(Residual);

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    let grid = LobeGrid::new(setting.ring.inner, setting.ring.outer, GRID_STEP);
    Ok(Box::new(RmsSideLobe(Residual::new(&setting.views, &grid, |_| 0.0))))
}

impl Objective for RmsSideLobe {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        Ok(self.0.rms(xy))
    }

    fn smooth(&mut self, xy: &[[f64; 2]], _doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        Some(self.0.gradient(xy, weight, gradient))
    }
}
