//! The newest job of a tab. A job that has not begun is replaced by the next one.

use super::state::State;
use crate::progress::{Event, Observer};
use std::sync::{Condvar, Mutex, PoisonError};

/// A state to compute.
#[derive(Debug)]
pub(super) struct Job {
    /// The number that the page gave to it.
    pub(super) seq: u64,
    /// True while the hand moves: only what is quick is computed.
    pub(super) moving: bool,
    pub(super) state: Box<State>,
}

#[derive(Debug, Default)]
struct Held {
    job: Option<Job>,
    closed: bool,
}

/// Holds at most one job.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    held: Mutex<Held>,
    arrived: Condvar,
}

impl Mailbox {
    /// Put a job in the place of the one that waits.
    pub(super) fn put(&self, job: Job) {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).job = Some(job);
        self.arrived.notify_one();
    }

    /// Tell the worker to end.
    pub(super) fn close(&self) {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.arrived.notify_one();
    }

    /// Wait for a job; `None` once the tab is closed.
    pub(super) fn take(&self) -> Option<Job> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if held.closed {
                return None;
            }
            if let Some(job) = held.job.take() {
                return Some(job);
            }
            held = self.arrived.wait(held).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// True once the tab is closed.
    pub(super) fn is_closed(&self) -> bool {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).closed
    }

    /// True where what is computed now is of no use any more.
    pub(super) fn is_stale(&self) -> bool {
        let held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.closed || held.job.is_some()
    }
}

/// Stops work that nobody waits for: a newer job has come, or the tab is closed. What is quick is finished although a newer job waits, so that
/// a hand that never rests sees something.
pub(super) struct WhileWanted<'a> {
    pub(super) mailbox: &'a Mailbox,
    pub(super) quick: bool,
}

impl Observer for WhileWanted<'_> {
    fn event(&self, _event: Event<'_>) {}

    fn cancelled(&self) -> bool {
        if self.quick { self.mailbox.is_closed() } else { self.mailbox.is_stale() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(seq: u64) -> Job {
        let state = r#"{ "layout": {}, "simulate": { "freq": "94GHz", "bandwidth": "1GHz" } }"#;
        Job { seq, moving: false, state: serde_json::from_str(state).unwrap() }
    }

    #[test]
    fn the_newest_job_wins_and_ends_the_one_before() {
        let mailbox = Mailbox::default();
        (1..=3).for_each(|seq| mailbox.put(job(seq)));
        assert_eq!(mailbox.take().unwrap().seq, 3);
        let (slow, quick) = (WhileWanted { mailbox: &mailbox, quick: false }, WhileWanted { mailbox: &mailbox, quick: true });
        assert!(!slow.cancelled() && !quick.cancelled());
        mailbox.put(job(4));
        assert!(slow.cancelled() && !quick.cancelled());
        mailbox.close();
        assert!(slow.cancelled() && quick.cancelled());
        assert!(mailbox.take().is_none());
    }
}
