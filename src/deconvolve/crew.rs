//! Threads that stand ready for short pieces of work.
//!
//! A minor cycle has some 30 us of work for all threads, and then as much for one. A thread of the pool that finds nothing to do falls asleep, and
//! to wake it takes longer than the work. The threads of a crew wait awake for a short time.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a helper waits for more work. It then goes back to the pool.
const PATIENCE: Duration = Duration::from_micros(200);
/// Looks for work between two looks at the clock.
const LOOKS: usize = 128;
/// Most helpers: a piece of work is too short for more.
const MOST: usize = 7;

/// The thread that owns it, and helpers from the pool that it runs on. A helper holds a thread of the pool while it waits.
pub(super) struct Crew {
    board: Arc<Board>,
}

/// What the threads of a crew see.
struct Board {
    batch: Mutex<Option<Arc<Batch>>>,
    /// Number of batches so far.
    batches: AtomicUsize,
    /// Whether each helper works or waits. Helper k is member k + 1 of the crew, whose member 0 is the owner.
    present: Vec<AtomicBool>,
    over: AtomicBool,
}

/// Work in parts, as many for each member of the crew.
struct Batch {
    work: Box<dyn Fn(usize) + Send + Sync>,
    taken: Vec<AtomicBool>,
    /// Parts of each member.
    each: usize,
    done: AtomicUsize,
}

impl Batch {
    /// Do one's own parts, then those that nobody has begun.
    fn help(&self, member: usize) {
        let parts = self.taken.len();
        for part in (0..parts).map(|k| (member * self.each + k) % parts) {
            if !self.taken[part].swap(true, Ordering::Relaxed) {
                (self.work)(part);
                self.done.fetch_add(1, Ordering::Release);
            }
        }
    }
}

impl Crew {
    /// A crew of the threads of the pool of this thread.
    pub(super) fn new() -> Self {
        let helpers = (rayon::current_num_threads() - 1).min(MOST);
        let present = (0..helpers).map(|_| AtomicBool::new(false)).collect();
        Self { board: Arc::new(Board { batch: Mutex::new(None), batches: AtomicUsize::new(0), present, over: AtomicBool::new(false) }) }
    }

    /// Number of threads, with the one that owns it.
    pub(super) fn members(&self) -> usize {
        self.board.present.len() + 1
    }

    /// Do some work in parts, `each` for each member: the first for member 0. Each part is done on the same thread every time where this is at
    /// hand, because its cache has what the part used before. All parts have ended when this returns.
    pub(super) fn each(&self, each: usize, work: impl Fn(usize) + Send + Sync + 'static) {
        let parts = each * self.members();
        if self.members() == 1 {
            return (0..parts).for_each(work);
        }
        let taken = (0..parts).map(|_| AtomicBool::new(false)).collect();
        let batch = Arc::new(Batch { work: Box::new(work), taken, each, done: AtomicUsize::new(0) });
        *self.board.batch.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&batch));
        self.board.batches.fetch_add(1, Ordering::Release);
        for (k, present) in self.board.present.iter().enumerate() {
            if !present.swap(true, Ordering::AcqRel) {
                let board = Arc::clone(&self.board);
                rayon::spawn(move || board.help(k));
            }
        }
        batch.help(0);
        let mut looks = 0;
        while batch.done.load(Ordering::Acquire) < parts {
            wait(&mut looks);
        }
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        self.board.over.store(true, Ordering::Release);
    }
}

impl Board {
    /// Help with each batch until none comes for a while.
    fn help(&self, helper: usize) {
        let (mut seen, mut looks, mut since) = (0, 0, Instant::now());
        while !self.over.load(Ordering::Acquire) {
            let batches = self.batches.load(Ordering::Acquire);
            if batches != seen {
                seen = batches;
                let batch = self.batch.lock().unwrap_or_else(PoisonError::into_inner).clone();
                if let Some(batch) = batch {
                    batch.help(helper + 1);
                }
                (looks, since) = (0, Instant::now());
            } else if looks % LOOKS == LOOKS - 1 && since.elapsed() > PATIENCE {
                break;
            }
            wait(&mut looks);
        }
        self.present[helper].store(false, Ordering::Release);
    }
}

/// Let some time pass between two looks: little at first, then another thread may have the processor.
fn wait(looks: &mut usize) {
    *looks += 1;
    if looks.is_multiple_of(LOOKS) {
        std::thread::yield_now();
    } else {
        std::hint::spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With helpers or without them, and where these are late or have left.
    #[test]
    fn each_part_is_done_once() {
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let crew = Crew::new();
                assert_eq!(crew.members(), threads);
                for turn in 0..200 {
                    if turn % 40 == 39 {
                        std::thread::sleep(3 * PATIENCE);
                    }
                    let counts: Arc<Vec<AtomicUsize>> = Arc::new((0..3 * threads).map(|_| AtomicUsize::new(0)).collect());
                    let seen = Arc::clone(&counts);
                    crew.each(3, move |part| {
                        seen[part].fetch_add(1, Ordering::Relaxed);
                    });
                    assert!(counts.iter().all(|c| c.load(Ordering::Relaxed) == 1), "{threads} threads");
                }
            });
        }
    }
}
