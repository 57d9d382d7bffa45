//! Options of gain solutions and of self-calibration: one type a group for the library, the command line and the files of `run` and `study`.

use super::apply::{ApplyOptions, Direction, Interpolation};
use super::held_out::JudgeOptions;
use crate::closure::SolutionInterval;
use crate::values::{bad_value, by_text};
use crate::{ChainError, Result};
use cittert_arrays::ArrayLayout;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Which part of a gain is solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum GainMode {
    /// Phases. Amplitudes stay 1.
    Phase,
    /// Amplitudes and phases.
    AmpPhase,
    /// A phase and a delay: a phase that grows linearly over the channels. Amplitudes stay 1.
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum ChannelGroups {
    /// All channels.
    Band,
    /// The channels of one spectral window.
    Window,
    /// None: each channel has a solution of its own.
    #[serde(rename = "each")]
    #[cfg_attr(feature = "cli", value(name = "each"))]
    Channel,
}

/// Whether the two feeds of an antenna share a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum FeedGroups {
    /// One gain for both feeds.
    Joined,
    /// One gain for each feed.
    PerFeed,
}

/// How outliers lose their weight. Residuals are measured in sigmas of the weights, over one row (all channels of a group).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Outliers {
    /// They keep it: least squares.
    None,
    /// By Student's t. 2 to 5 degrees of freedom are usual.
    Student,
    /// By Huber's function: quadratic up to the scale in sigmas, linear beyond. 2 to 3 sigmas are usual.
    Huber,
}

/// Options of gain solutions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Gains"))]
pub struct SolveOptions {
    /// Which part of the gains is solved for.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = SolveOptions::default().mode))]
    pub mode: GainMode,
    /// Length of a solution interval: a time, int (each integration) or inf (the whole set).
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME|int|inf", default_value_t = SolveOptions::default().solint))]
    pub solint: SolutionInterval,
    /// Reference antennas by name in order of preference, separated by commas [default: the best connected antenna].
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME"))]
    pub refant: Option<AntennaNames>,
    /// Flag gains with a lower signal to noise ratio.
    #[serde(rename = "minsnr")]
    #[cfg_attr(feature = "cli", arg(long = "minsnr", value_name = "X", default_value_t = SolveOptions::default().min_snr))]
    pub min_snr: f64,
    /// Flag antennas with fewer baselines [default: 4, or all of them in an array of fewer than five antennas].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub min_baselines: Option<usize>,
    /// Channels that share a solution. In mode delay all of them do.
    #[serde(rename = "solve-channels")]
    #[cfg_attr(feature = "cli", arg(long = "solve-channels", id = "solve-channels", value_enum, default_value_t = SolveOptions::default().channels))]
    pub channels: ChannelGroups,
    /// Whether the two feeds of an antenna share a solution.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = SolveOptions::default().feeds))]
    pub feeds: FeedGroups,
    /// Lower the weight of outliers by Student's t or by Huber's function.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = SolveOptions::default().outliers))]
    pub outliers: Outliers,
    /// Degrees of freedom of Student's t, or the sigmas up to which Huber's function is quadratic.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = SolveOptions::default().outlier_scale))]
    pub outlier_scale: f64,
    /// Judge the signal to noise ratio by the residuals of the fit, for weights that have no scale.
    #[cfg_attr(feature = "cli", arg(long))]
    pub noise_from_residuals: bool,
    /// Divide the amplitudes by their mean over the table, so that the flux scale stays with the model.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub normalize: bool,
    /// Largest number of iterations in an interval.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = SolveOptions::default().max_iterations))]
    pub max_iterations: usize,
    /// A solution has converged when no phase (rad) and no log amplitude changes by more.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = SolveOptions::default().tolerance))]
    pub tolerance: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            mode: GainMode::Phase,
            solint: SolutionInterval::Seconds(60.0),
            refant: None,
            min_snr: 3.0,
            min_baselines: None,
            channels: ChannelGroups::Band,
            feeds: FeedGroups::PerFeed,
            outliers: Outliers::None,
            outlier_scale: 3.0,
            noise_from_residuals: false,
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
        let bad = |field, value: f64, expected: &str| bad_value(field, value, expected);
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
            return bad("tolerance of the solution", self.tolerance, "a positive, finite number");
        }
        if self.max_iterations == 0 {
            return bad("largest number of iterations", 0.0, "at least 1");
        }
        if !(self.outlier_scale.is_finite() && self.outlier_scale > 0.0) {
            return bad("outlier-scale", self.outlier_scale, "a positive, finite number");
        }
        Ok(())
    }

    /// Baselines an antenna must have, where `n_present` antennas have data.
    pub(crate) fn baselines_needed(&self, n_present: usize) -> usize {
        self.min_baselines.unwrap_or_else(|| n_present.saturating_sub(1).min(4)).max(1)
    }
}

/// Names of antennas in order of preference, written with commas between.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AntennaNames(pub Vec<String>);
by_text!(AntennaNames, "string", "Names of antennas in order of preference, separated by commas.");

impl fmt::Display for AntennaNames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(","))
    }
}

impl FromStr for AntennaNames {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
        Ok(Self(text.split(',').map(str::trim).filter(|n| !n.is_empty()).map(str::to_owned).collect()))
    }
}

impl AntennaNames {
    /// Indices of the antennas in a layout.
    ///
    /// # Errors
    /// A name that is not in the layout. The message lists those that are.
    pub fn indices(&self, layout: &ArrayLayout) -> Result<Vec<usize>> {
        let find = |name: &String| match layout.index_of(name) {
            Some(index) => Ok(index),
            None => {
                let all: Vec<&str> = layout.antennas().iter().take(40).map(|a| a.name.as_str()).collect();
                let more = if layout.n_ant() > all.len() { ", ..." } else { "" };
                bad_value("refant", name, format!("one of {}{more}", all.join(", ")))
            }
        };
        self.0.iter().map(find).collect()
    }
}

/// What the first gains are solved against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum StartFrom {
    /// A point at the phase centre.
    Point,
    /// The first image of the data as they are. The position of the sky is then open.
    Data,
    /// The error-free visibilities. Only a study has them.
    #[cfg_attr(feature = "cli", value(skip))]
    Truth,
}

/// Options of the rounds of self-calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Rounds"))]
pub struct RoundOptions {
    /// What the first gains are solved against.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = RoundOptions::default().start, conflicts_with = "model"))]
    pub start: StartFrom,
    /// A model to solve the first gains against: FITS image (K, Jy/pixel or Jy/beam) or source list (CSV).
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS|CSV"))]
    pub model: Option<PathBuf>,
    /// Largest number of rounds. With amplitudes the last third of them solves for amplitudes too, the others for phases alone.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = RoundOptions::default().rounds))]
    pub rounds: usize,
    /// Begin with solution intervals four and two times as long, for weak sources and slow errors.
    #[cfg_attr(feature = "cli", arg(long))]
    pub shrink: bool,
    /// A round counts as better when the part of the held-out data that is predicted, over the part that is not, grows by this fraction.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = RoundOptions::default().improvement))]
    pub improvement: f64,
    /// A stage (a mode and an interval) ends after this many rounds that are not better.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = RoundOptions::default().patience))]
    pub patience: usize,
    /// The gain between the middles of solution intervals.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = RoundOptions::default().interp))]
    pub interp: Interpolation,
    /// Leave data without a gain as they are instead of flagging them.
    #[cfg_attr(feature = "cli", arg(long))]
    pub keep_unsolved: bool,
    /// Fraction of the baselines that is held out to judge the result. With 0 the gains of the best round are applied without a judgement.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = RoundOptions::default().hold_out))]
    pub hold_out: f64,
    /// Apply the gains of the best round even if the baselines that were held out do not support them.
    #[cfg_attr(feature = "cli", arg(long))]
    pub force: bool,
}

impl Default for RoundOptions {
    fn default() -> Self {
        Self {
            start: StartFrom::Data,
            model: None,
            rounds: 10,
            shrink: false,
            improvement: 0.01,
            patience: 1,
            interp: Interpolation::Nearest,
            keep_unsolved: false,
            hold_out: JudgeOptions::default().fraction,
            force: false,
        }
    }
}

/// More rounds than these are a slip of the keyboard.
const MOST_ROUNDS: usize = 1000;

impl RoundOptions {
    /// Check every number.
    ///
    /// # Errors
    /// The first option out of its range.
    pub fn check(&self) -> Result<()> {
        if !(1..=MOST_ROUNDS).contains(&self.rounds) {
            return bad_value("rounds", self.rounds, format!("1 to {MOST_ROUNDS}"));
        }
        if !(self.improvement.is_finite() && self.improvement >= 0.0) {
            return bad_value("improvement", self.improvement, "a number of at least 0");
        }
        if self.patience == 0 {
            return bad_value("patience", 0, "at least 1");
        }
        if !(0.0..=0.5).contains(&self.hold_out) {
            return bad_value("hold-out", self.hold_out, "0 (no judgement) to 0.5");
        }
        Ok(())
    }

    /// How the result is judged.
    #[must_use]
    pub fn judge(&self) -> JudgeOptions {
        JudgeOptions { fraction: self.hold_out, force: self.force, ..JudgeOptions::default() }
    }

    /// How gains are applied to the data.
    #[must_use]
    pub fn apply(&self) -> ApplyOptions {
        ApplyOptions { direction: Direction::Calibrate, interpolation: self.interp, flag_unsolved: !self.keep_unsolved, anywhere: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, LayoutFrame};

    #[test]
    fn an_unknown_refant_is_refused_with_the_names_there_are() {
        let antennas = (0..3).map(|i| Antenna::new(format!("A{i}"), i, [f64::from(i), 0.0, 0.0])).collect();
        let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        assert_eq!("A2, A0".parse::<AntennaNames>().unwrap().indices(&layout).unwrap(), [2, 0]);
        let e = "B7".parse::<AntennaNames>().unwrap().indices(&layout).unwrap_err().to_string();
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
        assert!(SolveOptions { outlier_scale: 0.0, ..ok }.check(4).is_err());
    }

    #[test]
    fn small_arrays_need_all_their_baselines_large_ones_four() {
        let o = SolveOptions::default();
        assert_eq!((o.baselines_needed(3), o.baselines_needed(4), o.baselines_needed(5), o.baselines_needed(200)), (2, 3, 4, 4));
    }
}
