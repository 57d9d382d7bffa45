//! The part of the u-v plane that stations on given sites leave empty over a track, see [`crate::design::SiteTracks`].

use super::kind::{LayoutFigure, Objective, Setting};
use crate::Result;
use crate::values::bad_value;

struct Coverage(LayoutFigure);

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    match &setting.coverage {
        Some(figure) => Ok(Box::new(Coverage(figure.clone()))),
        None => bad_value("objective", "coverage", "one for elements that move, such as fill: coverage is for a choice among sites"),
    }
}

impl Objective for Coverage {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        (self.0.0)(xy)
    }
}
