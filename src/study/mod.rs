//! Monte-Carlo studies: how much an error degrades an image, and how much of that self-calibration recovers.
//!
//! A study is a grid of points (one for each combination of the values of its axes) times seeds. Every trial corrupts the same error-free
//! observation, images it, self-calibrates it, and compares gains and images with the truth. A trial depends only on its point and its
//! seed, and runs on one thread. The numbers are therefore identical for every order of the trials and every number of threads.
//!
//! | file | what it does |
//! |---|---|
//! | `axis` | axes, values, and the grid that they span |
//! | `base` | the error-free observation and its image, shared by trials |
//! | `trial` | one trial |
//! | `run` | all trials, on several threads, with the time left |
//! | `summary` | means and percentiles over the seeds |

mod axis;
mod base;
#[cfg(test)]
mod law_tests;
mod run;
mod summary;
mod trial;

pub use axis::{Axis, AxisValue, Grid};
pub use base::{Antennas, Base, Deconvolution, Reference};
pub use run::{Study, run};
pub use summary::{Statistics, summarize};
pub use trial::{COLUMNS, Column, Quality, SelfcalPlan, Setup, TrialResult, trial};
