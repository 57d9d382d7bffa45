//! Frames in order: several are made at once, and the frames before them are written at the same time.

use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use rayon::prelude::*;
use std::sync::mpsc::sync_channel;

/// Frames that may wait to be written.
const WAITING: usize = 2;

/// What is done with each frame of a film, in this order.
pub struct Stages<See, Measure, Show, Write> {
    /// The scene of a frame. Several frames at once.
    pub see: See,
    /// What is measured of it. One frame after the other, as drifts go on from frame to frame.
    pub measure: Measure,
    /// What is shown of that. Several frames at once.
    pub show: Show,
    /// Write it. One frame after the other, while others are made.
    pub write: Write,
}

impl<See, Measure, Show, Write> Stages<See, Measure, Show, Write> {
    /// Take the frames 0 to `count` - 1 through the stages. As many are made at once as there are threads, so the memory does not depend on their number.
    ///
    /// # Errors
    /// The first error of a stage, or a stop on request.
    pub fn run<A: Send, B: Send, C: Send>(mut self, count: usize, observer: &dyn Observer) -> Result<()>
    where
        See: Fn(usize) -> Result<A> + Sync,
        Measure: FnMut(usize, A) -> Result<B>,
        Show: Fn(usize, B) -> Result<C> + Sync,
        Write: FnMut(usize, C) -> Result<()> + Send,
    {
        let (see, measure, show, mut write) = (self.see, &mut self.measure, self.show, self.write);
        observer.event(Event::Phase { name: "filming", total: Some(count as u64), unit: "frames" });
        let done = std::thread::scope(|scope| {
            let (send, receive) = sync_channel::<(usize, C)>(WAITING);
            let writer = scope.spawn(move || {
                for (k, frame) in receive {
                    write(k, frame)?;
                }
                Ok(())
            });
            let mut make = || -> Result<()> {
                let at_once = rayon::current_num_threads().max(1);
                for first in (0..count).step_by(at_once) {
                    ensure!(!observer.cancelled(), ChainError::Cancelled);
                    let window = first..(first + at_once).min(count);
                    let seen: Vec<(usize, A)> = window.into_par_iter().map(|k| Ok((k, see(k)?))).collect::<Result<_>>()?;
                    let measured: Vec<(usize, B)> = seen.into_iter().map(|(k, a)| Ok((k, measure(k, a)?))).collect::<Result<_>>()?;
                    let shown: Vec<(usize, C)> = measured.into_par_iter().map(|(k, b)| Ok((k, show(k, b)?))).collect::<Result<_>>()?;
                    for frame in shown {
                        // A writer that has ended has an error, which is the one to report.
                        if send.send(frame).is_err() {
                            return Ok(());
                        }
                        observer.event(Event::Advance(1));
                    }
                }
                Ok(())
            };
            let made = make();
            drop(send);
            let written = writer.join().map_err(|_| ChainError::Internal("the thread that writes the film has ended".into()))?;
            made.and(written)
        });
        observer.event(Event::Done);
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn frames_are_written_in_order_and_few_are_alive_at_once() {
        let (alive, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let (mut measured, mut seen) = (Vec::new(), Vec::new());
        let stages = Stages {
            see: |k: usize| {
                most.fetch_max(alive.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                Ok(10 * k)
            },
            measure: |k: usize, a: usize| {
                measured.push((k, a));
                Ok(a + 1)
            },
            show: |_: usize, b: usize| Ok(2 * b),
            write: |k: usize, c: usize| {
                alive.fetch_sub(1, Ordering::SeqCst);
                seen.push((k, c));
                Ok(())
            },
        };
        stages.run(200, &Silent).unwrap();
        assert_eq!(measured, (0..200).map(|k| (k, 10 * k)).collect::<Vec<_>>());
        assert_eq!(seen, (0..200).map(|k| (k, 20 * k + 2)).collect::<Vec<_>>());
        // Two windows, those that wait, and the one that is written.
        assert!(most.load(Ordering::SeqCst) <= 2 * rayon::current_num_threads() + WAITING + 1);
    }

    #[test]
    fn the_first_error_of_a_stage_ends_the_film() {
        for failing in ["see", "measure", "show", "write"] {
            let fail = |stage: &str, k: usize| {
                if stage == failing && k == 30 { Err(ChainError::NoData(failing.to_owned())) } else { Ok(()) }
            };
            let stages = Stages {
                see: |k| fail("see", k),
                measure: |k, ()| fail("measure", k),
                show: |k, ()| fail("show", k),
                write: |k, ()| fail("write", k),
            };
            assert_eq!(stages.run(50, &Silent).unwrap_err().to_string(), failing);
        }
    }
}
