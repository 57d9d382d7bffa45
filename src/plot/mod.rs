//! Pictures. Every function returns a [`Picture`], and the caller decides in which format it is written, and where.
//!
//! | function | shows |
//! |---|---|
//! | [`image()`] | one plane of an image, with beam and colour bar |
//! | [`uv_coverage`] | u-v points coloured by channel |
//! | [`uv_mask`] | hits of the cells of the Fourier grid |
//! | [`layout`] | antennas on the ground or in the aperture plane |
//! | [`VisPlot`] | amplitude and phase against baseline length |
//! | [`curves`] | lines with error bars and a legend |
//! | [`grey()`] | the pixels of a plane, without axes, as a PNG file |

mod antennas;
mod axes;
mod canvas;
mod colors;
mod curves;
mod grey;
mod heat;
mod legend;
mod panel;
mod picture;
pub mod report;
mod shape;
mod size;
mod uv;
mod vector;
mod visibilities;

pub use antennas::layout;
pub use curves::{CurveOptions, Series, curves};
pub use grey::grey;
pub use heat::{ImagePlot, Range, Stretch, image, uv_mask};
pub use legend::Style;
pub use picture::{Picture, PictureFormat};
pub use size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
pub use uv::uv_coverage;
pub use visibilities::VisPlot;
