//! Antenna gains: solving, applying and comparing them, and what can be known without them.
//!
//! | file | what it does |
//! |---|---|
//! | `options` | what a solution is asked for |
//! | `model` | the visibilities that gains are solved against |
//! | `normal` | one pass over the data: sums for each baseline and interval |
//! | `least_squares`, `delay` | the least squares problems of one interval |
//! | `antenna_fit` | which antennas can be solved in an interval |
//! | `grouping` | channels and feeds that share a solution |
//! | `reference` | the reference antenna and its substitutes |
//! | `solve` | the whole set |
//! | `apply` | gains onto or out of the data |
//! | `degeneracy` | gain tables compared modulo what cannot be known |
//! | `support` | do the closure phases support the model? |
//! | `selfcal` | the loop of solving and imaging |
//! | `predicted` | predictions of the model, kept from a solution to the image that follows |
//! | `clean_model` | CLEAN as the model maker of the loop |
//! | `unknown_gains` | chi squared through gains that nobody knows |
//! | `joint_solution`, `joint_model` | image and gains solved as one problem |
//! | `identify` | what can be known |

mod antenna_fit;
mod apply;
mod clean_model;
#[cfg(test)]
mod clean_model_tests;
mod degeneracy;
mod delay;
mod grouping;
mod identify;
#[cfg(test)]
mod identify_tests;
mod joint_model;
mod joint_solution;
#[cfg(test)]
mod joint_tests;
mod least_squares;
mod model;
mod normal;
mod options;
mod predicted;
mod reference;
mod selfcal;
#[cfg(test)]
mod selfcal_tests;
mod sky_prediction;
mod solve;
#[cfg(test)]
mod solve_tests;
mod starting_phases;
mod support;
mod unknown_gains;
#[cfg(test)]
mod unknown_gains_tests;
mod unresolved;

pub use crate::closure::SolutionInterval;
pub use antenna_fit::FlagReason;
pub use apply::{ApplyCounts, ApplyOptions, CalibratedSource, Direction, GainApplier, Interpolation, apply, on_channels};
pub use clean_model::CleanMaker;
pub use degeneracy::{CompareOptions, GainComparison, compare_gains};
pub use identify::{DegenerateMode, Identifiability, IdentifyOptions, ModelKnowledge, identify};
pub use joint_model::{ImageMaker, JointMaker, JointOptions};
pub use joint_solution::{Joint, JointGoals, JointStage, Lattice, joint};
pub use model::{ModelVisibilities, PointModel, SetModel};
pub use normal::{NormalEquations, SampleCounts};
pub use options::{AntennaNames, ChannelGroups, FeedGroups, GainMode, Outliers, RoundOptions, SolveOptions, StartFrom};
pub use selfcal::{ModelMaker, ModelMetrics, RoundPlan, RoundRecord, Selfcal, SelfcalOptions, SelfcalStop, Start, schedule, selfcal};
pub use sky_prediction::{Accuracy, SkyPrediction};
pub use solve::{IntervalReport, Solution, SolveReport, solve};
pub use starting_phases::{StartPhases, starting_phases};
pub use support::ClosureSupport;
pub use unknown_gains::{UnknownGains, UnknownGainsBuilder};
pub use unresolved::{Unresolved, resolves, unresolved_phases};
