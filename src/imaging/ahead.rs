//! Reads the next block of a source while the current block is processed.
//!
//! A source gives its blocks in turn, so one task reads the next block while another works on this one. Both may share their work with all threads of the pool. A
//! task that has ended first helps with the other, so no thread waits idly. Where there is a single thread, no block is read ahead.

use crate::Result;
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilitySource, for_each_block, rows_of_block};
use std::ops::Range;

/// Call `work` for every block of about `target_bytes` of a source, in order, with the index of its first row. With more than one thread, two
/// blocks are in memory at the same time.
///
/// # Errors
/// The first error of the source or of `work`.
pub(super) fn for_each_block_ahead(
    source: &mut dyn VisibilitySource,
    target_bytes: usize,
    work: impl FnMut(usize, VisibilityBlock) -> Result<()> + Send,
) -> Result<()> {
    if rayon::current_num_threads() == 1 { for_each_block(source, target_bytes, work) } else { ahead(source, target_bytes, work) }
}

fn ahead(
    source: &mut dyn VisibilitySource,
    target_bytes: usize,
    mut work: impl FnMut(usize, VisibilityBlock) -> Result<()> + Send,
) -> Result<()> {
    let (step, n) = (rows_of_block(source.header(), target_bytes), source.n_rows());
    let mut read = |rows: Range<usize>| -> Option<std::result::Result<VisibilityBlock, ArrayError>> {
        (!rows.is_empty()).then(|| source.read_rows(rows))
    };
    let mut start = 0;
    let mut block = read(0..step.min(n)).transpose()?;
    while let Some(now) = block.take() {
        let after = (start + step).min(n);
        let (worked, next) = rayon::join(|| work(start, now), || read(after..(after + step).min(n)));
        worked?;
        (start, block) = (after, next.transpose()?);
    }
    Ok(())
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
