//! Options of closure quantities.

use super::sets::ClosureSet;
use super::time::SolutionInterval;

/// How the channels are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosureChannels {
    /// One quantity for each.
    Each,
    /// Quantities are formed for each and averaged.
    AverageClosures,
    /// Visibilities are averaged over the band, then quantities are formed.
    AverageVisibilities,
}

/// Options of [`super::closure_phases`] and [`super::closure_amplitudes`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureOptions {
    /// Independent ones, or all.
    pub set: ClosureSet,
    /// Over what time the quantities are averaged.
    pub interval: SolutionInterval,
    /// What happens to the channels.
    pub channels: ClosureChannels,
}

impl Default for ClosureOptions {
    fn default() -> Self {
        Self { set: ClosureSet::Minimal, interval: SolutionInterval::Integration, channels: ClosureChannels::AverageVisibilities }
    }
}
