//! Pictures. Every function returns a [`Picture`], and the caller decides in which format it is written, and where.
//!
//! | function | shows |
//! |---|---|
//! | [`image()`], [`images`] | one plane of an image, or of several side by side, with beam, contours and colour bar |
//! | [`psf()`] | a dirty beam in dB, with its profile along the radius |
//! | [`ghosts()`] | a beam in dB over the directions of its ghosts, with its highest lobes |
//! | [`uv_coverage`] | u-v points coloured by channel |
//! | [`uv_mask`] | hits of the cells of the Fourier grid |
//! | [`layout`] | antennas on the ground or in the aperture plane |
//! | [`VisPlot`] | amplitude and phase against baseline length |
//! | [`ModelPlot`] | amplitudes of data and model, and what is left in units of the noise, against baseline length |
//! | [`gains`] | solved gains, with the truth where it is known |
//! | [`curves`] | lines with error bars and a legend |
//! | [`grey()`] | the pixels of a plane, without axes, as a PNG file |
//! | [`scene_picture()`], [`cause_picture()`] | a rendered scene without axes, as a PNG file |
//! | [`name_strip`] | the name of a panel of a film |
//!
//! [`View`] chooses colours, contours and part of the frame of an image.

mod agreement;
mod antennas;
mod axes;
mod canvas;
mod colors;
mod contour;
mod curves;
#[cfg(test)]
mod edges;
mod failed;
mod film;
mod gain_grid;
mod gain_values;
mod gains;
mod ghosts;
mod grey;
mod heat;
mod hits;
mod legend;
mod palette;
mod panel;
mod pdf;
mod pdf_font;
mod picture;
mod psf;
mod radial;
pub mod report;
mod scene_picture;
mod shape;
mod size;
mod sky;
mod thumbnail;
mod units;
mod uv;
mod vector;
mod view;
mod visibilities;

pub use agreement::ModelPlot;
pub use antennas::layout;
pub use curves::{CurveOptions, Series, curves};
pub use film::{inferno, name_strip};
pub use gain_values::GainQuantity;
pub use gains::{GainPlot, gains};
pub use ghosts::ghosts;
pub use grey::grey;
pub use hits::uv_mask;
pub use legend::Style;
pub use picture::{Picture, PictureFormat};
pub use psf::{is_psf, psf};
pub use scene_picture::{SceneStretch, cause_picture, scene_picture};
pub use size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
pub use sky::{ImagePlot, image, images};
pub use thumbnail::thumbnail;
pub use uv::uv_coverage;
pub use view::{Range, Stretch, View, Wish};
pub use visibilities::VisPlot;
