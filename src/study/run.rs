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

/// Run the trials that are not in `done` on `threads` threads. Each result and its index go to `each`, on the calling thread, in the order
/// in which the trials finish. Every trial runs on a rayon pool of one thread, so that sums always have the same order.
///
/// # Errors
/// The first error of a trial (with its point and seed) or of `each`; a request to stop. Results of finished trials have been given to `each`.
pub fn run(
    study: &Study,
    done: &BTreeSet<usize>,
    threads: usize,
    each: &mut dyn FnMut(usize, TrialResult) -> Result<()>,
    observer: &dyn Observer,
) -> Result<()> {
    let todo: Vec<usize> = (0..study.n_trials()).filter(|k| !done.contains(k)).collect();
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
            let (sender, todo, next, stop) = (sender.clone(), &todo, &next, &stop);
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
                    let (point, seed) = study.place(k);
                    let found = pool.install(|| trial(&study.setups[point], seed)).map_err(|e| at(study, point, seed, &e));
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
fn at(study: &Study, point: usize, seed: u64, error: &ChainError) -> ChainError {
    let values = study.grid.place(point);
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
