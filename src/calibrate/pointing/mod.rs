//! Pointing offsets of the antennas, from the visibilities of a model through the pattern of the elements.
//!
//! An antenna that points elsewhere dims each part of the scene by another factor. No gain does that, so the offsets can be told from gains, if the
//! scene has structure within the pattern. Offsets and gains are fitted together, by Gauss and Newton's method, and judged by baselines that were
//! held out.

mod basis;
mod data;
mod fit;
mod solve;
#[cfg(test)]
mod tests;

pub use solve::{PointingReport, PointingSolveOptions, solve_pointings};
