//! A problem of layout design: what may change, what must hold, and what is to be small.

use super::freedom::Freedom;
use super::limits::Limits;
use super::objective::{OBJECTIVES, Objective, ObjectiveKind, Setting};
use crate::Result;

/// What a search needs to know. The unit of length is the aperture.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The elements that may move.
    pub freedom: Freedom,
    /// The conditions.
    pub limits: Limits,
    /// Free elements stand at multiples of this.
    pub grid: Option<f64>,
    /// The observation.
    pub setting: Setting,
    /// Rows of [`OBJECTIVES`] with their weights.
    pub terms: Vec<(usize, f64)>,
}

/// How much a violation of a limit counts in the score of a layout, against the figures of the objectives.
const VIOLATION: f64 = 10.0;
/// Violations up to this are rounding, in apertures.
const ROUNDING: f64 = 1e-9;

impl Problem {
    /// The kinds of objective with their weights.
    pub fn kinds(&self) -> impl Iterator<Item = (&'static ObjectiveKind, f64)> + '_ {
        self.terms.iter().map(|(k, w)| (&OBJECTIVES[*k], *w))
    }

    /// True if all objectives have gradients.
    #[must_use]
    pub fn has_gradient(&self) -> bool {
        self.kinds().all(|(k, _)| k.gradient)
    }

    /// True if the peak side lobe is the only objective.
    #[must_use]
    pub fn only_peak(&self) -> bool {
        self.terms.len() == 1 && self.kinds().all(|(k, _)| k.name == "psl")
    }

    /// True if an objective makes an image of a scene for each layout, which takes tenths of a second.
    #[must_use]
    pub fn makes_images(&self) -> bool {
        self.kinds().any(|(k, _)| k.name == "scene")
    }

    /// The objectives of one thread.
    ///
    /// # Errors
    /// An objective cannot be made.
    pub fn evaluator(&self) -> Result<Evaluator> {
        let terms = self.kinds().map(|(k, weight)| Ok((k.name, weight, (k.make)(&self.setting)?))).collect::<Result<_>>()?;
        Ok(Evaluator { terms, strict: self.limits.stricter(), limits: self.limits.clone() })
    }
}

/// The objectives of one thread.
pub struct Evaluator {
    terms: Vec<(&'static str, f64, Box<dyn Objective>)>,
    limits: Limits,
    strict: Limits,
}

impl Evaluator {
    /// The figures of a layout with their names.
    ///
    /// # Errors
    /// The chain behind a figure fails.
    pub fn figures(&mut self, xy: &[[f64; 2]]) -> Result<Vec<(&'static str, f64)>> {
        self.terms.iter_mut().map(|(name, _, o)| Ok((*name, o.value(xy)?))).collect()
    }

    /// The score of a layout: the weighted sum of its figures, and what it violates.
    ///
    /// # Errors
    /// The chain behind a figure fails.
    pub fn score(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        let violated = (self.limits.worst(xy) - ROUNDING).max(0.0);
        let figures = self.terms.iter_mut().map(|(_, weight, o)| Ok(*weight * o.value(xy)?)).sum::<Result<f64>>()?;
        Ok(figures + VIOLATION * violated)
    }

    /// The weighted sum of the smooth forms of the objectives plus a penalty on violations, with its gradient. `None` where one has none.
    pub(super) fn smooth(&mut self, xy: &[[f64; 2]], doublings: u32, penalty: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        let mut sum = self.strict.penalty(xy, penalty, gradient);
        for (_, weight, objective) in &mut self.terms {
            sum += *weight * objective.smooth(xy, doublings, *weight, gradient)?;
        }
        Some(sum)
    }
}
