//! Options of a gain solution.

use crate::closure::SolutionInterval;
use crate::{ChainError, Result};
use cittert_arrays::ArrayLayout;

/// What of a gain is solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GainMode {
    /// Phases; amplitudes stay 1.
    Phase,
    /// Amplitudes and phases.
    AmpPhase,
    /// A phase and a delay: a phase that grows linearly over the channels; amplitudes stay 1.
    Delay,
}

impl GainMode {
    /// Its name on the command line and in gain tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Phase => "phase",
            Self::AmpPhase => "amp-phase",
            Self::Delay => "delay",
        }
    }
}

/// Which channels share a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChannelGroups {
    /// All of them.
    Band,
    /// Those of one spectral window.
    Window,
    /// None: each channel has its own.
    Channel,
}

/// Whether the two feeds of an antenna share a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedGroups {
    /// One gain for both.
    Joined,
    /// One gain each.
    PerFeed,
}

/// How outliers lose their weight. Residuals are measured in sigmas of the weights, over one row (all channels of a group).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Robust {
    /// Student's t with so many degrees of freedom; 2 to 5 are usual.
    StudentT(f64),
    /// Huber: quadratic up to so many sigmas, linear beyond; 2 to 3 are usual.
    Huber(f64),
}

/// Where the noise that `min_snr` is judged by comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseFrom {
    /// The weights, taken as 1/sigma^2; the residuals where these are so small that the weights cannot be.
    Weights,
    /// The residuals of the fit, for sets whose weights have no scale.
    Residuals,
}

/// Options of [`super::solve`].
#[derive(Debug, Clone, PartialEq)]
pub struct SolveOptions {
    /// What is solved for.
    pub mode: GainMode,
    /// How long one solution holds.
    pub solint: SolutionInterval,
    /// Which channels share a solution; not used in delay mode, where all of them do.
    pub channels: ChannelGroups,
    /// Whether the feeds share a solution.
    pub feeds: FeedGroups,
    /// Reference antennas in order of preference; where none of them can be solved, the best antenna takes over.
    pub refant: Vec<usize>,
    /// Gains of a lower ratio of signal to noise are flagged.
    pub min_snr: f64,
    /// Antennas with fewer baselines are flagged. `None` asks for 4, or for all there are where the array has fewer than five antennas.
    pub min_baselines: Option<usize>,
    /// Whether and how outliers lose their weight.
    pub robust: Option<Robust>,
    /// Where the noise comes from.
    pub noise: NoiseFrom,
    /// Divide the amplitudes by their mean over the table, so that the flux scale stays with the model.
    pub normalize: bool,
    /// Largest number of iterations in an interval.
    pub max_iterations: usize,
    /// Converged when no phase (rad) and no log amplitude changes by more.
    pub tolerance: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            mode: GainMode::Phase,
            solint: SolutionInterval::Infinite,
            channels: ChannelGroups::Band,
            feeds: FeedGroups::PerFeed,
            refant: Vec::new(),
            min_snr: 3.0,
            min_baselines: None,
            robust: None,
            noise: NoiseFrom::Weights,
            normalize: false,
            max_iterations: 100,
            tolerance: 1e-9,
        }
    }
}

impl SolveOptions {
    /// Check that every number is within its range, for an array of `n_ant` antennas.
    ///
    /// # Errors
    /// The first option out of its range, or an array of fewer than two antennas (three for amplitudes).
    pub fn check(&self, n_ant: usize) -> Result<()> {
        let bad =
            |option, value: f64, expected: &str| Err(ChainError::BadOption { option, value: value.to_string(), expected: expected.into() });
        let least = if self.mode == GainMode::AmpPhase { 3 } else { 2 };
        if n_ant < least {
            return Err(ChainError::NoData(format!(
                "antenna gains need at least {least} antennas in mode {}, the array has {n_ant}",
                self.mode.name()
            )));
        }
        if let SolutionInterval::Seconds(s) = self.solint
            && !(s.is_finite() && s > 0.0)
        {
            return bad("solint", s, "a positive time, or inf");
        }
        if !(self.min_snr.is_finite() && self.min_snr >= 0.0) {
            return bad("minsnr", self.min_snr, "a finite number of at least 0");
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return bad("tolerance", self.tolerance, "a positive, finite number");
        }
        if self.max_iterations == 0 {
            return bad("iterations", 0.0, "at least 1");
        }
        if let Some(Robust::StudentT(v) | Robust::Huber(v)) = self.robust
            && !(v.is_finite() && v > 0.0)
        {
            return bad("robust", v, "a positive, finite number");
        }
        if let Some(r) = self.refant.iter().find(|r| **r >= n_ant) {
            return bad("refant", *r as f64, &format!("the index of one of the {n_ant} antennas"));
        }
        Ok(())
    }

    /// Baselines an antenna must have, where `n_present` antennas have data.
    pub(crate) fn baselines_needed(&self, n_present: usize) -> usize {
        self.min_baselines.unwrap_or_else(|| n_present.saturating_sub(1).min(4)).max(1)
    }
}

/// Indices of antennas named in order of preference, separated by commas.
///
/// # Errors
/// A name that is not in the layout; the message lists those that are.
pub fn refant_from_names(layout: &ArrayLayout, names: &str) -> Result<Vec<usize>> {
    let find = |name: &str| {
        layout.index_of(name).ok_or_else(|| {
            let all: Vec<&str> = layout.antennas().iter().take(40).map(|a| a.name.as_str()).collect();
            let more = if layout.n_ant() > all.len() { ", ..." } else { "" };
            ChainError::BadOption { option: "refant", value: name.into(), expected: format!("one of {}{more}", all.join(", ")) }
        })
    };
    names.split(',').map(str::trim).filter(|n| !n.is_empty()).map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, LayoutFrame};

    #[test]
    fn an_unknown_refant_is_refused_with_the_names_there_are() {
        let antennas = (0..3).map(|i| Antenna::new(format!("A{i}"), i, [f64::from(i), 0.0, 0.0])).collect();
        let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        assert_eq!(refant_from_names(&layout, "A2, A0").unwrap(), [2, 0]);
        let e = refant_from_names(&layout, "B7").unwrap_err().to_string();
        assert!(e.contains("B7") && e.contains("A0, A1, A2"), "{e}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let ok = SolveOptions::default();
        assert!(ok.check(4).is_ok());
        assert!(ok.check(1).is_err());
        assert!(SolveOptions { mode: GainMode::AmpPhase, ..ok.clone() }.check(2).is_err());
        assert!(SolveOptions { min_snr: f64::NAN, ..ok.clone() }.check(4).is_err());
        assert!(SolveOptions { solint: SolutionInterval::Seconds(-1.0), ..ok.clone() }.check(4).is_err());
        assert!(SolveOptions { robust: Some(Robust::Huber(0.0)), ..ok.clone() }.check(4).is_err());
        assert!(SolveOptions { refant: vec![9], ..ok }.check(4).is_err());
    }

    #[test]
    fn small_arrays_need_all_their_baselines_large_ones_four() {
        let o = SolveOptions::default();
        assert_eq!((o.baselines_needed(3), o.baselines_needed(4), o.baselines_needed(5), o.baselines_needed(200)), (2, 3, 4, 4));
    }
}
