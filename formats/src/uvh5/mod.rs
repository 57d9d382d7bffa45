//! UVH5, the native format: HDF5 with a Header of named arrays and a Data group, version 1.2.
//!
//! # Reference
//! Hazelton et al. 2017, JOSS 2, 140 (pyuvdata); the UVH5 memo of that project.

mod header;
mod layout;
mod phase;
mod read;
mod write;

pub use read::Uvh5Reader;
pub use write::{Uvh5Options, Uvh5Writer};

pub(crate) use header::{read_spectrum, write_spectrum};
pub(crate) use layout::{read_telescope, site_of, unique_names, write_telescope};
pub(crate) use phase::Sky;

use cittert_arrays::Site;

/// Where the array of a boresight layout is placed for programs that know only the Earth: on the equator at longitude 0, where
/// east, north and up are the axes y, z and x of the geocentric frame, so that positions keep every digit.
pub const NOMINAL_SITE: Site = Site { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 0.0 };

/// Keyword (of `extra_keywords`) and value that mark a set in the boresight frame.
const FRAME_KEYWORD: &str = "cittert_frame";
const BORESIGHT: &str = "boresight";
/// Keyword of the temperature that was removed from the scene, K.
const PEDESTAL_KEYWORD: &str = "pedestal_k";
/// Keyword of the name of the layout, where it is not the telescope's.
const LAYOUT_KEYWORD: &str = "cittert_layout";
/// Keyword of the source of the antenna positions.
const SOURCE_KEYWORD: &str = "cittert_layout_source";
/// Group of antenna properties that UVH5 has no place for.
const ANTENNA_GROUP: &str = "Cittert";

/// Where the visibilities of a column are kept. Other programs know the first one and pass over the others.
fn dataset_of(column: crate::VisColumn) -> &'static str {
    match column {
        crate::VisColumn::Data => "Data/visdata",
        crate::VisColumn::Model => "Data/model",
        crate::VisColumn::Corrected => "Data/corrected",
        crate::VisColumn::Residual => "Data/residual",
    }
}
