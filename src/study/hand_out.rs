//! Trials that several processes run: process 0 hands them out to whoever is free, and gets all results.
//!
//! Process 0 runs trials as well. Its calling thread, which only stores results, serves the others meanwhile: it looks for their messages and sleeps in
//! between. A process asks when it has fewer trials than threads, and gets a share of what is left, which becomes smaller towards the end: then no
//! process has much more to do than another, and few messages are sent. Process 0 dismisses the others when all results are there: a process that was
//! dismissed may ask for trials of the next batch, which must not be taken for a question about this one.
//!
//! # Reference
//! Polychronopoulos & Kuck 1987, IEEE Trans. Computers C-36, 1425 (guided self-scheduling).

use super::score::{N_SCORES, Quality};
use super::trial::TrialResult;
use crate::progress::Observer;
use crate::{ChainError, Result, ensure};
use cittert_arrays::Ranks;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

/// A trial that was run.
pub(super) type Ran = (usize, Result<TrialResult>);
/// Takes results as they come.
pub(super) type Store<'s> = dyn FnMut(&mut dyn Iterator<Item = Ran>) -> Result<()> + 's;
/// Time between two looks for messages.
const LOOK_EVERY: Duration = Duration::from_millis(1);
/// A process that asks gets what is left over this many times the number of processes.
const SHARES: usize = 4;
/// Most trials that are handed out at once. A process of many threads asks again.
const MOST: usize = 64;

/// The threads of this process: where the numbers of their trials go, where the results come from, and how many they are.
pub(super) struct Pool<'a> {
    pub(super) numbers: Sender<usize>,
    pub(super) results: &'a Receiver<Ran>,
    pub(super) threads: usize,
}

impl Pool<'_> {
    fn begin(&self, k: usize) -> Result<()> {
        self.numbers.send(k).map_err(|e| ChainError::Other(Box::new(e)))
    }

    /// What has finished, after a short wait for it.
    fn finished(&self) -> Result<Vec<Ran>> {
        match self.results.recv_timeout(LOOK_EVERY) {
            Ok(first) => Ok(std::iter::once(first).chain(self.results.try_iter()).collect()),
            Err(RecvTimeoutError::Timeout) => Ok(Vec::new()),
            Err(RecvTimeoutError::Disconnected) => Err(ChainError::Other("no thread is left that runs trials".into())),
        }
    }
}

/// Process 0: run and hand out the trials, and store the results of all.
///
/// # Errors
/// The first error of a trial, wherever it ran; an error of `store`.
pub(super) fn hand_out(todo: &[usize], ranks: &dyn Ranks, pool: Pool<'_>, store: &mut Store<'_>, observer: &dyn Observer) -> Result<()> {
    let (mut left, mut waiting_for, mut running) = (todo, todo.len(), 0_usize);
    let mut idle = Vec::new();
    while waiting_for > 0 || idle.len() + 1 < ranks.size() {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let mut results = Vec::new();
        while let Some((from, message)) = ranks.take() {
            match Message::of(&message)? {
                Message::Free => {
                    let share = share_of(&mut left, ranks.size());
                    if share.is_empty() {
                        idle.push(from);
                    } else {
                        ranks.send(from, &Message::Run(share.iter().map(|k| *k as u64).collect()).bytes());
                    }
                }
                Message::Ran(k, result) => results.push((k as usize, Ok(*result))),
                Message::Failed(text) => results.push((0, Err(ChainError::Incompatible(text)))),
                Message::Run(_) => return Err(ill_formed()),
            }
        }
        while running < pool.threads && !left.is_empty() {
            let share = share_of(&mut left, ranks.size());
            share.iter().try_for_each(|k| pool.begin(*k))?;
            running += share.len();
        }
        let own = pool.finished()?;
        running = running.saturating_sub(own.len());
        waiting_for = waiting_for.saturating_sub(own.len() + results.len());
        store(&mut results.into_iter().chain(own))?;
    }
    idle.into_iter().for_each(|process| ranks.send(process, &Message::Run(Vec::new()).bytes()));
    Ok(())
}

/// Take a share from the front of what is left.
fn share_of<'a>(left: &mut &'a [usize], processes: usize) -> &'a [usize] {
    let (share, rest) = left.split_at((left.len() / (SHARES * processes)).clamp(1, MOST).min(left.len()));
    *left = rest;
    share
}

/// Any other process: run what process 0 hands out, until nothing is left.
///
/// # Errors
/// The first error of a trial here. Process 0 knows it too.
pub(super) fn take_part(ranks: &dyn Ranks, pool: Pool<'_>, observer: &dyn Observer) -> Result<()> {
    let (mut running, mut asked, mut none_left) = (0_usize, false, false);
    while running > 0 || !none_left {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        if running < pool.threads && !asked && !none_left {
            ranks.send(0, &Message::Free.bytes());
            asked = true;
        }
        if let Some((_, message)) = ranks.take() {
            let Message::Run(share) = Message::of(&message)? else { return Err(ill_formed()) };
            (asked, none_left) = (false, share.is_empty());
            share.iter().try_for_each(|k| pool.begin(*k as usize))?;
            running += share.len();
        }
        for (k, result) in pool.finished()? {
            running = running.saturating_sub(1);
            let message = match &result {
                Ok(found) => Message::Ran(k as u64, Box::new(found.clone())),
                Err(e) => Message::Failed(e.to_string()),
            };
            ranks.send(0, &message.bytes());
            result?;
        }
    }
    Ok(())
}

/// What processes tell each other.
#[derive(Debug, Clone, PartialEq)]
enum Message {
    /// To process 0: a thread has nothing to do.
    Free,
    /// To process 0: the number and the result of a trial.
    Ran(u64, Box<TrialResult>),
    /// To process 0: a trial failed.
    Failed(String),
    /// From process 0: run these trials; none are left if there is no number.
    Run(Vec<u64>),
}

fn ill_formed() -> ChainError {
    ChainError::Other("a message of another process cannot be understood: are all of the same version?".into())
}

impl Message {
    fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Free => out.push(b'f'),
            Self::Failed(text) => {
                out.push(b'e');
                out.extend(text.as_bytes());
            }
            Self::Run(numbers) => {
                out.push(b'r');
                numbers.iter().for_each(|k| out.extend(k.to_le_bytes()));
            }
            Self::Ran(k, r) => {
                out.push(b't');
                out.extend(k.to_le_bytes());
                out.extend((r.rounds as u64).to_le_bytes());
                out.extend([u8::from(r.after.is_some()), r.accepted.map_or(2, u8::from)]);
                let after = r.after.map(|q| q.values()).unwrap_or_default();
                r.before.values().iter().chain(&after).for_each(|v| out.extend(v.to_le_bytes()));
                out.extend(r.note.as_bytes());
            }
        }
        out
    }

    fn of(bytes: &[u8]) -> Result<Self> {
        Self::read(bytes).ok_or_else(ill_formed)
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let (kind, rest) = bytes.split_first()?;
        let eight = |at: usize| rest.get(8 * at..8 * at + 8).and_then(|b| b.try_into().ok());
        match kind {
            b'f' => Some(Self::Free),
            b'e' => Some(Self::Failed(String::from_utf8_lossy(rest).into_owned())),
            b'r' => (0..rest.len() / 8).map(|k| eight(k).map(u64::from_le_bytes)).collect::<Option<_>>().map(Self::Run),
            b't' => {
                let (k, rounds) = (u64::from_le_bytes(eight(0)?), u64::from_le_bytes(eight(1)?) as usize);
                let ([after, accepted], rest) = rest.get(16..)?.split_first_chunk::<2>()?;
                let (numbers, note) = rest.split_at_checked(16 * N_SCORES)?;
                let mut values = numbers.chunks_exact(8).map(|b| b.try_into().map_or(f64::NAN, f64::from_le_bytes));
                let mut quality = || Quality::from_values(std::array::from_fn(|_| values.next().unwrap_or(f64::NAN)));
                let (before, second) = (quality(), quality());
                let accepted = if *accepted == 2 { None } else { Some(*accepted == 1) };
                let note = String::from_utf8_lossy(note).into_owned();
                Some(Self::Ran(k, Box::new(TrialResult { before, after: (*after == 1).then_some(second), accepted, rounds, note })))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_over_to_the_bit() {
        let before = Quality::from_values([0.1 + 0.2, -0.0, f64::INFINITY, 1e-300, 4.0, 5.0, 6.0]);
        let after = Quality::from_values([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        for (after, accepted) in [(None, None), (Some(after), Some(true)), (Some(after), Some(false))] {
            let result = TrialResult { before, after, accepted, rounds: 7, note: "σ \n".into() };
            for message in [Message::Ran(1 << 40, Box::new(result)), Message::Run(vec![3, 1 << 50]), Message::Run(Vec::new())] {
                assert_eq!(Message::of(&message.bytes()).unwrap(), message);
            }
        }
        assert_eq!(Message::of(&Message::Failed("why".into()).bytes()).unwrap(), Message::Failed("why".into()));
        for wrong in [&b""[..], b"x", b"t123"] {
            assert!(Message::of(wrong).is_err());
        }
    }

    #[test]
    fn shares_become_smaller_and_all_trials_are_handed_out() {
        let all: Vec<usize> = (0..1000).collect();
        let (mut left, mut sizes, mut seen) = (&all[..], Vec::new(), Vec::new());
        while !left.is_empty() {
            let share = share_of(&mut left, 4);
            sizes.push(share.len());
            seen.extend_from_slice(share);
        }
        assert_eq!(seen, all);
        assert!(sizes.is_sorted_by(|a, b| a >= b) && sizes[0] == 62 && sizes[sizes.len() - 20..].iter().all(|n| *n == 1), "{sizes:?}");
        assert!(share_of(&mut left, 4).is_empty());
    }
}
