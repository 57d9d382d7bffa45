//! The share of the baselines that repeat another: 1 - unique / all.

use super::kind::{Objective, Setting};
use crate::Result;
use crate::design::baselines::unique_baselines;

struct Redundancy {
    tolerance: f64,
}

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    Ok(Box::new(Redundancy { tolerance: setting.tolerance }))
}

impl Objective for Redundancy {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        let pairs = xy.len() * (xy.len() - 1) / 2;
        Ok(1.0 - unique_baselines(xy, self.tolerance) as f64 / pairs as f64)
    }
}
