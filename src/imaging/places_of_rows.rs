//! Where the rows of a set are in the u-v plane, before their visibilities are read.

use crate::fourier::{SampleOfRows, UvwExtent};
use crate::{ChainError, Result};
use cittert_arrays::{UvCoverage, VisibilitySource};
use ndarray::{Array2, ArrayView1, Axis};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;

/// Rows of a process in a sample of all of them, at most.
const SAMPLE: usize = 1 << 14;

/// What one look at the places of all rows tells.
pub(super) struct Look {
    pub(super) extent: UvwExtent,
    /// Some rows of all blocks, m \[row, 3\], and how many stand behind each.
    spread: (Array2<f64>, f64),
    /// The rows of a block in the middle.
    block: Array2<f64>,
    /// The coverage of the blocks, where it is kept.
    pub(super) kept: VecDeque<UvCoverage>,
}

impl Look {
    /// Read the coverage of blocks of rows: `one` of them is remembered, and all of it is kept where `keep` says so.
    ///
    /// # Errors
    /// The source cannot be read, or a coordinate that no array has.
    pub(super) fn at(
        source: &mut dyn VisibilitySource,
        blocks: impl ExactSizeIterator<Item = Range<usize>>,
        (one, keep): (bool, bool),
    ) -> Result<Self> {
        let (n_rows, middle) = (source.n_rows(), blocks.len() / 2);
        let each = n_rows.div_ceil(SAMPLE).max(1);
        let mut wanted = spread_over(n_rows, each).peekable();
        let (mut extent, mut kept) = (UvwExtent::default(), VecDeque::new());
        let (mut spread, mut block): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
        for (number, range) in blocks.enumerate() {
            let coverage = source.read_coverage(range.clone())?;
            refuse_impossible(&coverage, range.start)?;
            extent = extent.union(UvwExtent::of(coverage.uvw_m.view()));
            let finite = |row: usize| Some([0, 1, 2].map(|k| coverage.uvw_m[(row, k)])).filter(|uvw| uvw.iter().all(|x| x.is_finite()));
            while let Some(row) = wanted.next_if(|row| *row < range.end) {
                spread.extend(finite(row - range.start));
            }
            if one && number == middle {
                block.extend((0..coverage.n_rows()).filter_map(finite));
            }
            if keep {
                kept.push_back(coverage);
            }
        }
        Ok(Self { extent, spread: (Array2::from(spread), each as f64), block: Array2::from(block), kept })
    }

    /// The rows from which the work in so many blocks is estimated.
    pub(super) fn sample(&self, blocks: usize) -> SampleOfRows<'_> {
        SampleOfRows { spread: (self.spread.0.view(), self.spread.1), block: (self.block.view(), blocks) }
    }
}

/// One row of every `each`. Its place among them changes: a set repeats its baselines from time to time, and a fixed step would miss some of them where it has a common
/// divisor with their number.
fn spread_over(n_rows: usize, each: usize) -> impl Iterator<Item = usize> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let row = move |k: usize| k * each + ((k as f64 * GOLDEN).fract() * each as f64) as usize;
    (0..n_rows.div_ceil(each)).map(row).filter(move |row| *row < n_rows)
}

/// The uvw of rows, m \[row, 3\]. One that is not finite is replaced by 0.
pub(super) fn finite_uvw(coverage: &UvCoverage) -> Result<Array2<f64>> {
    let place = |uvw: ArrayView1<'_, f64>| if uvw.iter().all(|x| x.is_finite()) { [uvw[0], uvw[1], uvw[2]] } else { [0.0; 3] };
    let places: Vec<[f64; 3]> = coverage.uvw_m.axis_iter(Axis(0)).into_par_iter().map(place).collect();
    Array2::from_shape_vec((places.len(), 3), places.into_flattened()).map_err(|e| ChainError::Internal(e.to_string()))
}

/// Longest baseline that a set can have, m: seven times the distance of the Earth from the Sun.
const LONGEST_M: f64 = 1e12;

/// Refuse coordinates that no array has. Rows that are not finite are left out later. `first_row` is the place of the block in the set.
pub(super) fn refuse_impossible(coverage: &UvCoverage, first_row: usize) -> Result<()> {
    let far = |x: &f64| x.is_finite() && x.abs() > LONGEST_M;
    let rows = coverage.uvw_m.axis_iter(Axis(0)).into_par_iter().enumerate();
    let found = rows.find_map_first(|(row, uvw)| Some((row, *uvw.iter().find(|x| far(x))?)));
    found.map_or(Ok(()), |(row, x)| {
        let text = format!(
            "row {} has a coordinate of {x:.3e} m, which no array reaches: the set is damaged, or its uvw are not in m",
            first_row + row
        );
        Err(ChainError::Incompatible(text))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever a set repeats, and however many rows it has, all of it is in the sample about as often.
    #[test]
    fn a_sample_misses_no_baseline() {
        for (period, each) in [(351, 42), (351, 39), (1225, 35), (66, 22), (4560, 10), (7, 7)] {
            let n_rows = 400 * period * each / 10;
            let mut found = vec![0_usize; period];
            spread_over(n_rows, each).for_each(|row| found[row % period] += 1);
            let (least, most) = (*found.iter().min().unwrap(), *found.iter().max().unwrap());
            // A fixed step of 42 would meet only every third of 351.
            assert!(least > 20 && most < 60, "{period}, {each}: {least} to {most} of 40");
        }
        assert_eq!(spread_over(5, 1).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(spread_over(0, 3).count(), 0);
    }
}
