//! One solution interval: the antennas that can be solved, their gains, and the reason why others cannot.

use super::delay::solve_delays;
use super::least_squares::{Fit, Pairs, solve_pairs};
use super::normal_sums::Cell;
use super::options::{GainMode, Outliers, SolveOptions};
use crate::closure::pairs_of;
use num_complex::Complex64;

/// Why an antenna has no gain in an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FlagReason {
    /// None of its baselines has usable data.
    NoData,
    /// It has fewer baselines than required.
    FewBaselines,
    /// Not connected to the largest group of antennas.
    Disconnected,
    /// Its signal to noise ratio is below the limit.
    LowSnr,
    /// The data do not determine its gain separately from those of other antennas.
    Singular,
}

impl FlagReason {
    /// In words, for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoData => "no data",
            Self::FewBaselines => "too few baselines",
            Self::Disconnected => "not connected to the others",
            Self::LowSnr => "low signal to noise",
            Self::Singular => "not separable from other antennas",
        }
    }
}

/// The solution of one interval, up to a common phase. In delay mode there is one gain for each channel, otherwise one.
#[derive(Debug, Clone)]
pub(crate) struct AntennaFit {
    /// \[chan\]\[ant\]; 1 where flagged.
    pub(crate) gains: Vec<Vec<Complex64>>,
    /// `None` where the antenna is solved \[ant\].
    pub(crate) flagged: Vec<Option<FlagReason>>,
    /// \[ant\].
    pub(crate) snr: Vec<f64>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    pub(crate) condition: f64,
    pub(crate) chi2: f64,
    /// Number of real data minus number of unknowns.
    pub(crate) freedom: f64,
}

/// The sums of one row in a channel.
pub(crate) struct RowSums {
    pub(crate) chan: usize,
    pub(crate) pair: usize,
    pub(crate) cell: Cell,
}

/// Sums of an interval: cells \[chan\]\[pair\]. With robust weights, the sums of each row too.
pub(crate) struct IntervalData<'a> {
    pub(crate) n_ant: usize,
    pub(crate) cells: Vec<&'a [Cell]>,
    pub(crate) rows: Vec<RowSums>,
    /// Channel centres, used in delay mode.
    pub(crate) freq_hz: &'a [f64],
}

impl IntervalData<'_> {
    fn pairs(&self) -> Vec<Pairs> {
        let one = |cells: &&[Cell]| {
            let mut p = Pairs::new(self.n_ant);
            for ((a, b), c) in pairs_of(self.n_ant).zip(cells.iter()).filter(|(_, c)| c.mm > 0.0) {
                p.add(a, b, c.vm, c.mm);
            }
            p
        };
        self.cells.iter().map(one).collect()
    }

    fn weighted_pairs(&self, weights: &[f64], ends: &[(usize, usize)]) -> Vec<Pairs> {
        let mut pairs = vec![Pairs::new(self.n_ant); self.cells.len()];
        for (row, w) in self.rows.iter().zip(weights).filter(|(row, _)| row.cell.mm > 0.0) {
            let (p, q) = ends[row.pair];
            pairs[row.chan].add(p, q, row.cell.vm * *w, row.cell.mm * w);
        }
        pairs
    }
}

/// Reduced chi squared below which weights cannot be 1/sigma^2. With 30 degrees of freedom the noise gives such a value less than once in
/// 10^9 intervals.
const NO_SCALE: f64 = 0.1;

/// Solve an interval; `needed` is the number of baselines an antenna must have.
pub(crate) fn solve_interval(data: &IntervalData<'_>, options: &SolveOptions, needed: usize) -> AntennaFit {
    let n = data.n_ant;
    let least = if options.mode == GainMode::AmpPhase { 3 } else { 2 };
    let mut pairs = data.pairs();
    let mut out = AntennaFit {
        gains: vec![vec![Complex64::new(1.0, 0.0); n]; pairs.len()],
        flagged: vec![None; n],
        snr: vec![0.0; n],
        iterations: 0,
        converged: false,
        condition: f64::INFINITY,
        chi2: 0.0,
        freedom: 0.0,
    };
    loop {
        prune(&pairs, &mut out.flagged, needed);
        let active: Vec<usize> = (0..n).filter(|p| out.flagged[*p].is_none()).collect();
        if active.len() < least {
            active.iter().for_each(|p| out.flagged[*p] = Some(FlagReason::FewBaselines));
            return out;
        }
        let Some((gains, fit)) = solve_active(data, &mut pairs, &active, options) else {
            active.iter().for_each(|p| out.flagged[*p] = Some(FlagReason::Singular));
            return out;
        };
        (out.iterations, out.converged, out.condition) = (fit.iterations, fit.converged, fit.condition);
        (out.chi2, out.freedom) = misfit(data, &active, &gains, options.mode);
        // If the residuals are far below the noise of the weights, the weights have no scale. A signal to noise ratio from them has no
        // meaning.
        let no_scale = out.freedom >= 30.0 && out.chi2 > 0.0 && out.chi2 < NO_SCALE * out.freedom;
        let from_residuals = (options.noise_from_residuals || no_scale) && out.freedom > 0.0 && out.chi2 > 0.0;
        let scale = if from_residuals { (out.chi2 / out.freedom).sqrt() } else { 1.0 };
        let mut lost = false;
        let subsets: Vec<Pairs> = pairs.iter().map(|c| c.subset(&active)).collect();
        for (i, &p) in active.iter().enumerate() {
            // Each channel is a matched filter. Together their signal to noise grows with the root of their number.
            let each: Vec<f64> = subsets.iter().zip(&gains).map(|(c, g)| c.snr(i, g)).collect();
            out.snr[p] = each.iter().sum::<f64>() / (each.len() as f64).sqrt() / scale;
            if !(out.snr[p] >= options.min_snr) {
                out.flagged[p] = Some(FlagReason::LowSnr);
                lost = true;
            }
        }
        if !lost {
            for (all, g) in out.gains.iter_mut().zip(&gains) {
                active.iter().zip(g).for_each(|(p, g)| all[*p] = *g);
            }
            return out;
        }
    }
}

/// Gains \[chan\]\[active\] of the active antennas, with robust weights if the options select them.
fn solve_active(
    data: &IntervalData<'_>,
    pairs: &mut Vec<Pairs>,
    active: &[usize],
    options: &SolveOptions,
) -> Option<(Vec<Vec<Complex64>>, Fit)> {
    let once = |pairs: &[Pairs]| {
        let subsets: Vec<Pairs> = pairs.iter().map(|p| p.subset(active)).collect();
        if options.mode == GainMode::Delay {
            return solve_delays(&subsets, data.freq_hz, options.max_iterations, options.tolerance);
        }
        let fit = solve_pairs(subsets.first()?, options.mode == GainMode::AmpPhase, options.max_iterations, options.tolerance)?;
        Some((vec![fit.gains.clone()], fit))
    };
    if options.outliers == Outliers::None {
        return once(pairs);
    }
    *pairs = data.pairs();
    let mut result = once(pairs)?;
    let ends: Vec<(usize, usize)> = pairs_of(data.n_ant).collect();
    let mut place = vec![usize::MAX; data.n_ant];
    active.iter().enumerate().for_each(|(i, p)| place[*p] = i);
    let mut weights = vec![1.0; data.rows.len()];
    for _ in 0..50 {
        let chi2: Vec<Option<f64>> = data
            .rows
            .iter()
            .map(|row| {
                let (p, q) = (place[ends[row.pair].0], place[ends[row.pair].1]);
                let gains = &result.0[row.chan];
                (p != usize::MAX && q != usize::MAX).then(|| row.cell.chi2(gains[p] * gains[q].conj()))
            })
            .collect();
        let scale = if options.noise_from_residuals { typical_scale(data, &chi2) } else { 1.0 };
        let mut change = 0.0_f64;
        for ((w, chi2), row) in weights.iter_mut().zip(&chi2).zip(&data.rows) {
            let Some(chi2) = chi2 else { continue };
            let new = robust_weight(options, chi2 / scale, f64::from(row.cell.n));
            change = change.max((new - *w).abs());
            *w = new;
        }
        *pairs = data.weighted_pairs(&weights, &ends);
        result = once(pairs)?;
        if change < 1e-4 {
            break;
        }
    }
    Some(result)
}

/// Weight of `n` complex samples whose residuals sum to `chi2`.
fn robust_weight(options: &SolveOptions, chi2: f64, n: f64) -> f64 {
    let scale = options.outlier_scale;
    match options.outliers {
        Outliers::None => 1.0,
        Outliers::Student => (scale + 2.0 * n) / (scale + chi2),
        Outliers::Huber => {
            let r = (chi2 / (2.0 * n)).sqrt();
            if r > scale { scale / r } else { 1.0 }
        }
    }
}

/// Median over the rows of chi^2 per real datum. It is a scale of the noise that outliers do not change.
fn typical_scale(data: &IntervalData<'_>, chi2: &[Option<f64>]) -> f64 {
    let mut ratios: Vec<f64> = chi2.iter().zip(&data.rows).filter_map(|(x, row)| x.map(|x| x / (2.0 * f64::from(row.cell.n)))).collect();
    if ratios.is_empty() {
        return 1.0;
    }
    let middle = ratios.len() / 2;
    let (_, median, _) = ratios.select_nth_unstable_by(middle, f64::total_cmp);
    if *median > 0.0 { *median } else { 1.0 }
}

/// chi^2 of the baselines between solved antennas, and its degrees of freedom.
fn misfit(data: &IntervalData<'_>, active: &[usize], gains: &[Vec<Complex64>], mode: GainMode) -> (f64, f64) {
    let mut place = vec![usize::MAX; data.n_ant];
    active.iter().enumerate().for_each(|(i, p)| place[*p] = i);
    let (mut chi2, mut samples) = (0.0, 0.0);
    for (cells, g) in data.cells.iter().zip(gains) {
        for ((p, q), c) in pairs_of(data.n_ant).zip(cells.iter()).filter(|(_, c)| c.n > 0) {
            let (p, q) = (place[p], place[q]);
            if p != usize::MAX && q != usize::MAX {
                chi2 += c.chi2(g[p] * g[q].conj());
                samples += f64::from(c.n);
            }
        }
    }
    let n = active.len() as f64;
    let unknowns = match mode {
        GainMode::Phase => n - 1.0,
        GainMode::AmpPhase => 2.0 * n - 1.0,
        GainMode::Delay => 2.0 * n - 2.0,
    };
    (chi2, 2.0 * samples - unknowns)
}

/// Flag antennas without data, then repeatedly those with too few baselines to the rest, then all outside the largest connected group.
pub(crate) fn prune(pairs: &[Pairs], flagged: &mut [Option<FlagReason>], needed: usize) {
    let n = flagged.len();
    let linked: Vec<bool> = (0..n * n).map(|i| pairs.iter().any(|c| c.measured(i / n, i % n))).collect();
    for p in 0..n {
        if flagged[p].is_none() && !(0..n).any(|q| linked[p * n + q]) {
            flagged[p] = Some(FlagReason::NoData);
        }
    }
    loop {
        let few: Vec<usize> = (0..n)
            .filter(|&p| flagged[p].is_none() && (0..n).filter(|&q| flagged[q].is_none() && linked[p * n + q]).count() < needed)
            .collect();
        if few.is_empty() {
            break;
        }
        few.iter().for_each(|p| flagged[*p] = Some(FlagReason::FewBaselines));
    }
    let mut largest: Vec<usize> = Vec::new();
    let mut seen = vec![false; n];
    for start in 0..n {
        if flagged[start].is_some() || seen[start] {
            continue;
        }
        let mut group = vec![start];
        seen[start] = true;
        let mut next = 0;
        while next < group.len() {
            let p = group[next];
            next += 1;
            for q in 0..n {
                if flagged[q].is_none() && !seen[q] && linked[p * n + q] {
                    seen[q] = true;
                    group.push(q);
                }
            }
        }
        if group.len() > largest.len() {
            largest = group;
        }
    }
    for p in (0..n).filter(|p| seen[*p] && !largest.contains(p)) {
        flagged[p] = Some(FlagReason::Disconnected);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linked(n: usize, links: impl Fn(usize, usize) -> bool) -> Pairs {
        let mut pairs = Pairs::new(n);
        for (p, q) in pairs_of(n).filter(|(p, q)| links(*p, *q)) {
            pairs.add(p, q, Complex64::new(1.0, 0.0), 1.0);
        }
        pairs
    }

    #[test]
    fn pruning_goes_on_until_all_that_are_left_have_their_baselines() {
        // Five antennas are all linked with each other. Antenna 5 is linked with three of them, antenna 6 with two and with antenna 5.
        // Antenna 7 has no data.
        let pairs = linked(8, |p, q| q < 5 || (q == 5 && p < 3) || (q == 6 && (p < 2 || p == 5)));
        let mut flagged = vec![None; 8];
        prune(&[pairs], &mut flagged, 4);
        assert_eq!(flagged[..5], [None; 5]);
        assert_eq!(flagged[5..], [Some(FlagReason::FewBaselines), Some(FlagReason::FewBaselines), Some(FlagReason::NoData)]);
    }

    #[test]
    fn the_smaller_of_two_separate_groups_is_flagged() {
        let mut flagged = vec![None; 9];
        prune(&[linked(9, |p, q| (p < 4) == (q < 4))], &mut flagged, 2);
        assert_eq!(flagged[..4], [Some(FlagReason::Disconnected); 4]);
        assert_eq!(flagged[4..], [None; 5]);
    }

    #[test]
    fn outliers_lose_weight_and_good_samples_keep_it() {
        let student = SolveOptions { outliers: Outliers::Student, ..SolveOptions::default() };
        let huber = SolveOptions { outliers: Outliers::Huber, outlier_scale: 2.0, ..SolveOptions::default() };
        assert!((robust_weight(&student, 2.0, 1.0) - 1.0).abs() < 1e-15);
        assert!(robust_weight(&student, 500.0, 1.0) < 0.01);
        assert_eq!(robust_weight(&huber, 2.0, 1.0), 1.0);
        assert!((robust_weight(&huber, 200.0, 1.0) - 0.2).abs() < 1e-15);
    }
}
