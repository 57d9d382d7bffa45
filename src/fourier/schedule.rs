//! How evenly threads share the tiles of a pass. The schedule is simulated from the work of each task, so it is known for more threads than any
//! machine at hand has.

use super::sorted_rows::SortedRows;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Numbers of threads whose schedules are simulated: powers of 2.
const POWERS: usize = 11;

/// How much longer some tasks take than their work over the number of threads, for 1, 2, 4 ... 1024 threads. It is at least 1, and larger where
/// threads wait for the last tasks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Idle([f64; POWERS]);

impl Default for Idle {
    /// No thread ever waits.
    fn default() -> Self {
        Self([1.0; POWERS])
    }
}

impl Idle {
    /// The factor for a number of threads, between those that were simulated by the logarithm.
    #[must_use]
    pub fn at(&self, threads: usize) -> f64 {
        let power = (threads.max(1) as f64).log2().min((POWERS - 1) as f64);
        let below = power.floor() as usize;
        let above = (below + 1).min(POWERS - 1);
        self.0[below] + (self.0[above] - self.0[below]) * (power - below as f64)
    }

    /// Tasks of which a free thread takes the next one.
    fn of_tasks(tasks: &[usize]) -> Self {
        let total: usize = tasks.iter().sum();
        if total == 0 {
            return Self::default();
        }
        Self(std::array::from_fn(|power| (makespan(tasks, 1 << power) << power) as f64 / total as f64))
    }
}

/// Time until the last of some tasks ends, where each free thread takes the next one.
fn makespan(tasks: &[usize], threads: usize) -> usize {
    let mut free: BinaryHeap<Reverse<usize>> = (0..threads.min(tasks.len())).map(|_| Reverse(0)).collect();
    for task in tasks {
        if let Some(Reverse(at)) = free.pop() {
            free.push(Reverse(at + task));
        }
    }
    free.into_iter().map(|Reverse(at)| at).max().unwrap_or(0)
}

impl SortedRows {
    /// How threads share gridding or prediction. That gridding also waits for tiles of earlier
    /// colours is left out. With two threads this is rare, with many it is not, and their time is then too short.
    pub(crate) fn idle(&self) -> Idle {
        let units = self.colours.iter().flatten();
        let tasks: Vec<usize> = units.flat_map(|u| &u.pieces).map(|piece| piece.iter().map(|s| s.weight).sum()).collect();
        Idle::of_tasks(&tasks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_wait_for_the_last_task() {
        let idle = Idle::of_tasks(&[4, 3, 3, 2, 2, 2]);
        assert_eq!(idle.at(1), 1.0);
        // Two threads: 4 + 2 + 2 beside 3 + 3 + 2.
        assert_eq!(idle.at(2), 1.0);
        // Four threads: 4 beside 3 + 2, 3 and 2 + 2 for 16 of work.
        assert_eq!(idle.at(4), 20.0 / 16.0);
        // More threads than tasks: the longest task.
        assert_eq!(idle.at(8), 8.0 * 4.0 / 16.0);
        assert_eq!(idle.at(3), idle.at(2) + (3.0_f64.log2() - 1.0) * (idle.at(4) - idle.at(2)));
        assert_eq!((idle.at(0), Idle::of_tasks(&[]).at(7)), (1.0, 1.0));
    }
}
