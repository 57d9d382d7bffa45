//! Loops whose items are handed out one by one to the threads that are free.
//!
//! The pool of threads divides a loop into a few parts, and looks again only when a thread has nothing left: of a loop with few long items, such as blocks of columns,
//! one thread may still have several to do when the other ends. Here it has at most one, and each thread makes its buffers once.

use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Do `work` for each item, with what `state` makes for a thread. Half of the threads take items from the front and half from the back, so that two threads
/// seldom write into the same cache line.
pub(super) fn share_out<I, S>(items: I, state: impl Fn() -> S + Sync, work: impl Fn(&mut S, I::Item) + Sync)
where
    I: DoubleEndedIterator + ExactSizeIterator + Send,
    I::Item: Send,
{
    let n = items.len();
    let items = Mutex::new(items);
    let take = |thread: usize| {
        let mut items = items.lock().unwrap_or_else(PoisonError::into_inner);
        if thread.is_multiple_of(2) { items.next() } else { items.next_back() }
    };
    hand_out((n, take), state, work);
}

/// Do `work` for each of `n` items, with what `state` makes for a thread. `take` gives a thread its next item.
pub(super) fn hand_out<T, S>(
    (n, take): (usize, impl Fn(usize) -> Option<T> + Sync),
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, T) + Sync,
) {
    let threads = rayon::current_num_threads().min(n);
    (0..threads).into_par_iter().with_max_len(1).for_each(|thread| {
        // A thread that comes too late needs no state.
        let mut own = None;
        while let Some(item) = take(thread) {
            work(own.get_or_insert_with(&state), item);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_item_is_worked_on_once_with_a_state_for_each_thread() {
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for n in [0, 1, 2, 57] {
                let (mut values, states) = (vec![0; n], AtomicUsize::new(0));
                let state = || states.fetch_add(1, Ordering::Relaxed);
                pool.install(|| share_out(values.iter_mut().enumerate(), state, |_, (k, v)| *v += k + 1));
                assert_eq!(values, (1..=n).collect::<Vec<_>>());
                assert!(states.into_inner() <= threads.min(n), "{threads} threads, {n} items");
            }
        }
    }
}
