//! The stages of `selfcal --solve`: after the rounds, images of all Stokes parameters and solutions of what lies between the feeds, in turn.

use super::cleaned::{CleanWork, clean};
use super::held::Held;
use super::image::InputFormat;
use super::speeds::Speeds;
use super::stage::Stage;
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// Passes of imaging, solving leakages, and solving the gains that they had spoilt.
const PASSES: f64 = 4.0;
/// Stokes parameters.
const STOKES: f64 = 4.0;
/// Steps until leakages settle: two sets took 6 to 8 in each of the passes.
const STEPS: f64 = 6.5;

/// What is solved between the feeds, and what a step takes on this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BetweenWork {
    /// True where the model is made of clean images of the data.
    pub imaged: bool,
    /// The transform that predicts visibilities of a plane of the model.
    pub predictor: Field,
    /// Time of a step for one sample of the products of two feeds, s.
    pub sample_s: f64,
    /// Bytes of the set and of all images that stay in memory.
    pub always: f64,
}

/// The stages, for a set whose images take so much.
#[must_use]
pub fn between(
    outlook: &Outlook,
    (format, threads): (InputFormat, usize),
    (work, one): (&BetweenWork, &CleanWork),
    speeds: &Speeds,
) -> Vec<Stage> {
    let held = Held { outlook, threads };
    let values = outlook.visibilities() * outlook.shape.2 as f64;
    let mut stages = Vec::new();
    if work.imaged {
        let one = CleanWork { tested: false, judged: None, twice: false, ..*one };
        let all = clean(outlook, (format, threads), &one, speeds).stages;
        let mut images = Stage::second(&all, ["start", "write"]);
        images.work.iter_mut().for_each(|(_, n)| *n *= STOKES * PASSES);
        images.bytes += work.always;
        stages.push(Stage { name: "images of I, Q, U and V", ..images });
    }
    let planes = if work.imaged { STOKES } else { 1.0 };
    let predicted = held.predicted(&work.predictor, planes * (PASSES * STEPS + PASSES - 1.0));
    let solved = Stage::new("leakages", work.always + held.pass(&work.predictor) + planes * work.predictor.size.plane_bytes as f64);
    let timed_s = PASSES * STEPS * outlook.visibilities() * work.sample_s;
    stages.push(
        Stage { timed_s, ..solved }
            .doing(predicted)
            .doing([(Term::Apply, PASSES * (STEPS + 1.0) * values), (Term::Sum, (PASSES - 1.0) * values)]),
    );
    stages
}

/// What the forecast takes for granted.
#[must_use]
pub fn settled() -> String {
    format!("leakages settle in {STEPS} steps, each of {PASSES} times: sets whose leakages settle at all take 6 to 8")
}
