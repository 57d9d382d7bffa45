//! How evenly threads share the tiles of a pass. The schedule is simulated from the work of each task, so it is known for more threads than any
//! machine at hand has.

use super::sorted_rows::SortedRows;
use super::turns::reached_rows;
use super::units::Unit;
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

    /// Tasks of which a free thread takes the next one. Each lies in one of so many rows.
    fn of_tasks(tasks: &[Task], rows: usize) -> Self {
        let total: usize = tasks.iter().map(|t| t.work).sum();
        if total == 0 {
            return Self::default();
        }
        Self(std::array::from_fn(|power| (makespan(tasks, rows, 1 << power) << power) as f64 / total as f64))
    }
}

/// A task of gridding, in the order of the list.
#[derive(Debug, Clone, Copy)]
struct Task {
    colour: usize,
    row: usize,
    work: usize,
    /// The part of its work after which it waits for the tasks of earlier colours in the rows around it. `None` if it does not wait.
    alone: Option<usize>,
}

/// Time until the last task ends, where each free thread takes the next one and waits as gridding does.
fn makespan(tasks: &[Task], rows: usize, threads: usize) -> usize {
    let mut free: BinaryHeap<Reverse<usize>> = (0..threads.min(tasks.len())).map(|_| Reverse(0)).collect();
    // When the last task in each row ends: of earlier colours, and of the present one.
    let (mut earlier, mut present) = (vec![0; rows], vec![0; rows]);
    let mut colour = 0;
    for task in tasks {
        if task.colour != colour {
            earlier.iter_mut().zip(&present).for_each(|(e, p)| *e = (*e).max(*p));
            colour = task.colour;
        }
        let Some(Reverse(start)) = free.pop() else { break };
        let end = task.alone.map_or(start + task.work, |alone| {
            let ready = reached_rows(task.row, rows).map(|row| earlier[row]).max().unwrap_or(0);
            (start + alone).max(ready) + task.work - alone
        });
        present[task.row] = present[task.row].max(end);
        free.push(Reverse(end));
    }
    free.into_iter().map(|Reverse(at)| at).max().unwrap_or(0)
}

impl SortedRows {
    /// How threads share gridding on so many rows of tiles. Prediction has the same tasks and does not wait for its turn, so it takes a little less.
    pub(crate) fn idle(&self, rows: usize) -> Idle {
        let units = self.colours.iter().enumerate().flat_map(|(colour, units)| units.iter().map(move |u| (colour, u)));
        let tasks: Vec<Task> = units.flat_map(|(colour, unit)| tasks_of(colour, unit)).collect();
        Idle::of_tasks(&tasks, rows)
    }
}

/// The tasks of a unit. Of the pieces of a crowded tile the last one adds all.
fn tasks_of(colour: usize, unit: &Unit) -> impl Iterator<Item = Task> {
    let last = unit.pieces.len() - 1;
    unit.pieces.iter().enumerate().map(move |(k, segments)| {
        let work = segments.iter().map(|s| s.weight).sum();
        let first_tile = segments.iter().take_while(|s| s.key == segments[0].key).map(|s| s.weight).sum();
        Task { colour, row: unit.v, work, alone: (k == last).then_some(first_tile) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_wait_for_the_last_task() {
        let tasks = [4, 3, 3, 2, 2, 2].map(|work| Task { colour: 0, row: 0, work, alone: None });
        let idle = Idle::of_tasks(&tasks, 1);
        assert_eq!(idle.at(1), 1.0);
        // Two threads: 4 + 2 + 2 beside 3 + 3 + 2.
        assert_eq!(idle.at(2), 1.0);
        // Four threads: 4 beside 3 + 2, 3 and 2 + 2 for 16 of work.
        assert_eq!(idle.at(4), 20.0 / 16.0);
        // More threads than tasks: the longest task.
        assert_eq!(idle.at(8), 8.0 * 4.0 / 16.0);
        assert_eq!(idle.at(3), idle.at(2) + (3.0_f64.log2() - 1.0) * (idle.at(4) - idle.at(2)));
        assert_eq!((idle.at(0), Idle::of_tasks(&[], 0).at(7)), (1.0, 1.0));
    }

    #[test]
    fn threads_wait_for_the_tiles_around() {
        let task = |colour, row, work, alone| Task { colour, row, work, alone: Some(alone) };
        // The second colour waits in the next row after one third of its work, and in a row far away not at all.
        let near = [task(0, 0, 10, 10), task(1, 2, 6, 2)];
        let far = [task(0, 0, 10, 10), task(1, 3, 6, 2)];
        assert_eq!((makespan(&near, 9, 1), makespan(&near, 9, 2)), (16, 14));
        assert_eq!(makespan(&far, 9, 2), 10);
        // The last rows of tiles reach over the edge of the grid.
        assert_eq!(makespan(&[task(0, 0, 10, 10), task(1, 8, 6, 2)], 9, 2), 14);
        // A task of the same colour never waits, whatever lies between.
        assert_eq!(makespan(&[task(0, 0, 10, 10), task(0, 0, 6, 2)], 9, 2), 10);
        // Its colour is two later: it waits for both.
        assert_eq!(makespan(&[task(0, 0, 3, 3), task(1, 0, 3, 3), task(2, 0, 5, 1)], 1, 3), 3 + 4);
        assert_eq!(makespan(&[task(0, 0, 3, 3), task(1, 0, 5, 1), task(2, 0, 5, 1)], 1, 3), 3 + 4 + 4);
    }
}
