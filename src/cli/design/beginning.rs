//! What every tab begins with.

use super::scenes::Scenes;
use crate::cli::context::Subcommands;
use cittert_arrays::ArrayLayout;
use std::sync::Arc;

/// What every tab begins with.
pub(super) struct Beginning {
    pub(super) layout: ArrayLayout,
    pub(super) freq_hz: f64,
    pub(super) scene: String,
    pub(super) scenes: Arc<Scenes>,
    pub(super) subcommands: Subcommands,
}
