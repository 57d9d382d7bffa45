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

mod apply;
mod core;
mod delay;
mod interval;
mod intervals;
mod linalg;
mod model;
mod normal;
mod options;
mod reference;
mod solve;
#[cfg(test)]
mod solve_tests;
#[cfg(test)]
mod testdata;

pub use apply::{ApplyCounts, ApplyOptions, CalibratedSource, Direction, GainApplier, Interpolation, apply};
pub use interval::FlagReason;
pub use model::{ModelVisibilities, PointModel, SetModel};
pub use normal::{NormalEquations, SampleCounts};
pub use options::{ChannelGroups, FeedGroups, GainMode, NoiseFrom, Robust, SolutionInterval, SolveOptions, refant_from_names};
pub use solve::{IntervalReport, Solution, SolveReport, solve};
