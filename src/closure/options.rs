//! Options of closure quantities.

use super::time::SolutionInterval;

/// What happens to the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum ClosureChannels {
    /// Visibilities are averaged over the band first.
    #[cfg_attr(feature = "cli", value(name = "average"))]
    AverageVisibilities,
    /// Quantities are formed for each and averaged.
    AverageClosures,
    /// One quantity for each.
    Each,
}

/// Options of [`super::closure_phases`] and [`super::closure_amplitudes`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct ClosureOptions {
    /// Every triangle and quadrangle instead of an independent set of them.
    #[cfg_attr(feature = "cli", arg(long))]
    pub all: bool,
    /// Average over this time: a time, int (each integration) or inf (the whole set).
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME|int|inf", default_value_t = ClosureOptions::default().solint))]
    pub solint: SolutionInterval,
    /// What happens to the channels.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = ClosureOptions::default().channels))]
    pub channels: ClosureChannels,
}

impl Default for ClosureOptions {
    fn default() -> Self {
        Self { all: false, solint: SolutionInterval::Integration, channels: ClosureChannels::AverageVisibilities }
    }
}
