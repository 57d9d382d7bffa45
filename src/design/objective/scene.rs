//! The error of the reconstructed image of a scene, through the whole chain: simulation, noise, deconvolution, comparison. The chain is given from
//! outside, so that this folder needs nothing of it.

use super::kind::{Objective, Setting};
use crate::Result;
use crate::values::bad_value;

struct Scene(super::kind::LayoutFigure);

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    match &setting.scene {
        Some(scene) => Ok(Box::new(Scene(scene.clone()))),
        None => bad_value("scene", "missing", "a scene, whose image the objective scene judges"),
    }
}

impl Objective for Scene {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        (self.0.0)(xy)
    }
}
