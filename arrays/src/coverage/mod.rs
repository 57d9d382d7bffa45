//! The rows of a visibility set: which baseline is observed when, and where its uvw lies.

mod plan;
mod rows;
mod track;

pub use plan::CoveragePlan;
pub use rows::UvCoverage;
pub(crate) use rows::append_rows;
pub use track::Track;
