//! Antenna gains: solving, applying and comparing them, and what can be known without them.
//!
//! | file | what it does |
//! |---|---|
//! | `options` | what a solution is asked for |
//! | `model` | the visibilities that gains are solved against |
//! | `normal` | one pass over the data: sums for each baseline and interval |
//! | `core`, `delay` | the least squares problems of one interval |
//! | `interval` | which antennas can be solved in an interval |
//! | `reference` | the reference antenna and its substitutes |
//! | `solve` | the whole set |
//! | `apply` | gains onto or out of the data |
//! | `closure`, `closure_sets` | closure phases and amplitudes, and on which antennas |
//! | `degeneracy` | gain tables compared modulo what cannot be known |
//! | `support` | do the closure phases support the model? |
//! | `selfcal` | the loop of solving and imaging |
//! | `predicted` | predictions of the model, kept from a solution to the image that follows |
//! | `clean_maker` | CLEAN as the model maker of the loop |
//! | `unknown_gains` | chi squared through gains that nobody knows |
//! | `joint`, `joint_maker` | image and gains solved as one problem |
//! | `identify` | what can be known |

mod apply;
mod clean_maker;
#[cfg(test)]
mod clean_maker_tests;
mod closure;
mod closure_sets;
mod core;
mod degeneracy;
mod delay;
mod identify;
#[cfg(test)]
mod identify_tests;
mod interval;
mod intervals;
mod joint;
mod joint_maker;
#[cfg(test)]
mod joint_tests;
mod linalg;
mod model;
mod normal;
mod options;
mod predicted;
mod reference;
mod selfcal;
#[cfg(test)]
mod selfcal_tests;
mod solve;
#[cfg(test)]
mod solve_tests;
mod support;
#[cfg(test)]
mod testdata;
mod unknown_gains;
#[cfg(test)]
mod unknown_gains_tests;
mod unresolved;

pub use apply::{ApplyCounts, ApplyOptions, CalibratedSource, Direction, GainApplier, Interpolation, apply, on_channels};
pub use clean_maker::CleanMaker;
pub use closure::{
    ClosureAmplitude, ClosureChannels, ClosureKey, ClosureOptions, ClosurePhase, ClosureSet, closure_amplitudes, closure_phases,
};
pub(crate) use closure_sets::{Links, quadrangles, triangles};
pub use degeneracy::{CompareOptions, GainComparison, compare_gains};
pub use identify::{DegenerateMode, Identifiability, IdentifyOptions, ModelKnowledge, identify};
pub use interval::FlagReason;
pub use joint::{Joint, JointGoals, JointStage, Lattice, joint};
pub use joint_maker::{ImageMaker, JointMaker, JointOptions};
pub(crate) use linalg::{Cholesky, Matrix};
pub use model::{ModelVisibilities, PointModel, SetModel};
pub use normal::{NormalEquations, SampleCounts};
pub use options::{ChannelGroups, FeedGroups, GainMode, NoiseFrom, Robust, SolutionInterval, SolveOptions, refant_from_names};
pub use selfcal::{ModelMaker, ModelMetrics, RoundPlan, RoundRecord, Selfcal, SelfcalOptions, Start, StopReason, schedule, selfcal};
pub use solve::{IntervalReport, Solution, SolveReport, solve};
pub use support::ClosureSupport;
pub use unknown_gains::{UnknownGains, UnknownGainsBuilder};
pub use unresolved::{Unresolved, resolves, unresolved_phases};
