//! The ways to self-calibrate among which held-out baselines choose.

use super::clean_model::CleanMaker;
use super::joint_model::{ImageMaker, JointMaker, JointOptions};
use super::joint_solution::JointGoals;
use super::judged::Candidate;
use super::options::{GainMode, Outliers, RoundOptions, SolveOptions};
use super::selfcal::SelfcalOptions;
use crate::Result;
use crate::deconvolve::{Algorithm, CleanOptions, EXTENDED, by_name};
use crate::imaging::ImagingOptions;
use crate::mem::Prior;
use crate::values::need;
use cittert_arrays::{Polarization, VisUnit};

/// Everything that the candidates share.
#[derive(Debug, Clone)]
pub struct CandidateOptions {
    /// Images, with the same grid for all.
    pub imaging: ImagingOptions,
    /// CLEAN. Its algorithm names the only candidate, or asks for several.
    pub clean: CleanOptions,
    /// The joint solution of image and gains.
    pub joint: JointOptions,
    /// Gain solutions.
    pub solve: SolveOptions,
    /// Rounds.
    pub rounds: RoundOptions,
    /// Unit of the visibilities.
    pub unit: VisUnit,
}

impl CandidateOptions {
    /// Options for sets of this unit, with a joint solution whose prior comes from the data and whose mask is that of CLEAN.
    #[must_use]
    pub fn new(imaging: ImagingOptions, clean: CleanOptions, solve: SolveOptions, rounds: RoundOptions, unit: VisUnit) -> Self {
        let joint = JointOptions { solve: solve.clone(), prior: Prior::Auto, mask: clean.region.clone(), goals: JointGoals::default() };
        Self { imaging, clean, joint, solve, rounds, unit }
    }
}

/// The candidates in the order in which they are tried. For [`Algorithm::Auto`] these are hogbom (for points), multiscale CLEAN, and the
/// joint solution by maximum entropy, in reverse for thermal scenes, which mostly fill their frame.
///
/// # Errors
/// A deconvolver that is not in the table, or an option of CLEAN that is out of range.
pub fn candidates<'a>(of: &CandidateOptions) -> Result<Vec<Candidate<'a>>> {
    of.clean.check()?;
    let range = of.imaging.range.as_ref().map_or(String::new(), ToString::to_string);
    need(
        "range",
        range,
        of.imaging.range.is_none(),
        "no range: self-calibration images by Fourier transforms, of a set that is focused first",
    )?;
    // A threshold in another unit is refused here, before a candidate begins.
    if let Some(level) = of.clean.threshold {
        level.in_unit("threshold", of.unit)?;
    }
    let mut all = match of.clean.algorithm {
        Algorithm::Mem => vec![joint(of)],
        Algorithm::Clean(entry) => vec![clean(of, entry.name)?],
        Algorithm::Auto => {
            let mut all = vec![clean(of, "hogbom")?, clean(of, "multiscale")?];
            all.extend(joint_is_possible(of).then(|| joint(of)));
            all
        }
    };
    if of.unit == VisUnit::KelvinSr {
        all.reverse();
    }
    Ok(all)
}

/// The joint solution makes one image of Stokes I with gains of phases and amplitudes.
fn joint_is_possible(of: &CandidateOptions) -> bool {
    of.imaging.channels_out == 1
        && of.imaging.pol == Polarization::I
        && of.solve.mode != GainMode::Delay
        && of.solve.outliers == Outliers::None
}

fn clean<'a>(of: &CandidateOptions, name: &str) -> Result<Candidate<'a>> {
    let entry = by_name(name)?;
    let (imaging, mut options) = (of.imaging.clone(), CleanOptions { algorithm: entry.into(), ..of.clean.clone() });
    if of.clean.algorithm == Algorithm::Auto && entry.name != EXTENDED {
        // Scales are given for the candidate that uses them.
        (options.scales, options.scale_bias) = (Vec::new(), CleanOptions::default().scale_bias);
    }
    let make = move || Box::new(CleanMaker::new(imaging.clone(), options.clone())) as Box<dyn ImageMaker + 'a>;
    Ok(Candidate { name: entry.name, options: SelfcalOptions::of(of.solve.clone(), of.rounds.clone()), make: Box::new(make) })
}

fn joint<'a>(of: &CandidateOptions) -> Candidate<'a> {
    let (imaging, options) = (of.imaging.clone(), of.joint.clone());
    let make = move || Box::new(JointMaker::new(imaging.clone(), options.clone())) as Box<dyn ImageMaker + 'a>;
    // A joint solution is one round, because it solves image and gains together.
    let rounds = RoundOptions { rounds: 1, ..of.rounds.clone() };
    Candidate { name: Algorithm::Mem.name(), options: SelfcalOptions::of(of.solve.clone(), rounds), make: Box::new(make) }
}
