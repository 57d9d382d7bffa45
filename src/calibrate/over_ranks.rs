//! What the processes that share a set have found in their rows, brought together.
//!
//! Gains are solved from sums over the rows of each interval. Every process adds those of all processes in the same order, so all have the same bits, and
//! therefore the same gains.

use crate::closure::TimeBins;
use crate::{ChainError, Result};
use cittert_arrays::{Ranks, UvCoverage, VisibilitySource};
use std::slice::Iter;

/// Rows that are looked at together for the first time of a set.
const ROWS: usize = 4096;

/// What each process has found, as numbers, in the order of their rows. If any failed, all do.
///
/// # Errors
/// The first error of a process.
pub(crate) fn of_all(ranks: &dyn Ranks, own: Result<Vec<f64>>) -> Result<Vec<Vec<f64>>> {
    let bytes: Vec<u8> = match &own {
        // The program ends all processes.
        Err(ChainError::Cancelled) => return Err(ChainError::Cancelled),
        Err(e) => std::iter::once(1).chain(e.to_string().into_bytes()).collect(),
        Ok(numbers) => std::iter::once(0).chain(numbers.iter().flat_map(|x| x.to_le_bytes())).collect(),
    };
    let all = ranks.exchange(bytes);
    own?;
    let read = |bytes: &Vec<u8>| match bytes.split_first() {
        Some((0, rest)) => Ok(rest.chunks_exact(8).map(|b| b.try_into().map_or(f64::NAN, f64::from_le_bytes)).collect()),
        failed => Err(ChainError::Incompatible(String::from_utf8_lossy(failed.map_or(&[], |f| f.1)).into_owned())),
    };
    all.iter().map(read).collect()
}

/// Numbers of another process, read one after another.
pub(super) struct Numbers<'a>(Iter<'a, f64>);

impl<'a> Numbers<'a> {
    pub(super) fn of(numbers: &'a [f64]) -> Self {
        Self(numbers.iter())
    }

    /// The next `N` numbers; `None` at the end.
    pub(super) fn next<const N: usize>(&mut self) -> Option<[f64; N]> {
        let next = self.0.as_slice().first_chunk().copied()?;
        self.0.nth(N - 1);
        Some(next)
    }
}

/// Whether an error ends a self-calibration at once, instead of only a round or a candidate. One that a single process met in reading or writing does,
/// because the others do not know of it.
pub(crate) fn ends_all(e: &ChainError, ranks: &dyn Ranks) -> bool {
    let of_one = || matches!(e, ChainError::Array(_) | ChainError::Other(_) | ChainError::Internal(_));
    matches!(e, ChainError::Cancelled) || (ranks.size() > 1 && of_one())
}

/// Begin the intervals of all processes with the first row of the set that counts, from time and integration of the first row of this process that does.
///
/// # Errors
/// `first` is one in any process, or an interval is shorter than this integration.
pub(super) fn begin(bins: &mut TimeBins, ranks: &dyn Ranks, first: Result<Option<[f64; 2]>>) -> Result<()> {
    let all = of_all(ranks, first.map(|first| first.map_or_else(Vec::new, Vec::from)))?;
    match all.iter().find_map(|own| Numbers::of(own).next()) {
        Some([time_jd, integration_s]) => bins.key(time_jd, integration_s).map(drop),
        None => Ok(()),
    }
}

/// Time and integration of the first row of a source for which `counts` holds.
///
/// # Errors
/// The data cannot be read.
pub(super) fn first_row(source: &mut dyn VisibilitySource, counts: impl Fn(&UvCoverage, usize) -> bool) -> Result<Option<[f64; 2]>> {
    let n = source.n_rows();
    for start in (0..n).step_by(ROWS) {
        let c = source.read_coverage(start..(start + ROWS).min(n))?;
        if let Some(row) = (0..c.n_rows()).find(|row| counts(&c, *row)) {
            return Ok(Some([c.time_jd[row], c.integration_s[row]]));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::as_processes;

    #[test]
    fn numbers_of_all_processes_come_in_their_order_and_errors_to_all() {
        for all in as_processes(3, |ranks| of_all(&*ranks, Ok(vec![ranks.rank() as f64; ranks.rank()]))) {
            assert_eq!(all.unwrap(), [vec![], vec![1.0], vec![2.0, 2.0]]);
        }
        let failing = |ranks: std::sync::Arc<dyn Ranks>| {
            let own = if ranks.rank() == 1 { Err(ChainError::NoData("no row is here".into())) } else { Ok(vec![0.5]) };
            of_all(&*ranks, own)
        };
        for all in as_processes(3, failing) {
            assert_eq!(all.unwrap_err().to_string(), "no row is here");
        }
        let numbers = [1.0, 2.0, 3.0];
        let mut left = Numbers::of(&numbers);
        assert_eq!((left.next(), left.next::<2>()), (Some([1.0, 2.0]), None));
        assert_eq!((left.next(), left.next::<1>()), (Some([3.0]), None));
    }
}
