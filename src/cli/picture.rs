//! Pictures as bytes of a PNG, titled for the command line.

use super::failure::Result;
use crate::plot;
use crate::simulate::UvMask;
use cittert_arrays::{ArrayLayout, Image};

const SIZE: (usize, usize) = (plot::DEFAULT_WIDTH, plot::DEFAULT_HEIGHT);

/// Antenna positions.
pub(super) fn layout(layout: &ArrayLayout) -> Result<Vec<u8>> {
    let title = format!("{}, {} antennas", layout.name, layout.n_ant());
    Ok(plot::layout(layout, &title, SIZE.0, SIZE.1)?)
}

/// Hits of the cells of the Fourier grid.
pub(super) fn mask(mask: &UvMask, title: &str) -> Result<Vec<u8>> {
    Ok(plot::uv_mask(mask, title, SIZE.0, SIZE.1)?)
}

/// One plane of an image.
pub(super) fn image(image: &Image, options: &plot::ImagePlot) -> Result<Vec<u8>> {
    Ok(plot::image(image, options)?)
}
