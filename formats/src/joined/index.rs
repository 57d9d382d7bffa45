//! Which files hold each row of a joined set.
//!
//! Rows keep their order within each file, so the row of a file follows from a count. Runs of rows in the same files are one entry, and a pattern of
//! runs that repeats from time to time is stored once. A set that is cut in time needs a few bytes for each file; one that is cut by baselines needs
//! one pattern, unless rows are missing here and there.

use std::collections::HashMap;

/// A run of rows: the number of the set of files that hold them, and how many rows.
pub(super) type Run = (u32, u32);

/// The index of a joined set.
#[derive(Debug, Default)]
pub(super) struct RowIndex {
    /// Sets of files, each sorted. The first file of a set tells the coverage of its rows.
    sets: Vec<Vec<u32>>,
    patterns: Vec<Pattern>,
    /// Pattern and number of repetitions.
    entries: Vec<(u32, u32)>,
    n_rows: usize,
    known_sets: HashMap<Vec<u32>, u32>,
    known_patterns: HashMap<Vec<Run>, u32>,
}

#[derive(Debug)]
struct Pattern {
    runs: Vec<Run>,
    rows: usize,
    /// Files that the pattern takes rows from, with the number of these rows.
    taken: Vec<(u32, usize)>,
}

impl RowIndex {
    /// The number of a set of files, and whether it is new.
    pub(super) fn set(&mut self, files: &[u32]) -> (u32, bool) {
        if let Some(k) = self.known_sets.get(files) {
            return (*k, false);
        }
        let k = self.sets.len() as u32;
        self.sets.push(files.to_vec());
        self.known_sets.insert(files.to_vec(), k);
        (k, true)
    }

    /// The files of a set.
    pub(super) fn files(&self, set: u32) -> &[u32] {
        &self.sets[set as usize]
    }

    /// All sets of files, with the number of rows that each holds.
    pub(super) fn sets(&self) -> Vec<(&[u32], usize)> {
        let mut rows = vec![0; self.sets.len()];
        for (pattern, times) in &self.entries {
            for (set, n) in &self.patterns[*pattern as usize].runs {
                rows[*set as usize] += *n as usize * *times as usize;
            }
        }
        self.sets.iter().map(Vec::as_slice).zip(rows).collect()
    }

    /// Number of rows.
    pub(super) fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Append runs of rows.
    pub(super) fn push(&mut self, runs: Vec<Run>) {
        let rows = runs.iter().map(|r| r.1 as usize).sum::<usize>();
        if rows == 0 {
            return;
        }
        self.n_rows += rows;
        let k = match self.known_patterns.get(&runs) {
            Some(k) => *k,
            None => {
                let mut taken: HashMap<u32, usize> = HashMap::new();
                for (set, n) in &runs {
                    self.sets[*set as usize].iter().for_each(|file| *taken.entry(*file).or_default() += *n as usize);
                }
                let mut taken: Vec<_> = taken.into_iter().collect();
                taken.sort_unstable();
                self.patterns.push(Pattern { runs: runs.clone(), rows, taken });
                self.known_patterns.insert(runs, self.patterns.len() as u32 - 1);
                self.patterns.len() as u32 - 1
            }
        };
        match self.entries.last_mut() {
            Some(last) if last.0 == k && last.1 < u32::MAX => last.1 += 1,
            _ => self.entries.push((k, 1)),
        }
    }

    /// Drop what only building needs.
    pub(super) fn built(mut self) -> Self {
        (self.known_sets, self.known_patterns) = (HashMap::new(), HashMap::new());
        self
    }
}

/// A place in a joined set: the next row, and the next row of each file.
#[derive(Debug, Clone)]
pub(super) struct Place {
    row: usize,
    entry: usize,
    times: u32,
    run: usize,
    within: u32,
    /// Next row of each file.
    next: Vec<usize>,
}

impl Place {
    /// The beginning of a set of `n` files.
    pub(super) fn start(n: usize) -> Self {
        Self { row: 0, entry: 0, times: 0, run: 0, within: 0, next: vec![0; n] }
    }

    /// The next row of a file.
    pub(super) fn next_of(&self, file: u32) -> usize {
        self.next[file as usize]
    }

    /// Go to a row.
    pub(super) fn go(&mut self, index: &RowIndex, row: usize) {
        if row < self.row {
            *self = Self::start(self.next.len());
        }
        while self.row < row {
            let Some((pattern, times)) = index.entries.get(self.entry) else { return };
            let pattern = &index.patterns[*pattern as usize];
            // Whole repetitions are skipped at once.
            let whole = ((row - self.row) / pattern.rows).min((*times - self.times) as usize);
            if self.run == 0 && self.within == 0 && whole > 0 {
                pattern.taken.iter().for_each(|(file, n)| self.next[*file as usize] += n * whole);
                self.row += pattern.rows * whole;
                self.times += whole as u32;
                self.end_of_entry(*times);
            } else {
                self.step(index, row - self.row);
            }
        }
    }

    /// Pass at most `most` rows of the present run. Returns the set of files and the number of rows; `None` at the end.
    pub(super) fn step(&mut self, index: &RowIndex, most: usize) -> Option<Run> {
        let (pattern, times) = *index.entries.get(self.entry)?;
        let runs = &index.patterns[pattern as usize].runs;
        let (set, len) = runs[self.run];
        let n = (len - self.within).min(u32::try_from(most).unwrap_or(u32::MAX));
        index.files(set).iter().for_each(|file| self.next[*file as usize] += n as usize);
        (self.row, self.within) = (self.row + n as usize, self.within + n);
        if self.within == len {
            (self.within, self.run) = (0, self.run + 1);
        }
        if self.run == runs.len() {
            (self.run, self.times) = (0, self.times + 1);
            self.end_of_entry(times);
        }
        Some((set, n))
    }

    fn end_of_entry(&mut self, times: u32) {
        if self.times == times {
            (self.entry, self.times) = (self.entry + 1, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_the_same_however_it_was_reached() {
        let mut index = RowIndex::default();
        let (a, b, both) = (index.set(&[0]).0, index.set(&[1]).0, index.set(&[0, 1]).0);
        assert_eq!((index.set(&[1]), index.set(&[2]).1), ((b, false), true));
        for _ in 0..5 {
            index.push(vec![(a, 2), (both, 1), (b, 3)]);
        }
        index.push(vec![(b, 4)]);
        index.push(Vec::new());
        assert_eq!((index.entries.len(), index.patterns.len(), index.n_rows()), (2, 2, 34));
        assert_eq!(index.sets()[2], ([0_u32, 1].as_slice(), 5));
        let index = index.built();
        let mut slow = Place::start(3);
        for row in 0..=34 {
            let (mut fast, mut back) = (Place::start(3), Place::start(3));
            fast.go(&index, row);
            back.go(&index, 34);
            back.go(&index, row);
            for place in [&fast, &back] {
                assert_eq!((place.row, &place.next), (slow.row, &slow.next), "row {row}");
            }
            assert_eq!(fast.step(&index, 1), slow.step(&index, 1));
        }
        assert_eq!(slow.next, [15, 24, 0]);
    }
}
