//! A rehearsal: a command is begun, stopped after a while, and its images are thrown away. It shows how many cycles the data ask for, and how fast this machine
//! makes them.

use crate::cli::failure::Result;
use crate::cost::{Course, Tried};
use crate::progress::{Event, Observer};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// A rehearsal takes at most so many seconds, if the user does not say otherwise.
pub(super) const MOST_S: f64 = 10.0;
/// It is made where the first image takes at most so much of its time.
pub(super) const FIRST: f64 = 0.5;

/// What a rehearsal has shown.
#[derive(Debug, Clone)]
pub(in crate::cli) struct Rehearsed {
    pub(in crate::cli) course: Course,
    /// The times of its stages.
    pub(in crate::cli) tried: Vec<Tried>,
}

/// The stages of a command, as a rehearsal times them.
pub(in crate::cli) struct Acts {
    /// Before the first cycle.
    pub(in crate::cli) before: &'static [&'static str],
    /// The cycles.
    pub(in crate::cli) cycles: &'static [&'static str],
    /// What follows, up to the verdict.
    pub(in crate::cli) after: &'static [&'static str],
}

/// A rehearsal that has come to its end.
pub(in crate::cli) struct Ended {
    /// Seconds of the verdict, and whether it looked for a source outside the image.
    pub(in crate::cli) verdict: (f64, bool),
    /// Cycles and components, or evaluations and convolutions, of all output channels.
    pub(in crate::cli) counts: (f64, f64),
}

/// How far an output channel has come: cycles and components, or evaluations.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Reached {
    number: usize,
    turns: usize,
    steps: usize,
}

#[derive(Debug, Default)]
struct Seen {
    channels: Vec<Reached>,
    /// Seconds until the first cycle that was told of, and its turns.
    first: Option<(f64, usize)>,
    /// Seconds until the last one so far.
    last_s: f64,
}

impl Seen {
    fn note(&mut self, now_s: f64, reached: Reached) {
        self.last_s = now_s;
        self.first.get_or_insert((now_s, reached.turns));
        match self.channels.last_mut() {
            Some(last) if reached.number > last.number => *last = reached,
            _ => self.channels.push(reached),
        }
    }

    /// How far the channels have come, the last of which has not ended.
    fn course(&self) -> Option<Course> {
        let ended = self.channels.len().checked_sub(1)?;
        let of = |n: usize, f: fn(&Reached) -> usize| self.channels[..n].iter().map(|c| f(c) as f64).sum::<f64>() / n as f64;
        let n = ended.max(1);
        Some(Course { turns: of(n, |c| c.turns), steps: of(n, |c| c.steps), ended: ended > 0, searched: None })
    }

    /// Seconds until the cycles of the only channel began. Evaluations are told of when they are made, and the first ones took as long as the later ones. `None` where
    /// only those are known.
    fn begun_s(&self) -> Option<f64> {
        let ((first_s, first), last) = (self.first?, self.channels.last()?.turns);
        let later = last.saturating_sub(first) as f64;
        match first {
            0 => Some(first_s),
            _ => (later > 0.0).then(|| (first_s - first as f64 * (self.last_s - first_s) / later).max(0.0)),
        }
    }

    /// What a rehearsal has shown that was stopped.
    fn shown(&self, acts: &Acts) -> Option<Rehearsed> {
        let course = self.course()?;
        let several = self.channels.len() > 1;
        let tried = if several { Vec::new() } else { timed(acts, acts.cycles.to_vec(), (self.begun_s(), self.last_s)) };
        Some(Rehearsed { course, tried })
    }
}

/// Watches a rehearsal, and stops it.
pub(in crate::cli) struct Watch<'c> {
    of_user: &'c dyn Observer,
    started: Instant,
    most_s: f64,
    seen: Mutex<Seen>,
}

impl<'c> Watch<'c> {
    fn new(of_user: &'c dyn Observer, most_s: f64) -> Self {
        Self { of_user, started: Instant::now(), most_s, seen: Mutex::default() }
    }

    fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    fn is_over(&self) -> bool {
        self.seconds() > self.most_s
    }
}

impl Observer for Watch<'_> {
    fn event(&self, event: Event<'_>) {
        let reached = match event {
            // A cycle is told of when it begins.
            Event::Cycle { number, iterations, .. } => Reached { number, turns: number - 1, steps: iterations },
            Event::Entropy { number, evaluations, .. } => Reached { number, turns: evaluations, steps: 0 },
            _ => return,
        };
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).note(self.seconds(), reached);
    }

    fn cancelled(&self) -> bool {
        self.of_user.cancelled() || self.is_over()
    }
}

/// Rehearse a command for at most so many seconds: `perform` does the work. Events are not passed on to `of_user`, which may only stop it.
///
/// # Errors
/// The command would fail.
pub(super) fn rehearse(
    (of_user, most_s): (&dyn Observer, f64),
    acts: &Acts,
    perform: impl FnOnce(&Watch<'_>) -> Result<Ended>,
) -> Result<Option<Rehearsed>> {
    let watch = Watch::new(of_user, most_s);
    let ended = perform(&watch);
    let (all_s, over) = (watch.seconds(), watch.is_over());
    let seen = watch.seen.into_inner().unwrap_or_else(PoisonError::into_inner);
    match ended {
        Ok(ended) => Ok(seen.first.is_some().then(|| ended.shown(acts, (seen.begun_s(), all_s), seen.channels.len()))),
        Err(_) if over => Ok(seen.shown(acts)),
        Err(error) => Err(error),
    }
}

/// Times until the cycles began, and of the stages that came after. All stages together where it is not known when they began.
fn timed(acts: &Acts, cycles: Vec<&'static str>, (begun_s, last_s): (Option<f64>, f64)) -> Vec<Tried> {
    let Some(begun_s) = begun_s else { return vec![Tried { stages: [acts.before.to_vec(), cycles].concat(), seconds: last_s }] };
    let mut all = vec![Tried { stages: acts.before.to_vec(), seconds: begun_s }];
    if last_s > begun_s {
        all.push(Tried { stages: cycles, seconds: last_s - begun_s });
    }
    all
}

impl Ended {
    /// What a whole rehearsal has shown of so many channels.
    fn shown(&self, acts: &Acts, (begun_s, all_s): (Option<f64>, f64), channels: usize) -> Rehearsed {
        let n = channels.max(1) as f64;
        let (verdict_s, searched) = self.verdict;
        let made_s = all_s - verdict_s;
        let mut tried = timed(acts, [acts.cycles, acts.after].concat(), (begun_s, made_s));
        if channels > 1 {
            // The images of the later channels are made between the cycles.
            tried = vec![Tried { stages: [acts.before, acts.cycles, acts.after].concat(), seconds: made_s }];
        }
        tried.push(Tried { stages: vec!["verdict"], seconds: verdict_s });
        let course = Course { turns: self.counts.0 / n, steps: self.counts.1 / n, ended: true, searched: Some(searched) };
        Rehearsed { course, tried }
    }
}

/// Do some work for at most so many seconds, and throw it away: its time, s, and what it returns. `None` where it takes longer.
///
/// # Errors
/// The work would fail.
pub(super) fn try_out<T>(
    (of_user, most_s): (&dyn Observer, f64),
    perform: impl FnOnce(&Watch<'_>) -> Result<T>,
) -> Result<Option<(f64, T)>> {
    let watch = Watch::new(of_user, most_s);
    match perform(&watch) {
        Ok(done) => Ok(Some((watch.seconds(), done))),
        Err(_) if watch.is_over() && !of_user.cancelled() => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    fn cycle(channel: usize, number: usize, iterations: usize) -> Event<'static> {
        Event::Cycle { channel: Some(channel), number, iterations, peak: 1.0, flux: 1.0, rms: 0.1 }
    }

    #[test]
    fn a_course_is_that_of_the_channels_that_have_ended() {
        let watch = Watch::new(&Silent, 1e9);
        assert!(watch.seen.lock().unwrap().course().is_none() && !watch.cancelled());
        [(1, 0), (2, 40), (3, 900)].iter().for_each(|(number, n)| watch.event(cycle(0, *number, *n)));
        let first = watch.seen.lock().unwrap().course().unwrap();
        assert_eq!((first.turns, first.steps, first.ended), (2.0, 900.0, false));
        [(1, 0), (2, 30)].iter().for_each(|(number, n)| watch.event(cycle(1, *number, *n)));
        let both = watch.seen.lock().unwrap().course().unwrap();
        assert_eq!((both.turns, both.steps, both.ended), (2.0, 900.0, true));
        assert!(Watch::new(&Silent, 0.0).cancelled());
    }

    #[test]
    fn evaluations_take_the_same_time_before_and_after_the_first_is_told_of() {
        let acts = Acts { before: &["read"], cycles: &["passes"], after: &[] };
        let seconds = |told: &[(f64, usize)]| {
            let mut seen = Seen::default();
            let steps = told.iter().enumerate();
            steps.for_each(|(k, (now_s, turns))| seen.note(*now_s, Reached { number: k + 1, turns: *turns, steps: 0 }));
            seen.shown(&acts).unwrap().tried.iter().map(|t| t.seconds).collect::<Vec<_>>()
        };
        // 4 s until the beginning, and 1 s for each evaluation.
        assert_eq!(seconds(&[(6.0, 2), (7.0, 3), (9.0, 5)]), [4.0, 5.0]);
        assert_eq!(seconds(&[(6.0, 2)]), [6.0]);
        assert_eq!(seconds(&[(6.0, 0), (9.0, 1)]), [6.0, 3.0]);
    }

    #[test]
    fn work_is_tried_for_a_while() {
        let (seconds, done) = try_out((&Silent, 1e9), |watch| Ok(watch.cancelled())).unwrap().unwrap();
        assert!(seconds >= 0.0 && !done);
        // It is stopped, or fails for another reason.
        let stopped = |_: &Watch<'_>| -> Result<()> { Err(crate::ChainError::Cancelled.into()) };
        assert!(try_out((&Silent, 0.0), stopped).unwrap().is_none());
        assert!(try_out((&Silent, 1e9), stopped).is_err());
    }

    #[test]
    fn a_whole_rehearsal_times_its_stages() {
        let acts = Acts { before: &["read"], cycles: &["minor", "major"], after: &["map"] };
        let shown = Ended { verdict: (0.5, false), counts: (6.0, 100.0) }.shown(&acts, (Some(1.0), 4.0), 1);
        assert_eq!(shown.tried.iter().map(|t| t.seconds).collect::<Vec<_>>(), [1.0, 2.5, 0.5]);
        assert_eq!((shown.course.turns, shown.course.steps, shown.course.searched), (6.0, 100.0, Some(false)));
        let two = Ended { verdict: (0.5, true), counts: (6.0, 100.0) }.shown(&acts, (Some(1.0), 4.0), 2);
        assert_eq!((two.tried[0].seconds, two.course.turns, two.course.steps), (3.5, 3.0, 50.0));
    }
}
