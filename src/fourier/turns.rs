//! Gridding by several threads: each takes the next tiles of a list, and sums are made in the order of the list.
//!
//! Tiles that reach each other have different colours. A thread that has summed a tile waits, before it adds the tile to the planes, until those tiles of earlier
//! colours are done that it may reach: those in the rows of tiles beside it. All others go on meanwhile, so that threads do not halt after each colour.

use crate::Result;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How far the tiles of a row reach: into the next row, or over the edge of the grid from the last two rows.
const REACH: usize = 2;
/// How often a thread looks whether it is its turn before it lets others run.
const LOOKS: usize = 200;

/// The rows, of so many, whose tiles may reach those of a row.
pub(super) fn reached_rows(row: usize, rows: usize) -> impl Iterator<Item = usize> {
    (row + rows - REACH.min(rows)..=row + rows + REACH).map(move |at| at % rows)
}

/// How many tasks of each colour are left in each row of tiles.
pub(super) struct Turns {
    /// \[colour, row\].
    left: Vec<AtomicUsize>,
    rows: usize,
}

impl Turns {
    /// Tasks of these colours and rows, which are not done.
    pub(super) fn new((colours, rows): (usize, usize), tasks: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut left: Vec<AtomicUsize> = (0..colours * rows).map(|_| AtomicUsize::new(0)).collect();
        tasks.for_each(|(colour, row)| *left[colour * rows + row].get_mut() += 1);
        Self { left, rows }
    }

    /// The turn of a task of this colour and row.
    pub(super) fn of(&self, colour: usize, row: usize) -> Turn<'_> {
        Turn { turns: self, colour, row, here: colour == 0 }
    }
}

/// The turn of a task. The task is done when it is dropped, even if it has failed, so that nobody waits for it forever.
pub(super) struct Turn<'a> {
    turns: &'a Turns,
    colour: usize,
    row: usize,
    here: bool,
}

impl Turn<'_> {
    /// Wait until the planes have all tiles of earlier colours that this one may reach. Their threads do not wait for this one, since they wait for earlier
    /// colours only, and take no other work meanwhile.
    pub(super) fn wait(&mut self) {
        if std::mem::replace(&mut self.here, true) {
            return;
        }
        let Turns { left, rows } = self.turns;
        for colour in 0..self.colour {
            for row in reached_rows(self.row, *rows) {
                let mut looks = 0;
                while left[colour * rows + row].load(Ordering::Acquire) > 0 {
                    looks += 1;
                    if looks < LOOKS { std::hint::spin_loop() } else { std::thread::yield_now() }
                }
            }
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.turns.left[self.colour * self.turns.rows + self.row].fetch_sub(1, Ordering::Release);
    }
}

/// Let all threads take these tasks in their order. `work` must not wait for other tasks of the pool: a thread that waits there may take up anything else.
pub(super) fn take_turns<T: Sync, S>(
    tasks: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &T) -> Result<()> + Sync,
) -> Result<()> {
    let next = AtomicUsize::new(0);
    let takers = rayon::current_num_threads().min(tasks.len());
    (0..takers).into_par_iter().with_max_len(1).try_for_each(|_| {
        let mut own = None;
        while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
            work(own.get_or_insert_with(&state), task)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChainError;
    use std::sync::Mutex;

    /// Tasks (colour, row), of which the earlier ones take longer.
    fn tasks() -> Vec<(usize, usize)> {
        (0..3).flat_map(|colour| (0..40).map(move |row| (colour, row))).collect()
    }

    #[test]
    fn a_task_waits_for_earlier_colours_in_the_rows_that_it_reaches() {
        let (tasks, done) = (tasks(), Mutex::new(Vec::new()));
        let turns = Turns::new((3, 40), tasks.iter().copied());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
        let work = |_: &mut (), (colour, row): &(usize, usize)| {
            let mut turn = turns.of(*colour, *row);
            std::thread::sleep(std::time::Duration::from_micros(if (row + colour) % 7 == 0 { 2000 } else { 50 }));
            turn.wait();
            done.lock().unwrap().push((*colour, *row));
            Ok(())
        };
        pool.install(|| take_turns(&tasks, || (), work)).unwrap();
        let done = done.into_inner().unwrap();
        assert_eq!(done.len(), tasks.len());
        for (at, (colour, row)) in done.iter().enumerate() {
            let apart = |other: usize| row.abs_diff(other).min(40 - row.abs_diff(other));
            let early = done[at + 1..].iter().any(|(c, r)| c < colour && apart(*r) <= REACH);
            assert!(!early, "colour {colour} of row {row} came before its turn");
        }
        assert!(turns.left.iter().all(|n| n.load(Ordering::Relaxed) == 0));
    }

    #[test]
    fn a_task_that_fails_lets_the_others_end() {
        let tasks = tasks();
        let turns = Turns::new((3, 40), tasks.iter().copied());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let work = |_: &mut (), (colour, row): &(usize, usize)| {
            turns.of(*colour, *row).wait();
            if (*colour, *row) == (0, 3) { Err(ChainError::Internal("a task".into())) } else { Ok(()) }
        };
        assert!(pool.install(|| take_turns(&tasks, || (), work)).is_err());
    }

    #[test]
    fn few_rows_of_tiles_wait_for_each_other() {
        for rows in 1..5 {
            let turns = Turns::new((2, rows), (0..rows).map(|row| (0, row)).chain([(1, 0)]));
            let first: Vec<Turn<'_>> = (0..rows).map(|row| turns.of(0, row)).collect();
            drop(first);
            turns.of(1, 0).wait();
            assert!(turns.left.iter().all(|n| n.load(Ordering::Relaxed) == 0));
        }
    }
}
