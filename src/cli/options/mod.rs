//! Options that several subcommands share, one group a file.

mod claim;
mod column;
mod config;
mod given;
mod image_of;
mod layouts;
mod names;
mod output;
mod range;
mod region;
mod scene;
mod set;
mod tracer;

pub use claim::keep_apart;
pub use column::ColumnArgs;
pub use config::ConfigArgs;
pub use given::Given;
pub use image_of::ImageOfArgs;
pub use layouts::{load_array, load_layout};
pub use output::{NOTHING, OutputArgs};
pub use range::{foreseen_surface, model_surface, no_range, range_file, scene_surface, with_range};
pub use region::{fits_mask, loaded, prior_file, prior_image};
pub use scene::{LoadedScene, SceneArgs, pictures_beside, read_scene, read_scene_and_pictures, scene_text};
pub use set::{SetArgs, SetFiles};
pub use tracer::TracerArgs;
