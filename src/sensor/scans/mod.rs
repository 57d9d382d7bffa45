//! The order in which detectors see the scene. A new pattern is a file in this folder and a row of [`SCANS`].

mod array;
mod conical;
mod kind;
mod pattern;
mod pushbroom;
mod raster;
mod samples;
mod table;

pub(super) use kind::Field;
pub use kind::ScanKind;
pub use pattern::ScanPattern;
pub(super) use samples::Samples;
pub use table::SCANS;
