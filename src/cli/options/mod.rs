//! Options that several subcommands share, one group a file.

mod band;
mod clean;
mod column;
mod errors;
mod imaging;
mod mem;
mod output;
mod scene;
mod selfcal;
mod track;

pub use band::BandArgs;
pub use clean::CleanArgs;
pub use column::ColumnArgs;
pub use errors::ErrorArgs;
pub use imaging::ImagingArgs;
pub use mem::{MemArgs, in_data_unit};
pub use output::OutputArgs;
pub use scene::SceneArgs;
pub use selfcal::{ModeName, SolveArgs, solution_interval};
pub use track::{TrackArgs, load_layout};
