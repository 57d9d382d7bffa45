//! The starting phases. If the phases of the data are not calibrated, they are solved against a point.

use super::model::PointModel;
use super::options::SolveOptions;
use super::solve::solve;
use super::unresolved::{resolves, unresolved_phases};
use crate::Result;
use crate::closure::SolutionInterval;
use crate::progress::{Event, Observer};
use cittert_arrays::{GainTable, VisibilitySource};
use serde::{Deserialize, Serialize};

/// When to solve the phases against a point at the phase centre before imaging.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum StartPhases {
    /// Where the phases of baselines that do not resolve the field show that the data are not calibrated.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// Length of a solution interval, s.
const INTERVAL_S: f64 = 60.0;

impl StartPhases {
    /// True if the data must be tested. With `auto`, data in which every baseline resolves the field give no information.
    #[must_use]
    pub fn may_solve(self, shortest_wl: f64, half_field_rad: f64) -> bool {
        match self {
            Self::Never => false,
            Self::Always => true,
            Self::Auto => !resolves(shortest_wl, half_field_rad),
        }
    }
}

/// Gains of phases against a point at the phase centre; `None` where the phases of the data are kept as they are.
///
/// `half_field_rad` is half the diagonal of the field. Baselines that do not resolve it must have coherent phases.
///
/// # Errors
/// No gain could be solved, or the source fails.
pub fn starting_phases(
    source: &mut dyn VisibilitySource,
    when: StartPhases,
    half_field_rad: f64,
    observer: &dyn Observer,
) -> Result<Option<GainTable>> {
    match when {
        StartPhases::Never => return Ok(None),
        StartPhases::Always => {}
        StartPhases::Auto => {
            let short = unresolved_phases(source, half_field_rad)?;
            if !short.is_incoherent() {
                return Ok(None);
            }
            observer.event(Event::Warning(&format!(
                "the phases are not calibrated: {} visibilities on baselines that do not resolve this field have a coherence of {:.2}. \
                 They are solved against a point at the phase centre first, every {INTERVAL_S} s (startmod never keeps them as they are)",
                short.count, short.coherence
            )));
        }
    }
    let mut point = PointModel { flux: 1.0, l: 0.0, m: 0.0 };
    let options = SolveOptions { solint: SolutionInterval::Seconds(INTERVAL_S), ..SolveOptions::default() };
    Ok(Some(solve(source, &mut point, &options, observer)?.gains))
}
