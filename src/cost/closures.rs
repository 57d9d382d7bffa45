//! The stages of `mem` from closure quantities: evaluations whose time is measured with the data themselves.

use super::held::{DOUBLE, SINGLE};
use super::sampled::STORED;
use super::stage::{Forecast, Stage};
use super::term::Term;

/// Evaluations of an iteration, in the runs that make the image and in the short ones that try a flux. In seven runs of two arrays with 48 to 128 pixels a side they were 1.09 to
/// 1.20, and 1.08 to 1.33.
const OF_ITERATION: f64 = 1.15;
const OF_TRIAL: f64 = 1.25;
/// Images that are written: model, residual and restored image, and the spread of several starts.
const IMAGES: f64 = 3.0;
/// Images that a further start holds while it runs beside others.
const OF_START: f64 = 30.0;

/// An image from closure quantities, as it was begun on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ClosureWork {
    /// Time to gather the data, s.
    pub gather_s: f64,
    /// Time of a run beside its evaluations, s.
    pub begin_s: f64,
    /// Time of an evaluation, s.
    pub evaluation_s: f64,
    /// Starts.
    pub starts: f64,
    /// Iterations of each.
    pub iterations: f64,
    /// Iterations of all runs that try a flux.
    pub trial_iterations: f64,
    /// Bytes that are held by a run.
    pub held_bytes: f64,
    /// Pixels of the image.
    pub pixels: f64,
    /// Threads, which run starts side by side.
    pub threads: f64,
}

/// The forecast of an image from closure quantities of a set of so many values.
#[must_use]
pub fn closures(work: &ClosureWork, values: f64) -> Forecast {
    let images = if work.starts > 1.0 { IMAGES + 1.0 } else { IMAGES };
    let beside = (work.threads.min(work.starts) - 1.0).max(0.0) * OF_START * work.pixels * DOUBLE;
    let timed = |name: &'static str, timed_s: f64| Stage { timed_s, ..Stage::new(name, work.held_bytes + beside) };
    let trials = OF_TRIAL * work.trial_iterations * work.evaluation_s;
    let runs = work.starts * (work.begin_s + OF_ITERATION * work.iterations * work.evaluation_s);
    let read = Stage { timed_s: work.gather_s, ..Stage::new("gather", work.held_bytes) };
    let stages = vec![
        Stage::new("start", 0.0).doing([(Term::Command, 1.0)]),
        Stage { read_bytes: values * STORED, ..read },
        timed("flux", trials),
        timed("images", runs),
        Stage::new("write", work.held_bytes).doing([(Term::WritePixel, images * work.pixels)]),
    ];
    let text = format!(
        "all iterations are made, each in {OF_ITERATION} evaluations ({OF_TRIAL} where a flux is tried), as runs of this kind take; an evaluation takes the time of a few of them, on this machine"
    );
    Forecast { stages, output_bytes: images * (work.pixels * SINGLE + 11_520.0), assumptions: vec![text], ..Forecast::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fluxes_are_tried_before_images_are_made() {
        let work = ClosureWork {
            evaluation_s: 0.01,
            starts: 2.0,
            iterations: 100.0,
            trial_iterations: 40.0,
            begin_s: 0.5,
            ..ClosureWork::default()
        };
        let forecast = closures(&work, 1e3);
        let seconds = |name: &str| forecast.stages.iter().find(|s| s.name == name).map_or(0.0, |s| s.timed_s);
        assert!((seconds("flux") - 0.5).abs() < 1e-9 && (seconds("images") - 3.3).abs() < 1e-9, "{forecast:?}");
    }
}
