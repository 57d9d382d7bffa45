//! The stages of `study`: trials that all take the time of one that was timed.

use super::stage::{Forecast, Stage};
use super::term::Term;

/// Bytes of a trial in the journal and in the tables, and of the page with its pictures.
const TRIAL: f64 = 550.0;
const PAGE: f64 = 250e3;

/// Trials of which one was timed on this machine, as each runs: on one thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trials {
    /// Number of trials of a process.
    pub count: usize,
    /// Time until the first, s.
    pub setup_s: f64,
    /// Time of one, s.
    pub trial_s: f64,
    /// Memory of the process before the first trial and at most in it, bytes.
    pub memory: (f64, f64),
    /// Threads, which run trials side by side.
    pub threads: usize,
    /// Memory of the program itself, bytes.
    pub base_bytes: f64,
}

/// The forecast of a study. Trials that run side by side share the observations.
#[must_use]
pub fn study(trials: Trials) -> Forecast {
    let (before, most) = trials.memory;
    let threads = trials.threads.clamp(1, trials.count.max(1));
    let beside = (most - before).max(0.0) * (threads - 1) as f64;
    let held = |bytes: f64| (bytes - trials.base_bytes).max(0.0);
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let setup = Stage { timed_s: trials.setup_s, ..Stage::new("set up", held(before)) };
    let timed_s = trials.trial_s * trials.count.div_ceil(threads) as f64;
    let run = Stage { timed_s, ..Stage::new("trials", held(most + beside)) };
    Forecast { stages: vec![start, setup, run], output_bytes: trials.count as f64 * TRIAL + PAGE, ..Forecast::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_share_trials_and_hold_more() {
        let one = Trials { count: 9, setup_s: 1.0, trial_s: 2.0, memory: (5e7, 8e7), threads: 1, base_bytes: 4e7 };
        let timed = |t: Trials| study(t).stages.iter().map(|s| s.timed_s).sum::<f64>();
        let bytes = |t: Trials| study(t).stages.iter().map(|s| s.bytes).fold(0.0, f64::max);
        assert_eq!((timed(one), bytes(one)), (19.0, 4e7));
        // Nine trials on four threads are three turns; more threads than trials help no more.
        assert_eq!((timed(Trials { threads: 4, ..one }), bytes(Trials { threads: 4, ..one })), (7.0, 13e7));
        assert_eq!(timed(Trials { threads: 50, ..one }), 3.0);
    }
}
