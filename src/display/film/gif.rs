//! GIF with one palette for all frames.
//!
//! # Reference
//! CompuServe 1990, Graphics Interchange Format, version 89a.

use super::lzw::{LEVEL_BITS, compress};
use super::rate::FrameRate;
use super::writer::{FilmSpec, FilmWriter, check_frame, write_failed};
use crate::{ChainError, Result, ensure};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Most bytes of a block.
const BLOCK: usize = 255;

/// A GIF that is being written.
#[derive(Debug)]
struct Gif {
    file: BufWriter<File>,
    size: [u8; 4],
    pixels: usize,
    rate: FrameRate,
    frames: usize,
    written: usize,
}

pub(super) fn create(path: &Path, spec: &FilmSpec) -> Result<Box<dyn FilmWriter>> {
    let file = BufWriter::new(File::create(path).map_err(write_failed)?);
    let [w, h] = [spec.width, spec.height].map(|n| (n as u16).to_le_bytes());
    let size = [w[0], w[1], h[0], h[1]];
    let mut gif = Gif { file, size, pixels: spec.pixels(), rate: spec.rate, frames: spec.frames, written: 0 };
    gif.head(spec).map_err(write_failed)?;
    Ok(Box::new(gif))
}

impl Gif {
    fn head(&mut self, spec: &FilmSpec) -> io::Result<()> {
        self.file.write_all(b"GIF89a")?;
        self.file.write_all(&self.size)?;
        // A palette of 256 colours of 8 bits for all frames; background 0; square pixels.
        self.file.write_all(&[0b1111_0111, 0, 0])?;
        self.file.write_all(&spec.palette.bytes())?;
        // Without this extension, programs play a film once.
        self.file.write_all(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")?;
        self.file.write_all(b"\x21\xfe")?;
        self.blocks(spec.history.as_bytes())
    }

    fn blocks(&mut self, bytes: &[u8]) -> io::Result<()> {
        for block in bytes.chunks(BLOCK) {
            self.file.write_all(&[block.len() as u8])?;
            self.file.write_all(block)?;
        }
        self.file.write_all(&[0])
    }

    /// Hundredths of a second from the start of the film to the start of a frame.
    fn start(&self, frame: usize) -> u64 {
        (100.0 * frame as f64 / self.rate.hz()).round() as u64
    }

    fn image(&mut self, levels: &[u8]) -> io::Result<()> {
        // Rounding the times and not their differences keeps the length of the film.
        let delay = (self.start(self.written + 1) - self.start(self.written)).min(u64::from(u16::MAX)) as u16;
        let delay = delay.to_le_bytes();
        self.file.write_all(&[0x21, 0xf9, 4, 0b0000_0100, delay[0], delay[1], 0, 0])?;
        self.file.write_all(&[0x2c, 0, 0, 0, 0])?;
        self.file.write_all(&self.size)?;
        self.file.write_all(&[0, LEVEL_BITS])?;
        self.blocks(&compress(levels))
    }
}

impl FilmWriter for Gif {
    fn frame(&mut self, levels: &[u8]) -> Result<()> {
        check_frame(levels, self.pixels)?;
        self.image(levels).map_err(write_failed)?;
        self.written += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let missing = self.frames.abs_diff(self.written);
        ensure!(missing == 0, ChainError::Internal(format!("{} of {} frames of the film were written", self.written, self.frames)));
        self.file.write_all(&[0x3b]).and_then(|()| self.file.flush()).map_err(write_failed)
    }
}
