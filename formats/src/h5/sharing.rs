//! Work on many items, shared by the threads that read a file.

use super::child::in_the_child;
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Do some work on each item with all threads; the results keep the order of the items. What the work reads is read by its own thread.
///
/// # Errors
/// Those of the work.
pub(crate) fn side_by_side<I: Sync, R: Send, E: Send>(items: &[I], work: impl Fn(&I) -> Result<R, E> + Sync) -> Result<Vec<R>, E> {
    shared(threads(), items, work)
}

thread_local! {
    /// True on a thread that does a part of some work, which is not shared out again.
    static SHARES: Cell<bool> = const { Cell::new(false) };
}

/// Number of threads for some work. The threads of the pool do not exist in a forked process.
pub(super) fn threads() -> usize {
    if in_the_child() || SHARES.get() { 1 } else { rayon::current_num_threads() }
}

/// Do some work on each item with the given number of threads; the results keep the order of the items. The threads are not those of the
/// pool: the work of the pool may wait for what a reader reads.
pub(super) fn shared<I: Sync, R: Send, E: Send>(
    threads: usize,
    items: &[I],
    work: impl Fn(&I) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    if threads < 2 || items.len() < 2 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let one = || -> Result<Vec<(usize, R)>, E> {
        SHARES.set(true);
        let indices = std::iter::from_fn(|| Some(next.fetch_add(1, Relaxed)).filter(|k| *k < items.len()));
        let done = indices.map(|k| Ok((k, work(&items[k])?))).collect();
        SHARES.set(false);
        done
    };
    let parts = std::thread::scope(|scope| {
        let threads: Vec<_> = (1..threads.min(items.len())).map(|_| scope.spawn(one)).collect();
        let mine = one();
        let others = threads.into_iter().map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p)));
        std::iter::once(mine).chain(others).collect::<Result<Vec<_>, E>>()
    })?;
    let mut all: Vec<(usize, R)> = parts.into_iter().flatten().collect();
    all.sort_by_key(|r| r.0);
    Ok(all.into_iter().map(|r| r.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order_and_parts_do_not_share_again() {
        let items: Vec<usize> = (0..100).collect();
        let inner = |k: &usize| (threads() == 1).then_some(2 * k).ok_or(*k);
        assert_eq!(shared(4, &items, inner).unwrap(), items.iter().map(|k| 2 * k).collect::<Vec<_>>());
        assert!(shared(4, &items, |k| if *k == 60 { Err(*k) } else { Ok(()) }).is_err());
        assert_eq!(threads(), rayon::current_num_threads());
    }
}
