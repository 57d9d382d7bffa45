//! Equal baselines: how many different ones a layout has, and how this number changes by an exchange.

use std::collections::HashMap;

/// Baselines within a tolerance of each other are equal; a baseline and its opposite are one. The number counts the groups that are found when
/// baselines are taken in the order of the elements, as the figures of a layout do.
#[must_use]
pub(super) fn unique_baselines(xy: &[[f64; 2]], tolerance: f64) -> usize {
    let mut groups = Groups::new(tolerance);
    let pairs = xy.iter().enumerate().flat_map(|(i, a)| xy[i + 1..].iter().map(move |b| [b[0] - a[0], b[1] - a[1]]));
    for d in pairs {
        groups.of(d);
    }
    groups.count
}

/// Groups of equal baselines, found as they come.
struct Groups {
    tolerance: f64,
    cells: HashMap<[i64; 2], Vec<([f64; 2], usize)>>,
    count: usize,
}

impl Groups {
    fn new(tolerance: f64) -> Self {
        Self { tolerance, cells: HashMap::new(), count: 0 }
    }

    /// The group of a baseline.
    fn of(&mut self, d: [f64; 2]) -> usize {
        let key = |d: [f64; 2]| d.map(|v| (v / (2.0 * self.tolerance)).floor() as i64);
        for d in [d, d.map(|v| -v)] {
            let [x, y] = key(d);
            for cell in [-1, 0, 1].into_iter().flat_map(|i| [-1, 0, 1].map(|j| [x + i, y + j])) {
                let near = |(o, _): &&([f64; 2], usize)| (o[0] - d[0]).hypot(o[1] - d[1]) <= self.tolerance;
                if let Some((_, group)) = self.cells.get(&cell).and_then(|c| c.iter().find(near)) {
                    return *group;
                }
            }
        }
        self.count += 1;
        let group = self.count - 1;
        self.cells.entry(key(d)).or_default().push((d, group));
        group
    }
}

/// The baselines of a choice among pads.
pub(super) struct BaselineCounts {
    /// Group of the baseline of two pads \[pad\]\[pad\].
    group: Vec<Vec<u32>>,
    /// Number of chosen pairs in each group.
    counts: Vec<u32>,
    unique: usize,
    pairs: usize,
    weight: f64,
    /// Groups that an exchange has touched.
    touched: Vec<(u32, bool)>,
}

impl BaselineCounts {
    /// For these pads. The score is weight times the share of the baselines that repeat another.
    pub(super) fn new(pads: &[[f64; 2]], tolerance: f64, weight: f64) -> Self {
        let mut groups = Groups::new(tolerance);
        let mut group = vec![vec![0; pads.len()]; pads.len()];
        for i in 0..pads.len() {
            for j in i + 1..pads.len() {
                let g = groups.of([pads[j][0] - pads[i][0], pads[j][1] - pads[i][1]]) as u32;
                (group[i][j], group[j][i]) = (g, g);
            }
        }
        Self { group, counts: vec![0; groups.count], unique: 0, pairs: 1, weight, touched: Vec::new() }
    }

    fn score(&self, unique: usize) -> f64 {
        self.weight * (1.0 - unique as f64 / self.pairs as f64)
    }

    /// Count the baselines of a choice.
    pub(super) fn set(&mut self, chosen: &[usize]) {
        self.counts.fill(0);
        for (k, i) in chosen.iter().enumerate() {
            chosen[k + 1..].iter().for_each(|j| self.counts[self.group[*i][*j] as usize] += 1);
        }
        self.unique = self.counts.iter().filter(|c| **c > 0).count();
        self.pairs = (chosen.len() * (chosen.len() - 1) / 2).max(1);
    }

    /// The score of the choice that was set, with one pad replaced.
    pub(super) fn after(&mut self, chosen: &[usize], slot: usize, pad: usize) -> f64 {
        let out = chosen[slot];
        if out == pad {
            return self.score(self.unique);
        }
        let mut unique = self.unique as i64;
        self.touched.clear();
        let others = || chosen.iter().enumerate().filter(|(k, _)| *k != slot).map(|(_, c)| *c);
        for other in others() {
            let g = self.group[out][other];
            self.counts[g as usize] -= 1;
            unique -= i64::from(self.counts[g as usize] == 0);
            self.touched.push((g, false));
        }
        for other in others() {
            let g = self.group[pad][other];
            unique += i64::from(self.counts[g as usize] == 0);
            self.counts[g as usize] += 1;
            self.touched.push((g, true));
        }
        for (g, added) in &self.touched {
            let count = &mut self.counts[*g as usize];
            *count = if *added { *count - 1 } else { *count + 1 };
        }
        self.score(unique as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_after_an_exchange_are_those_of_the_new_choice() {
        let pads: Vec<[f64; 2]> = (0..12).map(|k| [f64::from(k % 4), f64::from(k / 4)]).collect();
        let mut counts = BaselineCounts::new(&pads, 0.01, 1.0);
        let chosen = [0, 3, 5, 10, 11];
        counts.set(&chosen);
        for (slot, pad) in [(0, 7), (2, 1), (4, 9), (3, 10)] {
            let mut other = chosen;
            other[slot] = pad;
            let xy: Vec<[f64; 2]> = other.iter().map(|k| pads[*k]).collect();
            let truth = 1.0 - unique_baselines(&xy, 0.01) as f64 / 10.0;
            assert!((counts.after(&chosen, slot, pad) - truth).abs() < 1e-15, "{slot} {pad}");
        }
    }

    #[test]
    fn a_square_has_four_different_baselines() {
        assert_eq!(unique_baselines(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 1e-3), 4);
        // The edge of a cell lies between two equal baselines.
        assert_eq!(unique_baselines(&[[0.0, 0.0], [0.2 - 1e-4, 0.0], [10.0, 0.0], [10.2 + 1e-4, 0.0]], 0.05), 4);
    }
}
