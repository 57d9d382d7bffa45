//! Pictures: every function returns the bytes of a PNG file, so that the caller decides where they go.
//!
//! | function | shows |
//! |---|---|
//! | [`image()`] | one plane of an image, with beam and colour bar |
//! | [`residual`] | the same in two colours around zero |
//! | [`uv_coverage`] | u-v points coloured by channel |
//! | [`uv_mask`] | hits of the cells of the Fourier grid |
//! | [`layout`] | antennas on the ground or in the aperture plane |
//! | [`VisPlot`] | amplitude and phase against baseline length |
//! | [`curves`] | lines with error bars and a legend |
//! | [`grey()`] | the bare pixels of a plane |

mod antennas;
mod axes;
mod canvas;
mod colors;
mod curves;
mod grey;
mod heat;
pub mod report;
mod uv;
mod visibilities;

pub use antennas::layout;
pub use curves::{CurveOptions, Series, Style, curves};
pub use grey::grey;
pub use heat::{ImagePlot, Range, Stretch, image, residual, uv_mask};
pub use uv::uv_coverage;
pub use visibilities::VisPlot;

/// Width of a picture unless another is asked for, pixels.
pub const DEFAULT_WIDTH: usize = 900;
/// Height of a picture unless another is asked for, pixels.
pub const DEFAULT_HEIGHT: usize = 800;
