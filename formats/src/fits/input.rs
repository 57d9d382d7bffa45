//! A FITS file as a stream of bytes: plain, or compressed with gzip.

use crate::files::{open_file, read_up_to};
use crate::{FormatError, Result};
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// FITS files are made of blocks of this many bytes.
pub(super) const BLOCK: usize = 2880;
/// Largest compression factor of deflate. A compressed file cannot hold more than this many times its size.
const LARGEST_DEFLATE_RATIO: u64 = 1032;

/// Number of bytes after `len` bytes up to the end of the last block.
pub(crate) fn padding(len: u64) -> u64 {
    (BLOCK as u64 - len % BLOCK as u64) % BLOCK as u64
}

/// An open file with the current position and the largest possible length.
pub(crate) struct Input {
    source: Source,
    path: PathBuf,
    position: u64,
    limit: u64,
}

enum Source {
    Plain(BufReader<File>),
    Gzip(Box<BufReader<MultiGzDecoder<BufReader<File>>>>),
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::Plain(r) => r.read(buffer),
            Self::Gzip(r) => r.read(buffer),
        }
    }
}

impl Input {
    /// Open a file; a gzip-compressed file is decompressed on reading.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let mut file = open_file(path)?;
        let io = |e| FormatError::io(path, "read", e);
        let len = file.metadata().map_err(io)?.len();
        let mut magic = [0u8; 2];
        let got = read_up_to(&mut file, &mut magic).map_err(io)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        let plain = got < 2 || magic != [0x1f, 0x8b];
        let source = if plain {
            Source::Plain(BufReader::with_capacity(1 << 16, file))
        } else {
            Source::Gzip(Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(BufReader::new(file)))))
        };
        let limit = if plain { len } else { len.saturating_mul(LARGEST_DEFLATE_RATIO) };
        Ok(Self { source, path: path.into(), position: 0, limit })
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// True unless the file is compressed.
    pub(crate) fn is_plain(&self) -> bool {
        matches!(self.source, Source::Plain(_))
    }

    /// Bytes read so far.
    pub(crate) fn position(&self) -> u64 {
        self.position
    }

    /// Check that the file can hold `len` more bytes, before memory is allocated for them.
    pub(crate) fn demand(&self, place: &str, len: u64) -> Result<()> {
        let left = self.limit.saturating_sub(self.position);
        if len > left {
            let more = if self.is_plain() { "" } else { " at most, compressed as it is" };
            return Err(FormatError::malformed(
                &self.path,
                place,
                format!("{len} bytes"),
                format!("{left} bytes to the end of the file{more} (truncated, or the header is wrong)"),
            ));
        }
        Ok(())
    }

    /// Fill the buffer.
    pub(crate) fn read_exact(&mut self, place: &str, buffer: &mut [u8]) -> Result<()> {
        let got = self.read_some(buffer)?;
        if got < buffer.len() {
            return Err(FormatError::malformed(
                &self.path,
                place,
                format!("{} bytes from byte {}", buffer.len(), self.position - got as u64),
                format!("{got} bytes to the end of the file (truncated)"),
            ));
        }
        Ok(())
    }

    /// Read until the buffer is full or the file ends. Returns the number of bytes.
    pub(crate) fn read_some(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let got = read_up_to(&mut self.source, buffer).map_err(|e| match self.source {
            Source::Plain(_) => FormatError::io(&self.path, "read", e),
            Source::Gzip(_) => {
                let place = format!("gzip stream, behind byte {} of what it holds", self.position);
                FormatError::malformed(&self.path, place, "whole compressed data", e.to_string())
            }
        })?;
        self.position += got as u64;
        Ok(got)
    }

    /// Skip `len` bytes.
    pub(crate) fn skip(&mut self, place: &str, mut len: u64) -> Result<()> {
        self.demand(place, len)?;
        if let Source::Plain(reader) = &mut self.source {
            reader.seek_relative(len as i64).map_err(|e| FormatError::io(&self.path, "read", e))?;
            self.position += len;
            return Ok(());
        }
        let mut buffer = [0u8; 1 << 14];
        while len > 0 {
            let n = (len.min(buffer.len() as u64)) as usize;
            self.read_exact(place, &mut buffer[..n])?;
            len -= n as u64;
        }
        Ok(())
    }
}
