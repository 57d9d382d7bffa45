//! The stages of `selfcal` where image and gains are solved together: evaluations of the fit, whose time is measured on some rows.

use super::held::{COVERAGE, DOUBLE, Held, SINGLE};
use super::image::{InputFormat, fits};
use super::sampled::{RAW, STORED, STORED_ROW};
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// Evaluations of all parts of a joint solution with held-out baselines and without: the geometric means of eleven runs of eight arrays with scenes of discs, points and an
/// airport, phases of 5 to 720 degrees, 128 to 256 pixels a side, with noise and without, in which they were 380 to 890 and 240 to 520.
const JUDGED: f64 = 530.0;
const UNJUDGED: f64 = 365.0;
const MOST_OVER_TYPICAL: f64 = 1.7;
const LEAST_OVER_TYPICAL: f64 = 0.67;
/// How often the solution is begun: for the data as they are, for most baselines, and for all of them.
const BEGUN: f64 = 3.0;
/// Images that are written: beam, dirty image, model, residual and restored image, and those before and after each of three rounds.
const IMAGES: f64 = 9.0;
/// Images in double precision of the results.
const SHOWN: f64 = 5.0;

/// What a joint solution takes on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointTimes {
    /// Time until the first evaluation, s.
    pub begin_s: f64,
    /// Time of an evaluation, s.
    pub evaluation_s: f64,
    /// Bytes that are held at most.
    pub held_bytes: f64,
}

impl JointTimes {
    /// The same for so many times the rows.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self { begin_s: by * self.begin_s, evaluation_s: by * self.evaluation_s, held_bytes: by * self.held_bytes }
    }

    /// The line through these times and those of more rows, at so many times their distance.
    #[must_use]
    pub fn grown(&self, more: &Self, by: f64) -> Self {
        // No set takes less than a part of it.
        let at = |a: f64, b: f64| a + by * (b - a).max(0.0);
        Self {
            begin_s: at(self.begin_s, more.begin_s),
            evaluation_s: at(self.evaluation_s, more.evaluation_s),
            held_bytes: at(self.held_bytes, more.held_bytes),
        }
    }
}

/// The forecast of a joint solution. `held_out` is true where baselines are held out, and `judged` predicts the visibilities by which the image is judged.
#[must_use]
pub fn joint(
    outlook: &Outlook,
    (format, threads): (InputFormat, usize),
    times: &JointTimes,
    (held_out, judged): (bool, Option<&Field>),
) -> Forecast {
    let held = Held { outlook, threads };
    let values = outlook.visibilities() * outlook.shape.2 as f64;
    let set = values * RAW + held.rows() * COVERAGE;
    let (evaluations, begun) = if held_out { (JUDGED, BEGUN) } else { (UNJUDGED, 1.0) };
    let read = Stage { read_bytes: held.file(), ..Stage::new("read", set) };
    let summed_bytes = evaluations * held.plane(SINGLE);
    let solve = Stage { summed_bytes, ..Stage::new("image and gains", set + times.held_bytes) };
    let mut stages = vec![
        held.start(),
        read.doing([(format.term(), values), (Term::ReadRow, held.rows())]),
        Stage { timed_s: begun * times.begin_s + evaluations * times.evaluation_s, whole: true, ..solve },
        Stage::new("calibrated set", 2.0 * set).doing([(Term::Apply, values), (Term::WriteGains, values), (Term::GainRow, held.rows())]),
        held.write(IMAGES, set + held.plane(SHOWN * DOUBLE)),
    ];
    stages.extend(judged.map(|field| held.verdict((field, true), set + held.plane(SHOWN * DOUBLE))));
    let assumptions = vec![
        "the time of an evaluation of image and gains is that of a few of them on some rows, on this machine".into(),
        format!(
            "{evaluations} evaluations, as eleven unlike runs took on average: the data ask for {:.0} to {:.0}",
            LEAST_OVER_TYPICAL * evaluations,
            MOST_OVER_TYPICAL * evaluations
        ),
    ];
    let output_bytes = fits(outlook, IMAGES) + values * STORED + held.rows() * STORED_ROW;
    Forecast { stages, output_bytes, assumptions, groups_of_planes: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_grow_along_a_line_and_never_fall() {
        let few = JointTimes { begin_s: 1.0, evaluation_s: 0.1, held_bytes: 5e6 };
        let more = JointTimes { begin_s: 0.5, evaluation_s: 0.3, held_bytes: 6e6 };
        let all = few.grown(&more, 10.0);
        assert!((all.begin_s - 1.0).abs() < 1e-12 && (all.evaluation_s - 2.1).abs() < 1e-12 && all.held_bytes == 15e6, "{all:?}");
        assert_eq!(few.scaled(3.0).held_bytes, 15e6);
    }
}
