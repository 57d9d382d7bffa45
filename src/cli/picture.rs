//! Pictures with the size and the title that several subcommands share.

use super::failure::Result;
use crate::plot::{self, DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::simulate::UvMask;
use cittert_arrays::ArrayLayout;

/// Antenna positions.
pub(super) fn layout(layout: &ArrayLayout) -> Result<Vec<u8>> {
    Ok(plot::layout(layout, &layout_title(layout), DEFAULT_WIDTH, DEFAULT_HEIGHT)?.png()?)
}

/// The title of a picture of antenna positions, and their number on a second line.
pub(super) fn layout_title(layout: &ArrayLayout) -> String {
    format!("{}\n{} antennas", layout.name, layout.n_ant())
}

/// Number of visibilities in the cells of the Fourier grid.
pub(super) fn mask(mask: &UvMask, title: &str) -> Result<Vec<u8>> {
    Ok(plot::uv_mask(mask, title, DEFAULT_WIDTH, DEFAULT_HEIGHT)?.png()?)
}
