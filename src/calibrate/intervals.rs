//! How rows, channels and polarisations are grouped into solutions.

use super::options::{ChannelGroups, FeedGroups, SolutionInterval};
use crate::{ChainError, Result};
use cittert_arrays::{Polarization, SpectralWindow, VisibilityHeader};

const DAY_S: f64 = 86_400.0;

/// Number of pairs of `n` antennas.
pub(crate) fn n_pairs(n: usize) -> usize {
    n * n.saturating_sub(1) / 2
}

/// Index of the pair p < q among the pairs of `n` antennas.
pub(crate) fn pair_index(n: usize, p: usize, q: usize) -> usize {
    p * (2 * n - p - 1) / 2 + q - p - 1
}

/// All pairs p < q of `n` antennas, in the order of [`pair_index`].
pub(crate) fn pairs_of(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |p| (p + 1..n).map(move |q| (p, q)))
}

/// Numbers the intervals of time; the first row that is asked for fixes the start.
#[derive(Debug, Clone)]
pub(crate) struct TimeBins {
    solint: SolutionInterval,
    start_jd: Option<f64>,
}

impl TimeBins {
    pub(crate) fn new(solint: SolutionInterval) -> Self {
        Self { solint, start_jd: None }
    }

    /// Number of the interval of an integration; numbers grow with time and may be negative.
    ///
    /// # Errors
    /// A time that is not finite, an interval shorter than the integration.
    pub(crate) fn key(&mut self, time_jd: f64, integration_s: f64) -> Result<i64> {
        if !time_jd.is_finite() {
            return Err(ChainError::NoData(format!("a row has the time {time_jd}: repair or remove it before calibrating")));
        }
        let span = if integration_s.is_finite() { integration_s.max(0.0) } else { 0.0 };
        match self.solint {
            SolutionInterval::Infinite => Ok(0),
            SolutionInterval::Integration => {
                let start = *self.start_jd.get_or_insert(time_jd);
                // A Julian date resolves about 0.04 ms.
                Ok(((time_jd - start) * DAY_S * 1e3).round() as i64)
            }
            SolutionInterval::Seconds(s) => {
                if s < span * 0.999 {
                    return Err(ChainError::BadOption {
                        option: "solint",
                        value: format!("{s} s"),
                        expected: format!("at least one integration, {span} s"),
                    });
                }
                let start = *self.start_jd.get_or_insert(time_jd - span / 2.0 / DAY_S);
                Ok(((time_jd - start) * DAY_S / s + 1e-6).floor() as i64)
            }
        }
    }
}

/// The time that the data of an interval span.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimeSpan {
    first_jd: f64,
    last_jd: f64,
}

impl TimeSpan {
    pub(crate) fn empty() -> Self {
        Self { first_jd: f64::INFINITY, last_jd: f64::NEG_INFINITY }
    }

    pub(crate) fn add(&mut self, time_jd: f64, integration_s: f64) {
        let half = if integration_s.is_finite() { integration_s.max(0.0) / 2.0 / DAY_S } else { 0.0 };
        self.first_jd = self.first_jd.min(time_jd - half);
        self.last_jd = self.last_jd.max(time_jd + half);
    }

    /// Middle, Julian date.
    pub(crate) fn middle_jd(&self) -> f64 {
        self.first_jd + (self.last_jd - self.first_jd) / 2.0
    }

    /// Length, s.
    pub(crate) fn length_s(&self) -> f64 {
        (self.last_jd - self.first_jd) * DAY_S
    }
}

/// Which group each channel belongs to, and the band of each group.
#[derive(Debug, Clone)]
pub(crate) struct ChannelPlan {
    pub(crate) group_of: Vec<usize>,
    pub(crate) spectrum: SpectralWindow,
}

impl ChannelPlan {
    pub(crate) fn new(spectrum: &SpectralWindow, groups: ChannelGroups) -> Result<Self> {
        let n = spectrum.n_chan();
        match groups {
            ChannelGroups::Channel => Ok(Self { group_of: (0..n).collect(), spectrum: spectrum.clone() }),
            ChannelGroups::Band => Self::merged(spectrum, vec![0; n], vec![0]),
            ChannelGroups::Window => {
                let mut windows: Vec<u32> = Vec::new();
                let group_of = spectrum
                    .spw()
                    .iter()
                    .map(|w| {
                        windows.iter().position(|x| x == w).unwrap_or_else(|| {
                            windows.push(*w);
                            windows.len() - 1
                        })
                    })
                    .collect();
                Self::merged(spectrum, group_of, windows)
            }
        }
    }

    fn merged(spectrum: &SpectralWindow, group_of: Vec<usize>, windows: Vec<u32>) -> Result<Self> {
        let mut edges = vec![(f64::INFINITY, 0.0_f64); windows.len()];
        for ((g, f), w) in group_of.iter().zip(spectrum.freq_hz()).zip(spectrum.width_hz()) {
            edges[*g] = (edges[*g].0.min(f - w / 2.0), edges[*g].1.max(f + w / 2.0));
        }
        let centers = edges.iter().map(|(lo, hi)| (lo + hi) / 2.0).collect();
        let widths = edges.iter().map(|(lo, hi)| hi - lo).collect();
        Ok(Self { group_of, spectrum: SpectralWindow::with_windows(centers, widths, windows)? })
    }

    pub(crate) fn n_groups(&self) -> usize {
        self.spectrum.n_chan()
    }
}

/// Which feed each polarisation product measures; cross hands and Stokes Q, U, V measure none.
#[derive(Debug, Clone)]
pub(crate) struct FeedPlan {
    pub(crate) names: Vec<String>,
    pub(crate) of_pol: Vec<Option<usize>>,
}

impl FeedPlan {
    pub(crate) fn new(header: &VisibilityHeader, groups: FeedGroups) -> Result<Self> {
        let pols = &header.polarizations;
        let parallel = |p: &Polarization| p.is_parallel_hand() || *p == Polarization::I;
        if !pols.iter().any(parallel) {
            let names: Vec<&str> = pols.iter().map(|p| p.name()).collect();
            return Err(ChainError::NoData(format!("no parallel hand or Stokes I to solve on: the set has {}", names.join(", "))));
        }
        if groups == FeedGroups::Joined || pols.contains(&Polarization::I) {
            return Ok(Self {
                names: vec![Polarization::shared_feed(pols).into()],
                of_pol: pols.iter().map(|p| parallel(p).then_some(0)).collect(),
            });
        }
        // One feed for each parallel hand that is there, first feed first.
        let mut hands: Vec<Polarization> = pols.iter().copied().filter(|p| p.is_parallel_hand()).collect();
        hands.sort_by_key(|p| p.feeds());
        hands.dedup();
        let names = hands.iter().map(|p| p.name()[..1].to_owned()).collect();
        Ok(Self { names, of_pol: pols.iter().map(|p| hands.iter().position(|h| h == p)).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_numbered_without_gaps() {
        let n = 7;
        assert!(pairs_of(n).enumerate().all(|(i, (p, q))| pair_index(n, p, q) == i));
        assert_eq!(pairs_of(n).count(), n_pairs(n));
    }

    #[test]
    fn integrations_fall_into_their_interval() {
        let mut bins = TimeBins::new(SolutionInterval::Seconds(60.0));
        let t0 = 2_460_000.25;
        let keys: Vec<i64> = (0..18).map(|i| bins.key(t0 + f64::from(i) * 10.0 / DAY_S, 10.0).unwrap()).collect();
        assert_eq!(keys, [[0; 6], [1; 6], [2; 6]].concat());
        assert_eq!(bins.key(t0 - 10.0 / DAY_S, 10.0).unwrap(), -1);
    }

    #[test]
    fn an_interval_shorter_than_an_integration_is_refused() {
        let e = TimeBins::new(SolutionInterval::Seconds(1.0)).key(2_460_000.0, 10.0).unwrap_err().to_string();
        assert!(e.contains("solint") && e.contains("10 s"), "{e}");
    }

    #[test]
    fn windows_keep_their_band() {
        let s = SpectralWindow::with_windows(vec![1e9, 1.1e9, 2e9, 2.1e9], vec![1e8; 4], vec![3, 3, 5, 5]).unwrap();
        let plan = ChannelPlan::new(&s, ChannelGroups::Window).unwrap();
        assert_eq!(plan.group_of, [0, 0, 1, 1]);
        assert_eq!(plan.spectrum.spw(), [3, 5]);
        assert!((plan.spectrum.freq_hz()[1] - 2.05e9).abs() < 1.0 && (plan.spectrum.width_hz()[1] - 2e8).abs() < 1.0);
    }
}
