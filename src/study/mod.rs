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
//! | `hand_out` | trials shared by several processes |
//! | `score` | the scores of a trial |
//! | `summary` | means and percentiles over the seeds |
//! | `question` | what is asked of a parameter: up to which value is a score kept? |
//! | `search` | the values at which trials answer a question |
//! | `quantile` | quantiles of a sample with their confidence limits |
//! | `failures` | what the failure of each antenna costs |

mod axis;
mod base;
mod failures;
mod hand_out;
#[cfg(test)]
mod law_tests;
mod quantile;
mod question;
#[cfg(test)]
mod question_tests;
mod run;
mod score;
mod search;
mod summary;
mod trial;

pub use axis::{Axis, AxisValue, Grid};
pub use base::{Antennas, Base, Deconvolution, Reference};
pub use failures::{AntennaCost, rank};
pub use quantile::{Estimate, Place, enough_seeds, least_seeds};
pub use question::{Bound, Question};
pub use run::{Batch, Found, Study, run, run_batch};
pub use score::{N_SCORES, Quality, Score};
pub use search::{Answer, Search};
pub use summary::{Statistics, summarize};
pub use trial::{SelfcalPlan, Setup, TrialResult, trial};
