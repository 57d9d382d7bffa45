//! Aperture synthesis: from an array layout and a scene to visibilities, images and calibrations.
//!
//! The program `cittert` is a thin command line around this library. A function of the library does one step of the chain. Options are
//! plain structs with defaults, and each step takes the result of the step before:
//!
//! ```
//! use cittert::arrays::quantity::{Angle, Duration, Frequency};
//! use cittert::arrays::{ArrayLayout, Source, VisUnit, VisibilitySet};
//! use cittert::calibrate::{ApplyOptions, Beginning, CalibratedSource, CandidateOptions, CompareOptions, JudgeOptions, RoundOptions};
//! use cittert::calibrate::{SolutionInterval, SolveOptions, calibrate, candidates, compare_gains};
//! use cittert::corrupt::{CorruptOptions, Error, PhaseError, Variation, corrupt, corrupted_header};
//! use cittert::deconvolve::CleanOptions;
//! use cittert::imaging::{Imager, ImagingOptions, clean};
//! use cittert::progress::Silent;
//! use cittert::simulate::{BandOptions, SimulateOptions, SkyModel, TrackOptions, simulate_set};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // An array, its band, and its coverage of the u-v plane in one look along the boresight.
//! let layout = ArrayLayout::builtin("mm-y")?;
//! let band = BandOptions { freq: Frequency(94e9), bandwidth: Frequency(2e9), channels: 4 }.spectrum()?;
//! let track = TrackOptions { integration: Duration(1.0), ..TrackOptions::default() }.plan(&layout)?;
//! let coverage = track.plan.coverage()?;
//!
//! // The visibilities of two points.
//! let sky = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0), Source::point(0.02, -0.01, 0.4)]);
//! let options = SimulateOptions::default();
//! let header = options.header(layout, band, track.center, VisUnit::Jy);
//! let perfect = simulate_set(header, &coverage, &sky, &options, &Silent)?;
//!
//! // The same visibilities with phase errors of 0.5 rad rms in every antenna.
//! let phase = PhaseError { rms_rad: 0.5, variation: Variation::Constant };
//! let errors = CorruptOptions { seed: 1, errors: vec![Error::Phase(phase)], per_feed: false };
//! let mut measured = VisibilitySet::new(corrupted_header(&perfect.header, &errors), perfect.data.rows(0..0)?)?;
//! let truth = corrupt(&mut perfect.clone(), &mut measured, &errors, &Silent)?;
//!
//! // Self-calibration. It is accepted only if it predicts baselines better that it was not fitted to.
//! let imaging = ImagingOptions { size: Some("128".parse()?), cell: Some(Angle(0.001)), ..ImagingOptions::default() };
//! let cleaning = CleanOptions { niter: 300, ..CleanOptions::default() };
//! let solve = SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() };
//! let rounds = RoundOptions { rounds: 5, ..RoundOptions::default() };
//! let ways = candidates(&CandidateOptions::new(imaging.clone(), cleaning.clone(), solve, rounds, VisUnit::Jy))?;
//! let (solved, _) = calibrate(&mut measured, &ways, Beginning::Data, &JudgeOptions::default(), &Silent)?;
//! assert!(solved.verdict.accepted(), "{:?}", solved.evidence);
//! let error = compare_gains(&solved.gains, &truth, CompareOptions { gradient: true, flux_scale: false })?;
//! assert!(error.rms_phase_rad < 0.02, "{error:?}");
//!
//! // The dirty image and its CLEAN from the calibrated visibilities.
//! let mut calibrated = CalibratedSource::new(&mut measured, &solved.gains, ApplyOptions::default())?;
//! let mut imager = Imager::new(&mut calibrated, imaging, &Silent)?;
//! let images = clean(&mut imager, &cleaning, &Silent)?;
//! assert!((images.statistics.model_flux - 1.4).abs() < 0.05);
//! # Ok(())
//! # }
//! ```
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `cli` (default) | the program, its pictures and its reports; it includes `formats` |
//! | `formats` | the file formats, as [`formats`]; needs the system library HDF5 |
//! | `ms` | Measurement Sets; needs casacore |
//!
//! Without default features the crate is the chain alone: no HDF5, no command line parser, nothing that draws.

pub mod calibrate;
#[cfg(feature = "cli")]
pub mod cli;
pub mod closure;
pub mod closure_imaging;
pub mod corrupt;
#[cfg(feature = "cli")]
pub mod cost;
pub mod deconvolve;
pub mod design;
pub mod display;
pub mod enhance;
pub mod error;
pub mod fidelity;
mod finite;
#[cfg(test)]
pub(crate) mod fixtures;
pub mod fourier;
pub mod imaging;
mod lbfgs;
mod linalg;
pub mod mem;
pub mod memory;
pub mod misfit;
pub mod nearfield;
mod pages;
#[cfg(feature = "cli")]
pub mod plot;
mod processor;
pub mod progress;
pub mod random;
pub mod sensor;
pub mod simulate;
pub mod study;
pub mod values;
pub mod verdict;

pub use cittert_arrays as arrays;
#[cfg(feature = "formats")]
pub use cittert_formats as formats;
pub(crate) use error::ensure;
pub use error::{ChainError, Result};
