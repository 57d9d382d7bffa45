//! Options of gain solutions.

use crate::calibrate::{ChannelGroups, FeedGroups, GainMode, NoiseFrom, Robust, SolutionInterval, SolveOptions, refant_from_names};
use crate::cli::failure::{Failure, Result};
use cittert_arrays::ArrayLayout;
use cittert_arrays::quantity::Duration;
use clap::{Args, ValueEnum};

/// How gains are solved.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Gains")]
pub struct SolveArgs {
    /// What of the gains is solved for.
    #[arg(long, value_enum, default_value_t = ModeName::Phase)]
    pub mode: ModeName,
    /// Length of a solution: a time, int (each integration) or inf (the whole set).
    #[arg(long, value_name = "TIME|int|inf", default_value = "60s")]
    solint: String,
    /// Reference antennas by name in order of preference, separated by commas [default: the best connected].
    #[arg(long, value_name = "NAME")]
    refant: Option<String>,
    /// Gains with a lower signal to noise are flagged.
    #[arg(long, value_name = "X", default_value_t = 3.0)]
    minsnr: f64,
    /// Antennas with fewer baselines are flagged [default: 4, or all there are in a small array].
    #[arg(long, value_name = "N")]
    min_baselines: Option<usize>,
    /// Channels that share a solution.
    #[arg(long, value_enum, default_value_t = GroupName::Band)]
    solve_channels: GroupName,
    /// Whether the two feeds of an antenna share a solution.
    #[arg(long, value_enum, default_value_t = FeedName::PerFeed)]
    feeds: FeedName,
    /// Take weight from outliers, by Student's t or by Huber's function.
    #[arg(long, value_enum, default_value_t = RobustName::None)]
    outliers: RobustName,
    /// Degrees of freedom of Student's t, or sigmas up to which Huber's function is quadratic [default: 3].
    #[arg(long, value_name = "X", default_value_t = 3.0)]
    outlier_scale: f64,
    /// Judge the signal to noise by the residuals of the fit, for weights that have no scale.
    #[arg(long)]
    noise_from_residuals: bool,
}

/// What of a gain is solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// Phases.
    Phase,
    /// Amplitudes and phases.
    AmpPhase,
    /// A phase and a delay.
    Delay,
}

impl From<ModeName> for GainMode {
    fn from(name: ModeName) -> Self {
        match name {
            ModeName::Phase => Self::Phase,
            ModeName::AmpPhase => Self::AmpPhase,
            ModeName::Delay => Self::Delay,
        }
    }
}

/// Channels that share a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum GroupName {
    /// All of them.
    Band,
    /// Those of one spectral window.
    Window,
    /// None.
    Each,
}

/// Whether feeds share a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FeedName {
    /// One gain for both.
    Joined,
    /// One gain each.
    PerFeed,
}

/// Function of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RobustName {
    /// Least squares.
    None,
    /// Student's t.
    Student,
    /// Huber's function.
    Huber,
}

/// `60s`, `int` or `inf`.
///
/// # Errors
/// A text that is none of these.
pub fn solution_interval(text: &str) -> Result<SolutionInterval> {
    match text {
        "inf" => Ok(SolutionInterval::Infinite),
        "int" => Ok(SolutionInterval::Integration),
        _ => text
            .parse::<Duration>()
            .map(|d| SolutionInterval::Seconds(d.si()))
            .map_err(|e| Failure::usage(format!("--solint: {e}; or int, or inf"))),
    }
}

impl SolveArgs {
    /// The library's options for an array.
    ///
    /// # Errors
    /// An interval that cannot be read, a reference antenna that is not in the layout, a number out of its range.
    pub fn options(&self, layout: &ArrayLayout) -> Result<SolveOptions> {
        let options = SolveOptions {
            mode: self.mode.into(),
            solint: solution_interval(&self.solint)?,
            channels: match self.solve_channels {
                GroupName::Band => ChannelGroups::Band,
                GroupName::Window => ChannelGroups::Window,
                GroupName::Each => ChannelGroups::Channel,
            },
            feeds: if self.feeds == FeedName::Joined { FeedGroups::Joined } else { FeedGroups::PerFeed },
            refant: self.refant.as_deref().map_or(Ok(Vec::new()), |names| refant_from_names(layout, names))?,
            min_snr: self.minsnr,
            min_baselines: self.min_baselines,
            robust: match self.outliers {
                RobustName::None => None,
                RobustName::Student => Some(Robust::StudentT(self.outlier_scale)),
                RobustName::Huber => Some(Robust::Huber(self.outlier_scale)),
            },
            noise: if self.noise_from_residuals { NoiseFrom::Residuals } else { NoiseFrom::Weights },
            ..SolveOptions::default()
        };
        options.check(layout.n_ant())?;
        Ok(options)
    }
}
