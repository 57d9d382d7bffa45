//! What a rehearsal has shown of a command: its course, and how long its stages took.
//!
//! How many major cycles CLEAN makes, and how many evaluations maximum entropy, is only known from the data. So a command is begun, and stopped after a while.

use super::speeds::Speeds;
use super::stage::Forecast;

/// Stages that were tried together, and the seconds that all of them took.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Their names.
    pub stages: Vec<&'static str>,
    /// Their time, s.
    pub seconds: f64,
}

/// How far a rehearsal came. The numbers are those of an output channel, on average.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Major cycles, or evaluations of the data.
    pub turns: f64,
    /// Components, or convolutions with the beam.
    pub steps: f64,
    /// True where it came to its end.
    pub ended: bool,
    /// Whether a source was sought outside the image; none where the rehearsal did not come so far.
    pub searched: Option<bool>,
}

/// Whether a source outside the image may be sought: where it is not known, memory is needed for it.
pub(super) fn searches(course: Option<Course>) -> bool {
    course.and_then(|course| course.searched).unwrap_or(true)
}

impl Forecast {
    /// Time of the stages with these names, s.
    #[must_use]
    pub fn seconds_of(&self, names: &[&'static str], speeds: &Speeds, threads: usize) -> f64 {
        self.stages.iter().filter(|s| names.contains(&s.name)).map(|s| s.seconds(speeds, threads)).sum()
    }

    /// The same forecast at this pace. A second image goes as all that was tried, and what is of another kind, such as writing, as before.
    #[must_use]
    pub fn at_pace(mut self, pace: &Pace) -> Self {
        for stage in &mut self.stages {
            let own = pace.of_stages.iter().find(|(names, _)| names.contains(&stage.name)).map(|(_, ratio)| *ratio);
            let like_all = if stage.name == "second image" { pace.of_all } else { stage.pace };
            stage.pace = own.unwrap_or(like_all);
        }
        self
    }
}

/// How much longer the stages of a command take on this machine than their forecast says. It is the same for any share of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    /// Stages that were tried together, and the ratio.
    of_stages: Vec<(Vec<&'static str>, f64)>,
    /// The ratio of all that was tried, at which a second image goes.
    of_all: f64,
}

impl Pace {
    /// The pace of what was tried, where `part` is its forecast.
    #[must_use]
    pub fn new(tried: &[Tried], (part, speeds, threads): (&Forecast, &Speeds, usize)) -> Self {
        let said = |t: &Tried| part.seconds_of(&t.stages, speeds, threads);
        let ratio = |seconds: f64, said: f64| if said > 0.0 { seconds / said } else { 1.0 };
        let known = tried.iter().filter(|t| said(t) > 0.0);
        let of_stages = known.map(|t| (t.stages.clone(), ratio(t.seconds, said(t)))).collect();
        let of_all = ratio(tried.iter().map(|t| t.seconds).sum(), tried.iter().map(said).sum());
        Self { of_stages, of_all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Stage;

    fn timed(name: &'static str, timed_s: f64) -> Stage {
        Stage { timed_s, ..Stage::new(name, 1e6) }
    }

    #[test]
    fn stages_go_at_the_pace_of_the_rehearsal() {
        let speeds = Speeds::built_in().unwrap();
        let of = |cycles: f64| Forecast {
            stages: vec![
                timed("start", 0.1),
                timed("read", 1.0),
                timed("cycles", cycles),
                timed("write", 2.0),
                timed("second image", 10.0),
            ],
            ..Forecast::default()
        };
        let tried = [Tried { stages: vec!["read"], seconds: 2.0 }, Tried { stages: vec!["cycles"], seconds: 2.0 }];
        let pace = Pace::new(&tried, (&of(4.0), &speeds, 1));
        let made = of(20.0).at_pace(&pace);
        let seconds: Vec<f64> = made.stages.iter().map(|s| s.seconds(&speeds, 1)).collect();
        // What was tried took 4 s for 5.
        assert_eq!(seconds, [0.1, 2.0, 10.0, 2.0, 8.0]);
        assert_eq!(of(20.0).at_pace(&Pace::new(&[], (&of(4.0), &speeds, 1))), of(20.0));
    }
}
