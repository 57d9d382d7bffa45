//! Rows of the main table as rows of a set. The spectral windows of one baseline and time form one row of the set.

use super::table::Table;
use crate::{FormatError, Result};
use std::collections::HashMap;
use std::ops::Range;

/// Number of rows that are read together while the index is made.
const STEP: usize = 65_536;
/// Marks a spectral window without a row.
const NONE: u64 = u64::MAX;
/// Largest number of data descriptions in use. More than this indicate a damaged file.
const MAX_WINDOWS: usize = 4096;

/// Places of the rows of a set in the main table.
#[derive(Debug)]
pub(super) enum Index {
    /// One window: the rows are those of the table.
    One {
        /// Data description.
        id: i32,
        /// Number of rows.
        rows: usize,
    },
    /// Several windows: the row of the table for each window of each row of the set; NONE where there is no such row.
    Several {
        /// Data descriptions, ascending.
        ids: Vec<i32>,
        /// \[row, window\]
        rows: Vec<u64>,
    },
}

/// A run of rows of the table that are consecutive rows of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    /// First row in the table.
    pub(super) start: usize,
    /// First row in the block that is read.
    pub(super) at: usize,
    pub(super) rows: usize,
}

impl Index {
    /// Find the rows that belong together. A table with one window needs no memory; with several windows the index has 8 bytes per row.
    ///
    /// # Errors
    /// Columns that are missing or damaged, or too many data descriptions.
    pub(super) fn new(main: &Table, n_rows: usize) -> Result<Self> {
        let mut ids: Vec<i32> = Vec::new();
        for start in (0..n_rows).step_by(STEP) {
            for id in main.scalars::<i32>("DATA_DESC_ID", start, STEP.min(n_rows - start))? {
                if let Err(k) = ids.binary_search(&id) {
                    ids.insert(k, id);
                }
            }
            if ids.len() > MAX_WINDOWS {
                let expected = format!("at most {MAX_WINDOWS} data descriptions in use");
                return Err(FormatError::malformed(&main.path, "DATA_DESC_ID", expected, format!("{} of them", ids.len())));
            }
        }
        if let [id] = ids[..] {
            return Ok(Self::One { id, rows: n_rows });
        }
        let mut rows: Vec<u64> = Vec::new();
        let mut known: HashMap<(u64, i32, i32, i32), usize> = HashMap::new();
        // Rows of the set with the same key. `next_of` gives the next of them. `last_of` gives, for the first of them and a window, the last one
        // that has a row of this window.
        let (mut next_of, mut last_of): (HashMap<usize, usize>, HashMap<(usize, usize), usize>) = Default::default();
        for start in (0..n_rows).step_by(STEP) {
            let n = STEP.min(n_rows - start);
            let (id, time) = (main.scalars::<i32>("DATA_DESC_ID", start, n)?, main.scalars::<f64>("TIME", start, n)?);
            let (ant1, ant2) = (main.scalars::<i32>("ANTENNA1", start, n)?, main.scalars::<i32>("ANTENNA2", start, n)?);
            let field = main.scalars::<i32>("FIELD_ID", start, n)?;
            for k in 0..n {
                let window = ids.binary_search(&id[k]).map_err(|_| {
                    let expected = "the data descriptions found before (did the table change?)";
                    FormatError::malformed(&main.path, format!("DATA_DESC_ID, row {}", start + k), expected, id[k].to_string())
                })?;
                let key = (time[k].to_bits(), ant1[k], ant2[k], field[k]);
                let first = *known.entry(key).or_insert_with(|| add_slot(&mut rows, ids.len()));
                let mut slot = first;
                if rows[first * ids.len() + window] != NONE {
                    // The same baseline, time and window again: use the next row of the set with this key.
                    let last = last_of.get(&(first, window)).copied().unwrap_or(first);
                    slot = *next_of.entry(last).or_insert_with(|| add_slot(&mut rows, ids.len()));
                    last_of.insert((first, window), slot);
                }
                rows[slot * ids.len() + window] = (start + k) as u64;
            }
        }
        Ok(Self::Several { ids, rows })
    }

    /// Data descriptions in use, ascending.
    pub(super) fn ids(&self) -> &[i32] {
        match self {
            Self::One { id, .. } => std::slice::from_ref(id),
            Self::Several { ids, .. } => ids,
        }
    }

    /// Number of rows of the set.
    pub(super) fn n_rows(&self) -> usize {
        match self {
            Self::One { rows, .. } => *rows,
            Self::Several { ids, rows } => rows.len() / ids.len().max(1),
        }
    }

    /// A row of the table that belongs to a window.
    pub(super) fn first_row(&self, window: usize) -> Option<usize> {
        match self {
            Self::One { .. } => Some(0),
            Self::Several { ids, rows } => rows.iter().skip(window).step_by(ids.len()).find(|r| **r != NONE).map(|r| *r as usize),
        }
    }

    /// The rows of the table for a window of a range of rows of the set, in runs.
    pub(super) fn runs(&self, range: Range<usize>, window: usize) -> Vec<Run> {
        let (ids, rows) = match self {
            Self::One { .. } => return vec![Run { start: range.start, at: 0, rows: range.len() }],
            Self::Several { ids, rows } => (ids, rows),
        };
        let mut runs: Vec<Run> = Vec::new();
        for (at, row) in range.clone().map(|r| rows[r * ids.len() + window]).enumerate().filter(|(_, row)| *row != NONE) {
            match runs.last_mut() {
                Some(run) if run.at + run.rows == at && run.start + run.rows == row as usize => run.rows += 1,
                _ => runs.push(Run { start: row as usize, at, rows: 1 }),
            }
        }
        runs
    }
}

/// Add a row of the set, still without rows of the table.
fn add_slot(rows: &mut Vec<u64>, windows: usize) -> usize {
    rows.resize(rows.len() + windows, NONE);
    rows.len() / windows - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_several_windows_come_in_runs() {
        let index = Index::Several { ids: vec![0, 3], rows: vec![0, 4, 1, 5, 2, NONE, 3, 6] };
        assert_eq!(index.n_rows(), 4);
        assert_eq!(index.runs(0..4, 0), [Run { start: 0, at: 0, rows: 4 }]);
        assert_eq!(index.runs(0..4, 1), [Run { start: 4, at: 0, rows: 2 }, Run { start: 6, at: 3, rows: 1 }]);
        assert_eq!(index.runs(2..3, 1), []);
        assert_eq!(index.first_row(1), Some(4));
    }
}
