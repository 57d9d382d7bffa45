//! Sums over rows of a block in one interval of the normal equations.
//!
//! Where one interval has most rows, several tasks share its baselines: each looks at all rows, and adds those of its own.

use super::grouping::{ChannelPlan, FeedPlan};
use super::normal_sums::{Cell, IntervalSums, SampleCounts};
use crate::closure::{TimeSpan, n_pairs, pair_index};
use cittert_arrays::UvCoverage;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::ops::Range;

/// Most tasks that share the baselines of an interval, and the rows for each of them.
const TASKS: usize = 16;
const ROWS: usize = 1024;

/// The samples of a block \[row, chan, pol\] with those of the model, and where they belong.
pub(super) struct RowsOfBlock<'a> {
    pub(super) coverage: &'a UvCoverage,
    pub(super) vis: &'a [Complex32],
    pub(super) weights: &'a [f32],
    pub(super) flags: &'a [bool],
    pub(super) model: &'a [Complex32],
    /// Samples of a row.
    pub(super) samples: usize,
    pub(super) n_pol: usize,
    pub(super) n_ant: usize,
    pub(super) feeds: &'a FeedPlan,
    pub(super) channels: &'a ChannelPlan,
    /// True where the sums of each row are kept too.
    pub(super) by_row: bool,
}

/// What was found in some rows beside the sums of their baselines.
pub(super) struct Added {
    pub(super) counts: SampleCounts,
    /// Antennas with a sample that was used.
    pub(super) present: Vec<bool>,
    span: TimeSpan,
    rows: Vec<(u32, Cell)>,
}

impl RowsOfBlock<'_> {
    /// Add these rows to the sums of their interval.
    pub(super) fn add(&self, rows: &[usize], sums: &mut IntervalSums) -> Added {
        let n_pairs = n_pairs(self.n_ant);
        let tasks = (rows.len() / ROWS).min(TASKS).min(n_pairs).max(1);
        let shares: Vec<Range<usize>> = (0..tasks).map(|k| k * n_pairs / tasks..(k + 1) * n_pairs / tasks).collect();
        let added = if tasks == 1 {
            vec![self.sum(rows, (0..n_pairs, &mut sums.cells))]
        } else {
            let cells = &sums.cells;
            let task = |pairs: &Range<usize>| {
                let mut own: Vec<Cell> = cells.chunks_exact(n_pairs).flat_map(|all| &all[pairs.clone()]).copied().collect();
                let added = self.sum(rows, (pairs.clone(), &mut own));
                (own, added)
            };
            let done: Vec<(Vec<Cell>, Added)> = shares.par_iter().map(task).collect();
            let put_back = |(pairs, (own, added)): (&Range<usize>, (Vec<Cell>, Added))| {
                for (all, own) in sums.cells.chunks_exact_mut(n_pairs).zip(own.chunks_exact(pairs.len())) {
                    all[pairs.clone()].copy_from_slice(own);
                }
                added
            };
            shares.iter().zip(done).map(put_back).collect()
        };
        let mut all =
            Added { counts: SampleCounts::default(), present: vec![false; self.n_ant], span: TimeSpan::empty(), rows: Vec::new() };
        for part in added {
            all.counts.add(part.counts);
            all.present.iter_mut().zip(part.present).for_each(|(all, part)| *all |= part);
            sums.span.unite(part.span);
            sums.rows.extend(part.rows);
        }
        all
    }

    /// Add the rows of these baselines to their sums \[group, feed, pair\].
    fn sum(&self, rows: &[usize], (pairs, cells): (Range<usize>, &mut [Cell])) -> Added {
        let n_feed = self.feeds.names.len();
        let (mut counts, mut present) = (SampleCounts::default(), vec![false; self.n_ant]);
        let (mut span, mut kept) = (TimeSpan::empty(), Vec::new());
        let mut row_cells: Vec<(u32, Cell)> = Vec::new();
        for &row in rows {
            let (a1, a2) = (self.coverage.ant1[row] as usize, self.coverage.ant2[row] as usize);
            let pair = pair_index(self.n_ant, a1.min(a2), a1.max(a2));
            if !pairs.contains(&pair) {
                continue;
            }
            let used_before = counts.used;
            row_cells.clear();
            let here = row * self.samples..(row + 1) * self.samples;
            let (vis, weights) = (&self.vis[here.clone()], &self.weights[here.clone()]);
            let (flags, model) = (&self.flags[here.clone()], &self.model[here]);
            for (i, (((v, w), flag), m)) in vis.iter().zip(weights).zip(flags).zip(model).enumerate() {
                let Some(feed) = self.feeds.of_pol[i % self.n_pol] else { continue };
                if *flag || *w <= 0.0 {
                    counts.flagged += 1;
                    continue;
                }
                let (v, m, w) = (wide(*v), wide(*m), f64::from(*w));
                if !(w.is_finite() && v.re.is_finite() && v.im.is_finite()) {
                    counts.not_finite += 1;
                    continue;
                }
                if !(m.re.is_finite() && m.im.is_finite()) {
                    counts.bad_model += 1;
                    continue;
                }
                let (v, m) = if a1 < a2 { (v, m) } else { (v.conj(), m.conj()) };
                let place = self.channels.group_of[i / self.n_pol] * n_feed + feed;
                cells[place * pairs.len() + pair - pairs.start].add(w, v, m);
                counts.used += 1;
                if self.by_row {
                    let index = (place * n_pairs(self.n_ant) + pair) as u32;
                    match row_cells.iter_mut().find(|(at, _)| *at == index) {
                        Some((_, cell)) => cell.add(w, v, m),
                        None => {
                            let mut cell = Cell::default();
                            cell.add(w, v, m);
                            row_cells.push((index, cell));
                        }
                    }
                }
            }
            kept.extend(row_cells.iter().copied());
            if counts.used > used_before {
                span.add(self.coverage.time_jd[row], self.coverage.integration_s[row]);
                present[a1] = true;
                present[a2] = true;
            }
        }
        Added { counts, present, span, rows: kept }
    }
}

fn wide(z: Complex32) -> Complex64 {
    Complex64::new(f64::from(z.re), f64::from(z.im))
}

#[cfg(test)]
mod tests {
    use super::super::{ModelVisibilities, NormalEquations, Outliers, PointModel, SolutionInterval, SolveOptions};
    use super::*;
    use crate::closure::testdata::{Scene, cis, random_phases};
    use cittert_arrays::{VisibilitySet, VisibilitySource};

    const ANTENNAS: usize = 14;

    /// The sums over all rows of a set, of which so many are added at once.
    fn sums(set: &mut VisibilitySet, rows_at_once: usize) -> NormalEquations {
        let options = SolveOptions { solint: SolutionInterval::Infinite, outliers: Outliers::Huber, ..SolveOptions::default() };
        let (header, n) = (set.header().clone(), set.n_rows());
        let mut model = PointModel { flux: 1.0, l: 1e-4, m: 0.0 };
        let mut sums = NormalEquations::new(&header, &options).unwrap();
        for first in (0..n).step_by(rows_at_once) {
            let block = set.read_rows(first..n.min(first + rows_at_once)).unwrap();
            let predicted = model.predict(&header, first, &block.coverage).unwrap();
            sums.add(&block, &predicted).unwrap();
        }
        sums
    }

    /// The bits of the sums of a cell.
    fn bits(c: &Cell) -> ([u64; 7], u32) {
        ([c.vm.re, c.vm.im, c.mm, c.vv, c.half_vm.re, c.half_vm.im, c.half_mm].map(f64::to_bits), c.n)
    }

    #[test]
    fn several_tasks_make_the_sums_of_one() {
        let scene = Scene { n_chan: 2, sigma: 0.05, seed: 3, ..Scene::point(ANTENNAS, 3 * ROWS / n_pairs(ANTENNAS) + 1) };
        let phase = random_phases(ANTENNAS, 1.0, 2);
        let mut set = scene.set(|_, a, _, _| cis(phase[a]));
        set.data.flags[(0, 0, 0)] = true;
        set.data.vis[(200, 1, 0)] = Complex32::new(f32::NAN, 0.0);
        let n = set.n_rows();
        assert!(n >= 3 * ROWS);
        let (together, apart) = (sums(&mut set, n), sums(&mut set, ROWS / 2));
        assert_eq!((together.counts, &together.present), (apart.counts, &apart.present));
        assert_eq!((together.counts.flagged, together.counts.not_finite), (1, 1));
        let of = |sums: &NormalEquations| {
            let interval = sums.intervals.values().next().unwrap();
            let mut rows: Vec<(u32, ([u64; 7], u32))> = interval.rows.iter().map(|(at, c)| (*at, bits(c))).collect();
            // The rows of a baseline keep their order.
            rows.sort_by_key(|row| row.0);
            (interval.span.ends_jd(), interval.cells.iter().map(bits).collect::<Vec<_>>(), rows)
        };
        assert_eq!(of(&together), of(&apart));
    }
}
