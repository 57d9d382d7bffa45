//! Options that several subcommands share, one group a file.

mod band;
mod clean;
mod column;
mod errors;
mod image_of;
mod imaging;
mod mem;
mod output;
mod scene;
mod selfcal;
mod terms;
mod tracer;
mod track;

pub use band::BandArgs;
pub use clean::CleanArgs;
pub use column::ColumnArgs;
pub use errors::ErrorArgs;
pub use image_of::ImageOfArgs;
pub use imaging::ImagingArgs;
pub use mem::{MemArgs, in_data_unit, prior};
pub use output::OutputArgs;
pub use scene::{SceneArgs, pictures_beside, read_scene, scene_text};
pub use selfcal::{ModeName, SolveArgs, solution_interval};
pub use terms::TermsArgs;
pub use tracer::TracerArgs;
pub use track::{TrackArgs, load_layout};
