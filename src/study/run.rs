//! Runs all trials of a study on several threads. Each trial runs on one thread.

use super::axis::Grid;
use super::trial::{Setup, TrialResult, trial};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// A grid of points and the seeds of each.
#[derive(Debug, Clone)]
pub struct Study {
    /// The axes.
    pub grid: Grid,
    /// The trial to run at each point \[point\].
    pub setups: Vec<Setup>,
    /// Seeds of the trials of every point.
    pub seeds: Vec<u64>,
}

impl Study {
    /// Number of trials.
    #[must_use]
    pub fn n_trials(&self) -> usize {
        self.setups.len() * self.seeds.len()
    }

    /// Point and seed of a trial: seeds run fastest.
    #[must_use]
    pub fn place(&self, trial: usize) -> (usize, u64) {
        (trial / self.seeds.len(), self.seeds[trial % self.seeds.len()])
    }
}

/// Time between two messages about the time left.
const TELL_EVERY: Duration = Duration::from_secs(10);

/// Trials to run: each has a number, which the caller chooses.
pub struct Batch<'a> {
    /// Numbers of the trials.
    pub todo: &'a [usize],
    /// The point and the seed of a trial.
    pub job: &'a (dyn Fn(usize) -> (&'a Setup, u64) + Sync),
    /// Where a trial is, for the message of an error, such as `corrupt.phase-rms = 20deg`.
    pub place: &'a (dyn Fn(usize) -> String + Sync),
}

/// Run the trials of a study that are not in `done`, as [`run_batch`] does.
///
/// # Errors
/// As for [`run_batch`].
pub fn run(
    study: &Study,
    done: &BTreeSet<usize>,
    threads: usize,
    each: &mut dyn FnMut(usize, TrialResult) -> Result<()>,
    observer: &dyn Observer,
) -> Result<()> {
    let todo: Vec<usize> = (0..study.n_trials()).filter(|k| !done.contains(k)).collect();
    let job = |k: usize| {
        let (point, seed) = study.place(k);
        (&study.setups[point], seed)
    };
    let place = |k: usize| study.grid.place(study.place(k).0);
    run_batch(&Batch { todo: &todo, job: &job, place: &place }, threads, each, observer)
}

/// Run trials on `threads` threads. Each result and its number go to `each`, on the calling thread, in the order in which the trials
/// finish. Every trial runs on a rayon pool of one thread, so that sums always have the same order.
///
/// # Errors
/// The first error of a trial (with its place and seed) or of `each`; a request to stop. Results of finished trials have been given to `each`.
pub fn run_batch(
    batch: &Batch<'_>,
    threads: usize,
    each: &mut dyn FnMut(usize, TrialResult) -> Result<()>,
    observer: &dyn Observer,
) -> Result<()> {
    let todo = batch.todo;
    if todo.is_empty() {
        return Ok(());
    }
    let threads = threads.clamp(1, todo.len());
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    // The channel is bounded: workers wait if they finish trials faster than the caller stores them.
    let (sender, receiver) = mpsc::sync_channel(4 * threads);
    observer.event(Event::Phase { name: "trials", total: Some(todo.len() as u64), unit: "trial" });
    let result = std::thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, next, stop) = (sender.clone(), &next, &stop);
            scope.spawn(move || {
                let pool = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                    Ok(pool) => pool,
                    Err(e) => {
                        let _ = sender.send((0, Err(ChainError::Other(Box::new(e)))));
                        return;
                    }
                };
                while let Some(&k) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    let (setup, seed) = (batch.job)(k);
                    let found = pool.install(|| trial(setup, seed)).map_err(|e| at(&(batch.place)(k), seed, &e));
                    if sender.send((k, found)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let result = collect(&receiver, todo.len(), each, observer);
        stop.store(true, Ordering::Relaxed);
        // The channel must be closed here. Otherwise workers that wait to send would never end, and the scope would wait for them.
        drop(receiver);
        result
    });
    observer.event(Event::Done);
    result
}

fn collect(
    receiver: &mpsc::Receiver<(usize, Result<TrialResult>)>,
    total: usize,
    each: &mut dyn FnMut(usize, TrialResult) -> Result<()>,
    observer: &dyn Observer,
) -> Result<()> {
    let started = Instant::now();
    let mut told: Option<Instant> = None;
    for (n, (k, found)) in receiver.iter().enumerate() {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        each(k, found?)?;
        observer.event(Event::Advance(1));
        let n = n + 1;
        if told.is_none_or(|t| t.elapsed() >= TELL_EVERY) && n < total {
            told = Some(Instant::now());
            let left = started.elapsed().as_secs_f64() / n as f64 * (total - n) as f64;
            observer.event(Event::Note(&format!("{n} of {total} trials done, about {} left", duration(left))));
        }
    }
    Ok(())
}

/// Where a trial failed.
fn at(values: &str, seed: u64, error: &ChainError) -> ChainError {
    let place = if values.is_empty() { format!("seed {seed}") } else { format!("{values}, seed {seed}") };
    ChainError::Incompatible(format!("the trial at {place} failed: {error}"))
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
