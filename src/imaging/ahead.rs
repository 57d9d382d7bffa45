//! Reads the next block of a source while the current block is processed.
//!
//! One thread reads, because a source gives its blocks in turn. All threads grid. Where there is a single thread, no block is read ahead.
//! A thread of the pool does not read ahead either: it would wait for the reader, and the reader for the pool, which applies gains to what
//! is read.

use crate::Result;
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilitySource, for_each_block};
use std::sync::mpsc::sync_channel;

/// The reason why the reading ends early.
enum Stop {
    Source(ArrayError),
    /// `work` has failed, so no further block is needed.
    Done,
}

impl From<ArrayError> for Stop {
    fn from(e: ArrayError) -> Self {
        Self::Source(e)
    }
}

/// Call `work` for every block of about `target_bytes` of a source, in order, with the index of its first row. With more than one thread, two
/// blocks are in memory at the same time.
///
/// # Errors
/// The first error of the source or of `work`.
pub(super) fn for_each_block_ahead(
    source: &mut dyn VisibilitySource,
    target_bytes: usize,
    work: impl FnMut(usize, VisibilityBlock) -> Result<()>,
) -> Result<()> {
    if rayon::current_num_threads() == 1 || rayon::current_thread_index().is_some() {
        return for_each_block(source, target_bytes, work);
    }
    ahead(source, target_bytes, work)
}

fn ahead(source: &mut dyn VisibilitySource, target_bytes: usize, mut work: impl FnMut(usize, VisibilityBlock) -> Result<()>) -> Result<()> {
    std::thread::scope(|scope| {
        // The reader waits until its block is taken.
        let (blocks, taken) = sync_channel(0);
        let reader =
            scope.spawn(move || for_each_block(source, target_bytes, |first, block| blocks.send((first, block)).map_err(|_| Stop::Done)));
        let result = taken.iter().try_for_each(|(first, block)| work(first, block));
        drop(taken);
        match reader.join() {
            Ok(Err(Stop::Source(e))) => result.and(Err(e.into())),
            Ok(Ok(()) | Err(Stop::Done)) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChainError;
    use crate::fixtures::{positions, snapshot};
    use cittert_arrays::{Polarization, VisUnit, VisibilityHeader};
    use rayon::prelude::*;
    use std::ops::Range;

    /// A source that breaks at a row.
    struct Broken<S>(S, usize);

    impl<S: VisibilitySource> VisibilitySource for Broken<S> {
        fn header(&self) -> &VisibilityHeader {
            self.0.header()
        }

        fn n_rows(&self) -> usize {
            self.0.n_rows()
        }

        fn read_rows(&mut self, range: Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
            if range.contains(&self.1) {
                return Err(ArrayError::OutOfRange { what: "row", index: self.1, len: self.1 });
            }
            self.0.read_rows(range)
        }
    }

    /// First rows that were handed out, and how it ended.
    fn run(is_ahead: bool, broken_at: usize, refuse: usize) -> (Vec<usize>, Result<()>) {
        let set = snapshot(&positions(12, 5.0, 0.0, 1), &[90e9], &[Polarization::I], &[], (1.0, VisUnit::Jy));
        let mut source = Broken(set, broken_at);
        let mut seen = Vec::new();
        let work = |first, block: VisibilityBlock| {
            if first >= refuse {
                return Err(ChainError::Cancelled);
            }
            assert!(block.vis.shape()[0] > 0);
            seen.push(first);
            Ok(())
        };
        let result = if is_ahead { ahead(&mut source, 800, work) } else { for_each_block_ahead(&mut source, 800, work) };
        (seen, result)
    }

    #[test]
    fn blocks_come_in_order_and_the_first_error_ends_them() {
        let (all, result) = run(false, usize::MAX, usize::MAX);
        assert!(result.is_ok() && all.len() > 5 && all.is_sorted(), "{all:?}");
        for is_ahead in [false, true] {
            assert_eq!(run(is_ahead, usize::MAX, usize::MAX).0, all);
            let (seen, result) = run(is_ahead, 30, usize::MAX);
            assert!(matches!(result, Err(ChainError::Array(ArrayError::OutOfRange { index: 30, .. }))), "{result:?}");
            assert_eq!(seen[..], all[..seen.len()]);
            assert!(seen.iter().all(|f| *f <= 30));
            let (seen, result) = run(is_ahead, usize::MAX, all[3]);
            assert!(matches!(result, Err(ChainError::Cancelled)) && seen[..] == all[..3], "{seen:?} {result:?}");
        }
    }

    /// A source that works on the pool while it reads.
    struct OnThePool<S>(S);

    impl<S: VisibilitySource> VisibilitySource for OnThePool<S> {
        fn header(&self) -> &VisibilityHeader {
            self.0.header()
        }

        fn n_rows(&self) -> usize {
            self.0.n_rows()
        }

        fn read_rows(&mut self, range: Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
            let mut block = self.0.read_rows(range)?;
            block.weights.par_mapv_inplace(|w| 2.0 * w);
            Ok(block)
        }
    }

    #[test]
    fn all_threads_of_a_pool_may_read_at_once() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let rows: Vec<usize> = pool.install(|| {
            (0..200)
                .into_par_iter()
                .map(|_| {
                    let mut source = OnThePool(snapshot(&positions(12, 5.0, 0.0, 1), &[90e9], &[Polarization::I], &[], (1.0, VisUnit::Jy)));
                    let mut rows = 0;
                    for_each_block_ahead(&mut source, 800, |_, block| {
                        rows += block.n_rows();
                        Ok(())
                    })
                    .unwrap();
                    rows
                })
                .collect()
        });
        assert_eq!(rows, [66; 200]);
    }
}
