//! Antenna gains: solving, applying and comparing them, and what the data can determine.
//!
//! | file | what it does |
//! |---|---|
//! | `options` | options of a gain solution |
//! | `model` | the model visibilities that gains are solved against |
//! | `normal` | one pass over the data: sums for each baseline and interval |
//! | `over_ranks` | sums over the rows of all processes |
//! | `least_squares`, `delay` | the least squares problems of one interval |
//! | `antenna_fit` | which antennas can be solved in an interval |
//! | `leakage` | leakages between the feeds, and the phase between them |
//! | `grouping` | channels and feeds that share a solution |
//! | `reference` | the reference antenna and its substitutes |
//! | `solve` | the whole set |
//! | `apply`, `apply_leakage` | gains and leakages onto or out of the data |
//! | `degeneracy` | gain tables compared without the phases and scales that no data determine |
//! | `gain_differences` | the difference of each gain from the truth, without them |
//! | `support` | do the closure phases support the model? |
//! | `rounds` | the rounds of self-calibration, and who makes their models |
//! | `selfcal` | the loop of solving and imaging |
//! | `held_out` | baselines that are left out, and how well they are predicted |
//! | `candidates` | the ways among which it chooses |
//! | `judged` | the choice among ways to self-calibrate, or none |
//! | `selfcal_tuning`, `joint_tuning` | constants that steer these solutions |
//! | `power_amplitudes` | amplitudes from autocorrelations |
//! | `predicted` | predictions of the model, kept from a gain solution to the image that follows it |
//! | `clean_model` | CLEAN as the model maker of the loop |
//! | `unknown_gains`, `unknown_gains_builder` | chi squared at the gains that fit a model best |
//! | `joint_solution`, `joint_model` | image and gains solved as one problem |
//! | `joint_pattern` | the same for a smooth scene behind the pattern of the elements |
//! | `pointing` | where the antennas point |
//! | `identify` | what a calibration can determine |

mod antenna_fit;
mod apply;
mod apply_leakage;
mod candidates;
mod clean_model;
#[cfg(test)]
mod clean_model_tests;
mod degeneracy;
mod delay;
mod evidence;
mod gain_differences;
mod gains_over_ranks;
mod grouping;
mod held_out;
mod identify;
#[cfg(test)]
mod identify_tests;
mod joint_model;
mod joint_pattern;
#[cfg(test)]
mod joint_pattern_tests;
mod joint_solution;
#[cfg(test)]
mod joint_tests;
mod joint_tuning;
mod judged;
#[cfg(test)]
mod judged_tests;
mod leakage;
#[cfg(test)]
mod leakage_tests;
mod least_squares;
mod lookup;
mod model;
mod normal;
mod normal_rows;
mod normal_sums;
mod options;
mod over_ranks;
mod pointing;
mod power_amplitudes;
mod predicted;
#[cfg(test)]
mod rank_tests;
mod reach;
mod reference;
mod rounds;
mod row_averages;
mod selfcal;
#[cfg(test)]
mod selfcal_tests;
mod selfcal_tuning;
mod sky_prediction;
mod solve;
#[cfg(test)]
mod solve_tests;
mod starting_phases;
mod support;
mod unknown_gains;
mod unknown_gains_builder;
#[cfg(test)]
mod unknown_gains_tests;
mod unresolved;

pub use crate::closure::SolutionInterval;
pub use antenna_fit::FlagReason;
pub use apply::{ApplyCounts, ApplyOptions, CalibratedSource, Direction, GainApplier, Interpolation, apply, spread_channels};
pub use candidates::{CandidateOptions, candidates};
pub use clean_model::CleanMaker;
pub use degeneracy::{CompareOptions, GainComparison, compare_gains};
pub use evidence::Evidence;
pub use gain_differences::{GainDifferences, gain_differences};
pub use held_out::{HeldOut, JudgeOptions, Prediction, Without};
pub use identify::{DegenerateMode, Identifiability, IdentifyOptions, ModelKnowledge, identify};
pub use joint_model::{ImageMaker, JointMaker, JointOptions};
pub use joint_solution::{Joint, JointGoals, JointStage, Lattice, joint};
pub use joint_tuning::{JointSchedule, JointStep};
pub use judged::{Beginning, Calibrated, Candidate, CandidateRecord, Verdict, calibrate};
pub use leakage::{FeedTerm, LeakageSolution, solve_leakages};
pub(crate) use model::sees_unpolarized;
pub use model::{ModelVisibilities, PointModel, SetModel};
pub use normal::NormalEquations;
pub use normal_sums::SampleCounts;
pub use options::{AntennaNames, ChannelGroups, FeedGroups, GainMode, Outliers, RoundOptions, SolveOptions, StartFrom};
pub(crate) use over_ranks::{ends_all, of_all};
pub use pointing::{PointingReport, PointingSolveOptions, solve_pointings};
pub use power_amplitudes::{PowerAmplitudes, ScaleFrom, amplitudes_from_power};
pub use rounds::{ModelMaker, ModelMetrics, RoundPlan, schedule, tuned_schedule};
pub use selfcal::{Judge, RoundRecord, Selfcal, SelfcalOptions, SelfcalStop, Start, selfcal};
pub use selfcal_tuning::SelfcalTuning;
pub use sky_prediction::{Accuracy, SkyPrediction};
pub use solve::{IntervalReport, Solution, SolveReport, solve};
pub use starting_phases::{StartPhases, starting_phases};
pub use support::ClosureSupport;
pub use unknown_gains::UnknownGains;
pub use unknown_gains_builder::UnknownGainsBuilder;
pub use unresolved::{Unresolved, resolves, unresolved_phases};
