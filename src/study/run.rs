//! Runs all trials of a study on several threads, of one or several processes. Each trial runs on one thread.

use super::axis::Grid;
use super::hand_out::{Pool, Ran, Store, hand_out, take_part};
use super::trial::{Setup, TrialResult, trial};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Alone, Ranks};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Mutex, PoisonError};
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
    /// Numbers of the trials. Only process 0 needs them.
    pub todo: &'a [usize],
    /// The point and the seed of a trial.
    pub job: &'a (dyn Fn(usize) -> (&'a Setup, u64) + Sync),
    /// Where a trial is, for the message of an error, such as `corrupt.phase-rms = 20deg`.
    pub place: &'a (dyn Fn(usize) -> String + Sync),
    /// The processes that share the trials. All of them must run the batch.
    pub ranks: &'a dyn Ranks,
}

/// The number of a trial, and its result.
pub type Found = (usize, TrialResult);

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
    let batch = Batch { todo: &todo, job: &job, place: &place, ranks: &Alone };
    run_batch(&batch, threads, &mut |found| found.into_iter().try_for_each(|(k, result)| each(k, result)), observer)
}

/// Run trials on `threads` threads of each process. The results go to `each` in process 0, on the calling thread, in the order in which the trials
/// finish: all that have finished since it was called last. Every trial runs on a rayon pool of one thread, so that sums always have the same
/// order.
///
/// # Errors
/// The first error of a trial (with its place and seed) or of `each`; a request to stop. Results of finished trials have been given to `each`.
pub fn run_batch(batch: &Batch<'_>, threads: usize, each: &mut dyn FnMut(Vec<Found>) -> Result<()>, observer: &dyn Observer) -> Result<()> {
    let (total, several) = (batch.todo.len(), batch.ranks.size() > 1);
    if total == 0 && !several {
        return Ok(());
    }
    observer.event(Event::Phase { name: "trials", total: Some(total as u64), unit: "trial" });
    let mut store = told(total, each, observer);
    let result = if !several {
        let threads = threads.clamp(1, total);
        with_workers(batch, threads, |numbers, results| alone(batch.todo, (numbers, results), &mut store))
    } else if batch.ranks.rank() == 0 {
        with_workers(batch, threads, |numbers, results| {
            hand_out(batch.todo, batch.ranks, Pool { numbers, results, threads }, &mut store, observer)
        })
    } else {
        with_workers(batch, threads, |numbers, results| take_part(batch.ranks, Pool { numbers, results, threads }, observer))
    };
    observer.event(Event::Done);
    result
}

/// Have `lead` lead threads that run trials: it sends their numbers, and receives their results.
fn with_workers(batch: &Batch<'_>, threads: usize, lead: impl FnOnce(Sender<usize>, &Receiver<Ran>) -> Result<()>) -> Result<()> {
    let stop = AtomicBool::new(false);
    let (numbers, queue) = mpsc::channel::<usize>();
    let queue = Mutex::new(queue);
    // The channel is bounded: workers wait if they finish trials faster than the caller stores them.
    let (sender, results) = mpsc::sync_channel(4 * threads);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, queue, stop) = (sender.clone(), &queue, &stop);
            scope.spawn(move || {
                let pool = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                    Ok(pool) => pool,
                    Err(e) => {
                        let _ = sender.send((0, Err(ChainError::Other(Box::new(e)))));
                        return;
                    }
                };
                let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).recv();
                while let Ok(k) = next() {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    let (setup, seed) = (batch.job)(k);
                    let run = || trial(setup, seed).map_err(|e| at(&(batch.place)(k), seed, &e));
                    let found = catch_unwind(AssertUnwindSafe(|| pool.install(run))).unwrap_or_else(|panic| {
                        // Nobody may wait for the result of a trial that panics.
                        let _ = sender.send((k, Err(ChainError::Incompatible("a trial has an internal error".into()))));
                        resume_unwind(panic)
                    });
                    if sender.send((k, found)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let result = lead(numbers, &results);
        stop.store(true, Ordering::Relaxed);
        // The channel must be closed here. Otherwise workers that wait to send would never end, and the scope would wait for them.
        drop(results);
        result
    })
}

/// Run all trials here.
fn alone(todo: &[usize], (numbers, results): (Sender<usize>, &Receiver<Ran>), store: &mut Store<'_>) -> Result<()> {
    // The channel has no bound, and the workers hold its end as long as this function runs.
    todo.iter().try_for_each(|k| numbers.send(*k)).map_err(|e| ChainError::Other(Box::new(e)))?;
    drop(numbers);
    while let Ok(first) = results.recv() {
        store(&mut std::iter::once(first).chain(results.try_iter()))?;
    }
    Ok(())
}

/// Gives results to `each`, and tells how many there are, and how long the rest takes. What was found before an error is stored.
fn told<'a>(
    total: usize,
    each: &'a mut dyn FnMut(Vec<Found>) -> Result<()>,
    observer: &'a dyn Observer,
) -> impl FnMut(&mut dyn Iterator<Item = Ran>) -> Result<()> + 'a {
    let started = Instant::now();
    let (mut n, mut told) = (0, None::<Instant>);
    move |results| {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let mut found = Vec::new();
        let mut failed = Ok(());
        for (k, result) in results {
            match result {
                Ok(result) => found.push((k, result)),
                Err(e) => failed = failed.and(Err(e)),
            }
        }
        let new = found.len();
        if new > 0 {
            each(found)?;
            n += new;
            observer.event(Event::Advance(new as u64));
        }
        failed?;
        if new > 0 && told.is_none_or(|t| t.elapsed() >= TELL_EVERY) && n < total {
            told = Some(Instant::now());
            let left = started.elapsed().as_secs_f64() / n as f64 * (total - n) as f64;
            observer.event(Event::Note(&format!("{n} of {total} trials done, about {} left", duration(left))));
        }
        Ok(())
    }
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
