//! Enhancement of images: less noise, more pixels, more contrast, sharper edges, and deconvolution with the PSF of the sensor.
//!
//! A chain of steps turns one or several frames \[m, l\] into one image in the same unit. Each step is one file with a plain function on a frame, and
//! one row of [`STEPS`]. Borders are reflected, blank pixels are refused, and the bytes of the result do not depend on the number of threads.
//!
//! ```
//! use cittert::enhance::{Setting, StepList};
//! use cittert::arrays::BrightnessUnit;
//! use ndarray::Array2;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let steps: StepList = "median=3,bicubic=2,unsharp=1.5:0.8".parse()?;
//! let chain = steps.chain(&Setting { unit: BrightnessUnit::Kelvin, cell_rad: 1e-3, psf: None })?;
//! let frame = Array2::from_elem((48, 64), 280.0);
//! assert_eq!(chain.apply(vec![frame])?.dim(), (96, 128));
//! # Ok(())
//! # }
//! ```

mod average;
mod band_limited;
mod bandpass;
mod bicubic;
mod bilateral;
mod bilinear;
mod border;
mod chain;
mod clahe;
mod edge_response;
mod equalize;
mod hybrid;
mod image;
mod lanczos;
mod laplacian;
mod median;
mod metrics;
mod nl_means;
mod options;
#[cfg(test)]
mod oracle_tests;
mod psf;
mod resample;
mod richardson_lucy;
#[cfg(test)]
pub(crate) mod samples;
mod smooth;
mod sobel;
mod step;
mod table;
mod target;
#[cfg(test)]
mod tests;
mod total_variation;
mod unsharp;
mod wiener;
mod wiener_deconvolution;

pub use average::average;
pub use band_limited::band_limited;
pub use bandpass::bandpass;
pub use bicubic::bicubic;
pub use bilateral::bilateral;
pub use bilinear::bilinear;
pub use chain::{Chain, StepList};
pub use clahe::clahe;
pub use edge_response::{EdgeResponse, Edges};
pub use equalize::equalize;
pub use hybrid::hybrid;
pub use image::enhance;
pub use lanczos::lanczos;
pub use laplacian::{laplacian, sharpen};
pub use median::median;
pub use metrics::{Measure, Metrics, noise_level};
pub use nl_means::nl_means;
pub use options::EnhanceOptions;
pub use psf::Psf;
pub use resample::Placing;
pub use richardson_lucy::richardson_lucy;
pub use smooth::gaussian;
pub use sobel::{gradient, gradient_length, sobel_guided};
pub use step::{Given, Parameter, Range, Setting, Step, StepKind};
pub use table::STEPS;
pub use target::{Target, TargetContrast};
pub use total_variation::total_variation;
pub use unsharp::unsharp;
pub use wiener::wiener;
pub use wiener_deconvolution::wiener_deconvolution;
