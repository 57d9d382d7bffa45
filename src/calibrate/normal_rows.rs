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
