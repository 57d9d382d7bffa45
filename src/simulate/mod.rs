//! Simulation: the visibilities of a scene for the coverage of an array.
//!
//! A [`Simulator`] checks the scene, the layout and the options once. It then computes visibilities block by block, so a set of any length
//! needs the memory of one block. The three methods differ only in the transform of images:
//!
//! | method | transform of images | error |
//! |---|---|---|
//! | [`Method::Dft`] | exact sum over the pixels | rounding |
//! | [`Method::Degrid`] | FFT and interpolation by a gridding kernel | at most [`SimulateOptions::epsilon`] of the total flux |
//! | [`Method::Mask`] | nearest cell of the FFT of the scene | that of moving each baseline by up to half a cell |
//!
//! Points and Gaussians are exact sums in all three methods (in `mask` at the centres of the cells).

mod analytic;
mod degrid;
pub mod dft;
pub mod element;
mod engine;
#[cfg(test)]
mod engine_tests;
pub mod mask;
mod method;
pub mod noise;
pub mod pedestal;
mod phasor;
mod sky;

pub use element::ElementPattern;
pub use engine::{Simulator, Summary, simulate_set};
pub use mask::{UvMask, UvMaskBuilder};
pub use method::Method;
pub use noise::{NoiseModel, NoiseOptions};
pub use pedestal::Pedestal;
pub use sky::{SkyModel, jy_per_kelvin_sr};

/// What to simulate and how.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulateOptions {
    /// Transform of images.
    pub method: Method,
    /// Accuracy of [`Method::Degrid`] relative to the total flux, 1e-12 to 1e-1.
    pub epsilon: f64,
    /// Include w (n - 1) in the phase. [`Method::Mask`] never does.
    pub w_term: bool,
    /// Divide brightness temperature by n, as dOmega = dl dm / n.
    pub one_over_n: bool,
    /// Pattern of each element.
    pub pattern: ElementPattern,
    /// Frequencies averaged in each channel, which gives bandwidth smearing; 1 takes the channel centre alone.
    pub subchannels: usize,
    /// Constant taken off a scene in kelvin.
    pub pedestal: Pedestal,
    /// Thermal noise, if any.
    pub noise: Option<NoiseOptions>,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            method: Method::Degrid,
            epsilon: 1e-7,
            w_term: true,
            one_over_n: true,
            pattern: ElementPattern::None,
            subchannels: 1,
            pedestal: Pedestal::Auto,
            noise: None,
        }
    }
}
