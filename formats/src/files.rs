//! Opening files, and their names and first bytes, as every format needs them.

use crate::{FormatError, Result};
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// Largest text that is read, bytes.
pub(crate) const LARGEST_TEXT: u64 = 64 << 20;

/// Refuse a path that leads to a pipe, a device or a socket. To open a pipe would wait for another program, and some devices have no end. A
/// path that leads nowhere is not refused here.
///
/// # Errors
/// A path that leads to something else than a file or a directory.
pub fn refuse_special(path: &Path) -> Result<()> {
    let Ok(meta) = std::fs::metadata(path) else { return Ok(()) };
    let kind = meta.file_type();
    let found = match kind {
        _ if kind.is_file() || kind.is_dir() => return Ok(()),
        _ if kind.is_fifo() => "a named pipe",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    };
    let expected = "a regular file (copy what it gives into a file first)".into();
    Err(FormatError::NotA { path: path.into(), expected, found: format!("it is {found}") })
}

/// The text of a file of at most 64 MiB.
///
/// # Errors
/// A file that is missing, not regular, too large or not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    refuse_special(path)?;
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    file.take(LARGEST_TEXT + 1).read_to_end(&mut bytes).map_err(|e| FormatError::io(path, "read", e))?;
    let not = |found: &str| FormatError::NotA { path: path.into(), expected: "a text of at most 64 MiB".into(), found: found.into() };
    if bytes.len() as u64 > LARGEST_TEXT {
        return Err(not("it is larger"));
    }
    String::from_utf8(bytes).map_err(|_| not("it is not UTF-8 text"))
}

/// Open a file to read. A directory and an empty file are errors.
pub(crate) fn open_file(path: &Path) -> Result<File> {
    refuse_special(path)?;
    let meta = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    if meta.is_dir() {
        return Err(FormatError::not_a(path, "a file", "it is a directory"));
    }
    if meta.is_file() && meta.len() == 0 {
        return Err(FormatError::not_a(path, "a file with content", "the file is empty"));
    }
    File::open(path).map_err(|e| FormatError::io(path, "open", e))
}

/// Read until the buffer is full or the input ends.
pub(crate) fn read_up_to(reader: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut got = 0;
    while got < buffer.len() {
        match reader.read(&mut buffer[got..]) {
            Ok(0) => break,
            Ok(n) => got += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(got)
}

/// Number of bytes at the start of a file by which formats recognise it.
pub(crate) const START_BYTES: usize = 2880 * 4;

/// The first bytes of a file, at most [`START_BYTES`].
pub(crate) fn start_of(path: &Path) -> Result<Vec<u8>> {
    let mut start = vec![0; START_BYTES];
    let n = read_up_to(&mut open_file(path)?, &mut start).map_err(|e| FormatError::io(path, "read", e))?;
    start.truncate(n);
    Ok(start)
}

/// Ending of a file name in small letters, without the dot; empty where there is none.
pub(crate) fn extension_of(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// What a file of no known format seems to be, for the error.
pub(crate) fn describe(start: &[u8]) -> String {
    let known: [(&[u8], &str); 8] = [
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file without visibilities or gains"),
        (b"SIMPLE  =", "a FITS file"),
        (b"\x1f\x8b", "a gzip-compressed file"),
        (b"PK\x03\x04", "a zip archive"),
        (b"%PDF", "a PDF document"),
        (b"BZh", "a bzip2-compressed file"),
    ];
    if let Some((_, name)) = known.iter().find(|(magic, _)| start.starts_with(magic)) {
        return (*name).into();
    }
    let head = &start[..start.len().min(16)];
    let shown: String = head.iter().map(|b| b.escape_ascii().to_string()).collect();
    let text = start.iter().take(512).all(|b| *b >= 32 || b.is_ascii_whitespace());
    format!("{} that begins with \"{shown}\"", if text { "a text" } else { "a file of unknown kind" })
}
