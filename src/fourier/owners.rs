//! Which process holds which rows of tiles, where several processes grid visibilities while they read them.
//!
//! Most arrays have far more short baselines than long ones: the first rows of tiles, at small v, have most of the visibilities. Each process therefore gets two or three
//! runs of rows of tiles, near v = 0 and far from it, so that all have about as many rows, which is memory, and as much work, which is time.

use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::Real;
use cittert_arrays::Ranks;
use std::cmp::Reverse;
use std::ops::Range;

/// The process that holds each row of tiles.
#[derive(Debug, Clone)]
pub(super) struct Owners {
    /// None where each process holds a copy of its own.
    of: Vec<Option<usize>>,
    /// The rows of tiles around each that this process gives to the same one.
    runs: Vec<Range<usize>>,
    /// The number of this process, and how many there are.
    place: (usize, usize),
}

impl Owners {
    /// The owners for rows of tiles with so much work of all processes. `None` where visibilities alias over the edge of the grid.
    pub(super) fn new<T: Real>(plan: &Plan<T>, work: &[f64], ranks: &dyn Ranks) -> Option<Self> {
        // The tiles at the end of the grid would reach over its edge into the first ones.
        let alias = plan.tiles_v() * TILE + plan.table.support > plan.nv;
        (!alias).then(|| Self::of_tiles(shared(work, ranks.size()), (ranks.rank(), ranks.size())))
    }

    /// Those of tiles whose owners are known.
    pub(super) fn of_tiles(of: Vec<Option<usize>>, place: (usize, usize)) -> Self {
        let mut runs = Vec::with_capacity(of.len());
        for same in of.chunk_by(|a, b| a.unwrap_or(place.0) == b.unwrap_or(place.0)) {
            let first = runs.len();
            runs.extend(std::iter::repeat_n(first..first + same.len(), same.len()));
        }
        Self { of, runs, place }
    }

    /// The rows of tiles around one that go to the same process.
    pub(super) fn run(&self, tile_v: usize) -> Range<usize> {
        self.runs.get(tile_v).cloned().unwrap_or(tile_v..tile_v + 1)
    }

    /// The process that grids what this one has read of a row of tiles.
    pub(super) fn of(&self, tile_v: usize) -> usize {
        self.of.get(tile_v).copied().flatten().unwrap_or(self.place.0)
    }

    /// Whether a process grids into a row of tiles.
    fn has(&self, process: usize, tile_v: usize) -> bool {
        self.of.get(tile_v).is_some_and(|of| of.is_none_or(|owner| owner == process))
    }

    pub(super) fn rank(&self) -> usize {
        self.place.0
    }

    pub(super) fn size(&self) -> usize {
        self.place.1
    }

    /// The stripes of which a process holds rows, and how many of each. The tiles of a row reach over as many rows of the next stripe as the kernel covers.
    pub(super) fn held(&self, support: usize, process: usize) -> Vec<(usize, usize)> {
        let rows = |s: usize| match (self.has(process, s), s > 0 && self.has(process, s - 1)) {
            (true, _) => TILE,
            (false, true) => support.min(TILE),
            _ => 0,
        };
        (0..self.of.len()).map(|s| (s, rows(s))).filter(|(_, rows)| *rows > 0).collect()
    }

    /// Most rows of the grid that a process holds.
    pub(super) fn most_rows(&self, support: usize) -> usize {
        let of = |process: usize| self.held(support, process).iter().map(|(_, rows)| rows).sum::<usize>();
        (0..self.size()).map(of).max().unwrap_or(0)
    }

    /// The work of the busiest process, over its fair share.
    pub(super) fn busiest(&self, work: &[f64]) -> f64 {
        let (mut of_each, all) = (vec![0.0; self.size()], work.iter().sum::<f64>());
        for (own, of) in work.iter().zip(&self.of) {
            match of {
                Some(process) => of_each[*process] += own,
                None => of_each.iter_mut().for_each(|sum| *sum += own / self.size() as f64),
            }
        }
        if all > 0.0 { of_each.into_iter().fold(0.0, f64::max) * self.size() as f64 / all } else { 1.0 }
    }
}

/// Runs of rows of tiles that a process has, at most.
const MOST_RUNS: usize = 3;

/// Part of all rows of tiles that every process may grid.
const CROWDED: usize = 8;

/// The owners of rows of tiles with so much work. A row with more than the fair share of a process is not given to one, because the others would wait for it: each
/// process grids its own nodes of it. These are an eighth of all rows at most, or as many as a process has others.
pub(super) fn shared(work: &[f64], processes: usize) -> Vec<Option<usize>> {
    let fair = work.iter().sum::<f64>() / processes as f64;
    let mut crowded: Vec<usize> = (0..work.len()).filter(|s| processes > 1 && work[*s] > fair).collect();
    crowded.sort_by(|a, b| work[*b].total_cmp(&work[*a]));
    crowded.truncate((work.len() / processes).max(work.len() / CROWDED));
    let rest: Vec<usize> = (0..work.len()).filter(|s| !crowded.contains(s)).collect();
    let of_rest: Vec<f64> = rest.iter().map(|s| work[*s]).collect();
    let mut all = vec![None; work.len()];
    rest.into_iter().zip(in_few_runs(&of_rest, processes)).for_each(|(s, owner)| all[s] = Some(owner));
    all
}

/// The owners of rows of tiles with so much work, each of which has a few runs of them, and as many rows as the others or one less. Of all ways to divide the
/// rows into near ones, which are cut into runs of equal work, and far ones, which fill up, that with the least work of the busiest process is taken, and rows are exchanged.
fn in_few_runs(work: &[f64], processes: usize) -> Vec<usize> {
    let n = work.len();
    let sizes: Vec<usize> = (0..processes).map(|k| n * (k + 1) / processes - n * k / processes).collect();
    let mut sums = vec![0.0; n + 1];
    work.iter().enumerate().for_each(|(s, own)| sums[s + 1] = sums[s] + own);
    let mut best: Option<(f64, Vec<usize>)> = None;
    for near in 0..=n {
        let Some(runs) = near_runs(&sums[..=near], &sizes) else { continue };
        // The longest of the far runs lie near, where most work is, or at the far end.
        for longest_first in [true, false] {
            let mut order: Vec<usize> = (0..processes).collect();
            let far = |k: usize| sizes[k] - runs[k];
            order.sort_by_key(|k| if longest_first { (Reverse(far(*k)), 0) } else { (Reverse(0), far(*k)) });
            let mut owners: Vec<usize> = (0..processes).flat_map(|k| std::iter::repeat_n(k, runs[k])).collect();
            owners.extend(order.iter().flat_map(|k| std::iter::repeat_n(*k, far(*k))));
            let mut of_each = vec![0.0; processes];
            owners.iter().zip(work).for_each(|(owner, own)| of_each[*owner] += own);
            let most = of_each.into_iter().fold(0.0, f64::max);
            if best.as_ref().is_none_or(|(least, _)| most < *least) {
                best = Some((most, owners));
            }
        }
    }
    let mut owners = best.map(|(_, owners)| owners).unwrap_or_default();
    even_out(&mut owners, work, processes);
    owners
}

/// Exchange rows of tiles between the busiest process and others as long as the work of the two gets less for the one that then has more, and neither has more than
/// [`MOST_RUNS`] runs.
fn even_out(owners: &mut [usize], work: &[f64], processes: usize) {
    let runs = |owners: &[usize], process: usize| owners.chunk_by(|a, b| a == b).filter(|run| run[0] == process).count();
    let mut of_each = vec![0.0; processes];
    owners.iter().zip(work).for_each(|(owner, own)| of_each[*owner] += own);
    for _ in 0..owners.len() {
        let Some(busiest) = (0..processes).max_by(|a, b| of_each[*a].total_cmp(&of_each[*b])) else { return };
        let own = (0..owners.len()).filter(|s| owners[*s] == busiest);
        let pairs = own.flat_map(|a| (0..work.len()).map(move |b| (a, b))).filter(|(a, b)| work[*b] < work[*a] && owners[*b] != busiest);
        let after = |(a, b): (usize, usize)| {
            let moved = work[a] - work[b];
            (of_each[busiest] - moved).max(of_each[owners[b]] + moved)
        };
        let mut better: Vec<(f64, (usize, usize))> =
            pairs.map(|pair| (after(pair), pair)).filter(|(most, _)| *most < of_each[busiest]).collect();
        better.sort_by(|a, b| a.0.total_cmp(&b.0));
        let done = better.into_iter().find(|(_, (a, b))| {
            let other = owners[*b];
            owners.swap(*a, *b);
            let kept = [busiest, other].into_iter().all(|process| runs(owners, process) <= MOST_RUNS);
            if !kept {
                owners.swap(*a, *b);
            }
            kept
        });
        let Some((_, (a, b))) = done else { return };
        // Their owners are exchanged.
        let moved = work[a] - work[b];
        of_each[busiest] -= moved;
        of_each[owners[a]] += moved;
    }
}

/// The lengths of runs of about the same work, one for each process. `sums` are those up to each row of tiles. `None` where a run is longer than the
/// rows that its process may have.
fn near_runs(sums: &[f64], sizes: &[usize]) -> Option<Vec<usize>> {
    let (near, all) = (sums.len() - 1, sums[sums.len() - 1]);
    let mut first = 0;
    let mut runs = Vec::with_capacity(sizes.len());
    for (k, size) in sizes.iter().enumerate() {
        let wanted = all * (k + 1) as f64 / sizes.len() as f64;
        let end = if k + 1 == sizes.len() {
            near
        } else {
            let above = first + sums[first..=near].partition_point(|sum| *sum < wanted).min(near - first);
            // The boundary that lies nearer to the wanted sum.
            if above > first && wanted - sums[above - 1] < sums[above] - wanted { above - 1 } else { above }
        };
        runs.push(end - first);
        if end - first > *size {
            return None;
        }
        first = end;
    }
    Some(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Noise;

    fn loads(nodes: &[f64], owners: &[Option<usize>], processes: usize) -> (Vec<f64>, Vec<usize>) {
        let (mut load, mut rows) = (vec![0.0; processes], vec![0; processes]);
        for (own, owner) in nodes.iter().zip(owners) {
            match owner {
                Some(k) => (load[*k], rows[*k]) = (load[*k] + own, rows[*k] + 1),
                None => {
                    load.iter_mut().zip(&mut rows).for_each(|(load, rows)| (*load, *rows) = (*load + own / processes as f64, *rows + 1))
                }
            }
        }
        (load, rows)
    }

    /// Arrays with many short baselines, or with as many of each length: rows and nodes are shared evenly.
    #[test]
    fn processes_have_as_many_rows_and_about_as_many_nodes() {
        let mut noise = Noise(20);
        let mut between = |low: f64, high: f64| low + (high - low) * 0.5 * (noise.next() + 1.0);
        for case in 0..200 {
            let (n, processes) = (between(30.0, 400.0) as usize, between(2.0, 9.0) as usize);
            let steep = between(0.0, 4.0);
            let nodes: Vec<f64> = (0..n).map(|s| (-steep * s as f64 / n as f64).exp() * between(0.9, 1.1)).collect();
            let owners = shared(&nodes, processes);
            let (load, rows) = loads(&nodes, &owners, processes);
            let fair = nodes.iter().sum::<f64>() / processes as f64;
            let largest = nodes.iter().copied().fold(0.0, f64::max);
            assert!(owners.iter().all(Option::is_some), "{case}");
            assert!(rows.iter().max().unwrap() - rows.iter().min().unwrap() <= 1, "{case}: {rows:?}");
            assert!(load.iter().all(|own| *own < fair + largest), "{case}: {load:?} of {fair}, {largest}");
        }
    }

    /// A row of tiles with more than the share of a process is gridded by all, and so is an eighth of the rows at most.
    #[test]
    fn crowded_rows_are_gridded_by_all_processes() {
        let mut nodes = vec![1.0; 40];
        nodes[0] = 100.0;
        let owners = shared(&nodes, 4);
        assert_eq!(owners.iter().filter(|o| o.is_none()).count(), 1);
        assert!(owners[0].is_none());
        nodes[..30].fill(1e4);
        let (_, rows) = loads(&nodes, &shared(&nodes, 20), 20);
        assert!(rows.iter().all(|n| *n <= 5 + 2), "{rows:?}");
        assert!(shared(&nodes, 1).iter().all(|o| *o == Some(0)));
        // More processes than rows.
        let (_, rows) = loads(&[1.0; 3], &shared(&[1.0; 3], 7), 7);
        assert_eq!(rows.iter().sum::<usize>(), 3);
        assert_eq!(shared(&[], 3), []);
    }
}
