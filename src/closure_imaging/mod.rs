//! Images of sparse arrays without calibrated antennas, from closure phases, closure amplitudes and amplitudes.
//!
//! | file | what it does |
//! |---|---|
//! | `samples` | the data, grouped by time and channel |
//! | `amplitude_term`, `station_term`, `phase_term`, `closure_amplitude_term` | the terms of chi squared |
//! | `gather` | reads a set as a few hundred data: one product, averaged over scans |
//! | `field` | the grid, the co-located antennas and the size of the source |
//! | `dft` | exact transforms of small images |
//! | `penalty` | penalties that choose among the images that fit the data |
//! | `problem` | all terms together as a function of ln I |
//! | `gains` | gains of the antennas given an image |
//! | `tuning` | constants that choose the field, the prior and the flux |
//! | `reconstruct` | rounds of imaging, starts, the total flux |
//!
//! # Reference
//! Chael et al. 2018, ApJ 857, 23; EHT Collaboration 2019, ApJL 875, L4 (Paper IV).

mod amplitude_term;
mod closure_amplitude_term;
mod dft;
mod field;
mod gains;
mod gather;
mod options;
mod penalty;
mod phase_term;
mod problem;
mod reconstruct;
mod samples;
mod station_term;
#[cfg(test)]
mod tests;
mod tuning;

pub use amplitude_term::Amplitudes;
pub use closure_amplitude_term::ClosureAmplitudes;
pub use dft::SmallDft;
pub use field::co_located;
pub use gains::StationGains;
pub use gather::{Average, SparseSet};
pub use options::{ClosureImagingOptions, FluxFrom, Term, Terms};
pub use penalty::PenaltyWeights;
pub use phase_term::ClosurePhases;
pub use reconstruct::{ClosureImage, StartRecord, TermMisfit, reconstruct};
pub use samples::Samples;
pub use station_term::{LogGains, StationAmplitudes};
pub use tuning::ClosureImagingControl;
