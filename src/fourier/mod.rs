//! Transforms between images and visibilities. Of the other modules only [`crate::enhance`] and [`crate::sensor`] use an FFT.
//!
//! The transform is V = sum of I exp(+2 pi i (u l + v m + w (n - 1))) over the pixels. This module computes it and its adjoint, each to a
//! relative error that the caller chooses. uvw are in metres; only this module converts them to wavelengths. Planes are \[m, l\] in the
//! order of [`cittert_arrays::SkyGrid`].
//!
//! The steps of gridding are:
//!
//! 1. Fold the rows to v >= 0, since the image is real.
//! 2. Represent the channels of a row by fewer channels where the field allows it.
//! 3. Cut the rows into runs of channels that fall into one tile of the grid.
//! 4. Spread the runs of each tile with the kernel, while the tile is in cache, and add the tile to the planes of the w term.
//! 5. Transform the planes and divide by the transform of the kernel.
//!
//! Prediction takes the same steps in the opposite order. The tests compare both with the direct sum.

mod band_degridder;
mod band_gridder;
#[cfg(test)]
mod band_tests;
mod bands;
mod batch;
mod channels;
mod convolve;
mod degridder;
mod fft;
#[cfg(test)]
pub(crate) mod fixtures;
mod grid_options;
mod gridder;
mod kernel;
mod known;
mod lanes;
mod letter_parts;
mod line_fft;
mod mirrored;
mod nodes;
mod own_columns;
mod owners;
mod pair;
mod parcels;
pub(crate) mod phasor;
mod plan;
mod plane_groups;
mod plane_rows;
mod pool;
mod real;
mod schedule;
mod series;
mod shared_gridder;
#[cfg(test)]
mod shared_tests;
mod size;
mod sort;
mod sorted_rows;
mod stored_columns;
#[cfg(test)]
mod tests;
mod tile_work;
mod transform;
#[cfg(test)]
mod transform_tests;
mod turns;
mod units;
mod uv_grid;
mod wplanes;

pub use band_degridder::BandDegridder;
pub use band_gridder::BandGridder;
pub use bands::Bands;
pub use convolve::{Convolver, Filter, RealSpectrum, Spectrum};
pub use degridder::Degridder;
pub use grid_options::GridOptions;
pub use gridder::Gridder;
pub use kernel::Kernel;
pub(crate) use line_fft::good_size;
pub use mirrored::MirrorConvolver;
pub use nodes::{NodeParts, Nodes, SetNodes};
pub use pair::Pair;
pub use parcels::OpenLetters;
pub use plan::UvwExtent;
pub use real::Real;
pub(crate) use real::in_precision;
pub use schedule::Idle;
pub use shared_gridder::SharedGridder;
pub use size::{BandSize, TransformSize};
pub use sorted_rows::{FoldedRows, SortedRows};
pub use tile_work::SampleOfRows;
pub use transform::{PassWork, Transform};
pub use uv_grid::image_to_uv_grid;
