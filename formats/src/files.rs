//! Files opened to read, with the refusals that every format shares.

use crate::{FormatError, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Open a regular file to read; a directory or an empty file is refused by name.
pub(crate) fn open_file(path: &Path) -> Result<File> {
    let meta = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    if meta.is_dir() {
        return Err(FormatError::NotA { path: path.into(), expected: "a file".into(), found: "it is a directory".into() });
    }
    if meta.is_file() && meta.len() == 0 {
        return Err(FormatError::NotA { path: path.into(), expected: "a file with content".into(), found: "the file is empty".into() });
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
