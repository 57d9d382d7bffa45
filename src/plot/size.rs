//! The size of a picture unless another is asked for.

/// Width of a picture, pixels.
pub const DEFAULT_WIDTH: usize = 900;
/// Height of a picture, pixels.
pub const DEFAULT_HEIGHT: usize = 800;
