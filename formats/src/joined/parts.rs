//! Rows of a joined set in small parts, where every row lies in one file that has all channels and products of the set.
//!
//! Each file is read in parts of its own. These are cut where the rows of the set go on in another file, and at multiples of the step.

use super::source::{JoinedSource, Piece};
use cittert_arrays::{ArrayError, PartSource, RowPart};
use std::ops::Range;

impl PartSource for JoinedSource {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<(), ArrayError> {
        let (pieces, reads) = self.pieces(range)?;
        for ((file, rows), pieces) in reads.into_iter().zip(pieces.chunk_by(|a, b| a.file == b.file)) {
            let source =
                self.file(file)?.in_parts().ok_or_else(|| ArrayError::Stream("a file that can no longer be read in parts".into()))?;
            source.read_parts(rows, step, &|part| cut(&part, pieces, step, take))?;
        }
        Ok(())
    }

    fn held_bytes(&mut self) -> usize {
        // Files of one set mostly have chunks of one shape.
        self.file(0).ok().and_then(|file| file.in_parts()).map_or(0, |first| first.held_bytes())
    }
}

/// Hand over the rows of a part of a file at their places in the set. `pieces` are those of the file, in the order of its rows.
fn cut(part: &RowPart<'_>, pieces: &[Piece], step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) {
    let n = part.vis.len() / part.rows.len().max(1);
    let first = pieces.partition_point(|p| p.from + p.n <= part.rows.start);
    for piece in pieces[first..].iter().take_while(|p| p.from < part.rows.end) {
        let mut from = piece.from.max(part.rows.start);
        let end = (piece.from + piece.n).min(part.rows.end);
        while from < end {
            let to = piece.to + (from - piece.from);
            let rows = (end - from).min(step - to % step);
            let values = (from - part.rows.start) * n..(from + rows - part.rows.start) * n;
            take(RowPart {
                rows: to..to + rows,
                vis: &part.vis[values.clone()],
                weights: &part.weights[values.clone()],
                flags: &part.flags[values],
            });
            from += rows;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{parts, plan, plans, set};
    use super::*;
    use cittert_arrays::{Alone, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource};
    use num_complex::Complex32;
    use proptest::prelude::*;
    use std::path::PathBuf;
    use std::sync::Mutex;

    /// A file that hands over its rows in parts, last part first.
    struct InParts(VisibilitySet);

    impl VisibilitySource for InParts {
        fn header(&self) -> &VisibilityHeader {
            &self.0.header
        }

        fn n_rows(&self) -> usize {
            self.0.data.n_rows()
        }

        fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock, ArrayError> {
            self.0.read_rows(range)
        }

        fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
            Some(self)
        }
    }

    impl PartSource for InParts {
        fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<(), ArrayError> {
            let starts: Vec<usize> = range.clone().step_by(step).collect();
            for start in starts.into_iter().rev() {
                let block = self.0.read_rows(start..(start + step).min(range.end))?;
                let rows = start - range.start..start - range.start + block.n_rows();
                let (vis, weights, flags) = values(&block);
                take(RowPart { rows, vis: &vis, weights: &weights, flags: &flags });
            }
            Ok(())
        }
    }

    /// The values of a block in row order.
    fn values(block: &VisibilityBlock) -> (Vec<Complex32>, Vec<f32>, Vec<bool>) {
        (block.vis.iter().copied().collect(), block.weights.iter().copied().collect(), block.flags.iter().copied().collect())
    }

    fn joined(files: Vec<VisibilitySet>) -> JoinedSource {
        let names = (0..files.len()).map(|k| PathBuf::from(format!("part{k:04}.uvh5"))).collect();
        JoinedSource::of(names, Box::new(move |k| Ok(Box::new(InParts(files[k].clone())))), &Alone).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        /// However the rows are cut into files, parts hold each of them once, as blocks do.
        #[test]
        fn parts_hold_what_blocks_hold(plan in plans(), step in 1..12_usize, from in 0..9_usize) {
            let mut plan = plan;
            (plan.cuts[1], plan.cuts[2]) = (1, 1);
            let mut source = joined(parts(&plan, &set(&plan)));
            let range = from.min(source.n_rows())..source.n_rows();
            let block = source.read_rows(range.clone()).unwrap();
            let n = block.vis.shape()[1] * block.vis.shape()[2];
            let (vis, weights, flags) = values(&block);
            let seen = Mutex::new(vec![0; range.len()]);
            let take = |part: RowPart<'_>| {
                let of = part.rows.start * n..part.rows.end * n;
                assert_eq!(part.rows.start / step, (part.rows.end - 1) / step, "{:?} crosses a multiple of {step}", part.rows);
                assert!(*part.vis == vis[of.clone()] && *part.weights == weights[of.clone()] && *part.flags == flags[of]);
                part.rows.for_each(|r| seen.lock().unwrap()[r] += 1);
            };
            source.in_parts().unwrap().read_parts(range, step, &take).unwrap();
            prop_assert!(seen.into_inner().unwrap().iter().all(|n| *n == 1));
        }
    }

    #[test]
    fn files_of_some_channels_or_products_are_not_read_in_parts() {
        for cuts in [[1, 2, 1, 1], [1, 1, 2, 1]] {
            let mut plan = plan();
            plan.cuts = cuts;
            assert!(joined(parts(&plan, &set(&plan))).in_parts().is_none());
        }
    }
}
