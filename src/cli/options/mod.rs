//! Options that several subcommands share, one group a file.

mod band;
mod imaging;
mod output;
mod scene;
mod track;

pub use band::BandArgs;
//PENDING pub use imaging::{CleanArgs, ImagingArgs};
pub use output::OutputArgs;
pub use scene::SceneArgs;
pub use track::{TrackArgs, load_layout};
