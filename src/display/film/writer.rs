//! What a film is, and what writes it.

use super::rate::FrameRate;
use crate::display::tone::Palette;
use crate::{ChainError, Result, ensure};
use std::fmt;

/// What a film looks like.
#[derive(Debug, Clone)]
pub struct FilmSpec {
    /// Columns of a frame, pixels.
    pub width: usize,
    /// Rows of a frame, pixels.
    pub height: usize,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second, at which the film plays.
    pub rate: FrameRate,
    /// Colours of the levels 0 to 255.
    pub palette: Palette,
    /// How the film was made, for formats with a place for it.
    pub history: String,
}

impl FilmSpec {
    /// Number of pixels of a frame.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }
}

/// Writes the frames of a film.
pub trait FilmWriter: fmt::Debug + Send {
    /// Write the next frame: a level for each pixel, the upper row first. // [row, column]
    ///
    /// # Errors
    /// A frame of another size, an error of the file system, or that of the encoder.
    fn frame(&mut self, levels: &[u8]) -> Result<()>;

    /// Write what is left, when all frames have been written.
    ///
    /// # Errors
    /// As [`FilmWriter::frame`].
    fn finish(self: Box<Self>) -> Result<()>;
}

/// Refuse a frame of another size than the film.
pub(super) fn check_frame(levels: &[u8], pixels: usize) -> Result<()> {
    let told = || ChainError::Internal(format!("a frame of {} pixels in a film of {pixels}", levels.len()));
    ensure!(levels.len() == pixels, told());
    Ok(())
}

pub(super) fn write_failed(error: impl fmt::Display) -> ChainError {
    ChainError::Other(format!("the film cannot be written: {error}").into())
}
