//! The form of a method.

use crate::Result;
use crate::design::problem::{Evaluator, Problem};
use crate::progress::Observer;
use rand_chacha::ChaCha8Rng;

/// Where an attempt begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beginning {
    /// At a new layout.
    Fresh,
    /// At a good layout of which some elements were moved.
    Hop,
}

/// What a method gets.
pub struct Work<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// The objectives of this thread.
    pub evaluator: &'a mut Evaluator,
    /// The start, as variables of [`super::super::Freedom`].
    pub start: Vec<f64>,
    /// What the start is.
    pub beginning: Beginning,
    /// Random numbers of this attempt.
    pub random: ChaCha8Rng,
    /// Tells when to stop.
    pub observer: &'a dyn Observer,
}

/// A method.
pub struct MethodKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// True if it needs gradients.
    pub gradient: bool,
    /// Returns the variables of the layout that it found.
    pub run: fn(Work<'_>) -> Result<Vec<f64>>,
}
