//! The default size of a picture.

/// Width of a picture, pixels.
pub const DEFAULT_WIDTH: usize = 900;
/// Height of a picture, pixels.
pub const DEFAULT_HEIGHT: usize = 800;
