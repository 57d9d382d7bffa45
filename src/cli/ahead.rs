//! Sets that do not exist yet, and that the commands of a forecast read.
//!
//! The forecast of a run asks each of its commands what it will take. Most of them read the set that an earlier one would write. Their forecasts need its
//! header and its baselines, which follow from the options of the earlier command, and no visibility.

use cittert_arrays::{ArrayError, CoveragePlan, PartSource, RowPart, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::Array3;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

type Result<T> = std::result::Result<T, ArrayError>;

/// Bytes of two groups of the chunks that this program writes, and of an unpacked value: visibility, weight and flag.
const CHUNKS: usize = 8_000_000;
const UNPACKED: usize = 13;

/// A set whose baselines are known. Its visibilities are not: they read as 0 with the weight 1.
#[derive(Debug, Clone)]
pub(super) struct SetAhead {
    pub(super) header: VisibilityHeader,
    pub(super) plan: CoveragePlan,
}

impl VisibilitySource for SetAhead {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.plan.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        let shape = self.header.shape(range.len());
        let ones = Array3::ones(shape);
        VisibilityBlock::new(self.read_coverage(range)?, Array3::zeros(shape), ones.clone(), Array3::from_elem(shape, false), ones)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        self.plan.rows(range)
    }

    // Files of simulated visibilities are UVH5, which is read in parts.
    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        Some(self)
    }
}

impl PartSource for SetAhead {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<()> {
        for start in range.clone().step_by(step.max(1)) {
            let block = self.read_rows(start..(start + step.max(1)).min(range.end))?;
            let rows = start - range.start..start - range.start + block.n_rows();
            if let (Some(vis), Some(weights), Some(flags)) = (block.vis.as_slice(), block.weights.as_slice(), block.flags.as_slice()) {
                take(RowPart { rows, vis, weights, flags });
            }
        }
        Ok(())
    }

    fn held_bytes(&mut self) -> usize {
        let (rows, channels, products) = self.header.shape(self.n_rows());
        CHUNKS.min(UNPACKED * rows * channels * products)
    }
}

/// The sets that commands of a forecast would have written, by their names.
#[derive(Debug, Default)]
pub(super) struct Ahead(Mutex<Vec<(PathBuf, SetAhead)>>);

impl Ahead {
    /// Keep the set that a command would write.
    pub(super) fn promise(&self, path: &Path, set: SetAhead) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|(name, _)| name != path);
        all.push((path.to_owned(), set));
    }

    /// The set of this name, if a command of the forecast would have written it.
    pub(super) fn get(&self, path: &Path) -> Option<SetAhead> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().find(|(name, _)| name == path).map(|(_, set)| set.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, snapshot};
    use cittert_arrays::{Polarization, VisUnit};

    #[test]
    fn a_promised_set_has_the_rows_of_its_plan() {
        let made = snapshot(&positions(5, 0.5, 0.01, 3), &[94e9, 95e9], &[Polarization::I], &[(0.0, 0.0, 1.0)], (0.0, VisUnit::Jy));
        let header = made.header().clone();
        let plan = CoveragePlan::snapshot(&header.layout, 2_460_000.5, 1.0).unwrap();
        let ahead = Ahead::default();
        assert!(ahead.get(Path::new("a.uvh5")).is_none());
        ahead.promise(Path::new("a.uvh5"), SetAhead { header, plan });
        let mut set = ahead.get(Path::new("a.uvh5")).unwrap();
        assert_eq!(set.n_rows(), 10);
        let block = set.read_rows(3..7).unwrap();
        assert_eq!((block.n_rows(), block.coverage.uvw_m.row(0)), (4, made.data.coverage.uvw_m.row(3)));
        let seen = Mutex::new(Vec::new());
        set.in_parts().unwrap().read_parts(2..9, 3, &|part| seen.lock().unwrap().push((part.rows.clone(), part.vis.len()))).unwrap();
        assert_eq!(seen.into_inner().unwrap(), [(0..3, 6), (3..6, 6), (6..7, 2)]);
    }
}
