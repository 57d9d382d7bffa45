//! Animated PNG with a palette.
//!
//! # Reference
//! W3C 2025, Portable Network Graphics (PNG) Specification, third edition: the chunks acTL, fcTL and fdAT.

use super::writer::{FilmSpec, FilmWriter, check_frame, write_failed};
use crate::{ChainError, Result, ensure};
use png::{BitDepth, ColorType, Compression, Encoder, Filter, Writer};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// An animated PNG that is being written.
struct Apng {
    writer: Writer<BufWriter<File>>,
    pixels: usize,
    left: usize,
}

impl std::fmt::Debug for Apng {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Apng").field("pixels", &self.pixels).field("left", &self.left).finish_non_exhaustive()
    }
}

pub(super) fn create(path: &Path, spec: &FilmSpec) -> Result<Box<dyn FilmWriter>> {
    let file = BufWriter::new(File::create(path).map_err(write_failed)?);
    let mut encoder = Encoder::new(file, spec.width as u32, spec.height as u32);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(spec.palette.bytes());
    encoder.set_compression(Compression::Balanced);
    // Neighbouring levels are neighbouring entries of the palette, so differences from the row above are small.
    encoder.set_filter(Filter::Up);
    encoder.set_animated(spec.frames as u32, 0).map_err(write_failed)?;
    let (frames, seconds) = spec.rate.fraction();
    encoder.set_frame_delay(seconds, frames).map_err(write_failed)?;
    encoder.add_itxt_chunk("Software".into(), spec.history.clone()).map_err(write_failed)?;
    encoder.validate_sequence(true);
    let writer = encoder.write_header().map_err(write_failed)?;
    Ok(Box::new(Apng { writer, pixels: spec.pixels(), left: spec.frames }))
}

impl FilmWriter for Apng {
    fn frame(&mut self, levels: &[u8]) -> Result<()> {
        check_frame(levels, self.pixels)?;
        ensure!(self.left > 0, ChainError::Internal("a frame beyond the last of the film".into()));
        self.left -= 1;
        self.writer.write_image_data(levels).map_err(write_failed)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        ensure!(self.left == 0, ChainError::Internal(format!("{} frames of the film are missing", self.left)));
        self.writer.finish().map_err(write_failed)
    }
}
