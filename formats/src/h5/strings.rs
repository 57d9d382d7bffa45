//! Texts in HDF5: fixed length (read and written) and variable length (read only).
//!
//! The safe bindings support fixed-length texts only for lengths known at compile time, so these lines call the C library.

use super::chunks::Chunks;
use super::convert::Form;
use hdf5::types::{TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Dataset, Group};
use hdf5_sys::h5d::{H5Dread, H5Dwrite};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::H5S_ALL;

/// Largest text that is read, bytes.
const LARGEST_TEXT: usize = 1 << 26;

/// Write texts as a dataset of fixed-length ASCII, exactly as long as the longest; an empty shape makes a scalar of one text.
pub(super) fn write(group: &Group, name: &str, texts: &[&str], shape: &[usize]) -> hdf5::Result<()> {
    if shape.iter().product::<usize>() != texts.len() {
        return Err(format!("{} texts do not fill the shape {shape:?}", texts.len()).into());
    }
    let width = texts.iter().map(|t| t.len()).max().unwrap_or(0).max(1);
    let dataset = group.new_dataset_builder().empty_as(TypeDescriptor::FixedAscii(width)).shape(shape).create(name)?;
    let mut buffer = vec![0u8; width * texts.len()];
    for (slot, text) in buffer.chunks_exact_mut(width).zip(texts) {
        slot[..text.len()].copy_from_slice(text.as_bytes());
    }
    if buffer.is_empty() {
        return Ok(());
    }
    let dtype = dataset.dtype()?;
    // SAFETY: the buffer holds width bytes for each element of the dataset, whose type is text of that width; the lock is held.
    let status = hdf5::sync::sync(|| unsafe { H5Dwrite(dataset.id(), dtype.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer.as_ptr().cast()) });
    if status < 0 { Err(format!("cannot write the text {name}").into()) } else { Ok(()) }
}

/// Read all texts of a dataset, without trailing NUL bytes and blanks. `None` where the dataset holds no texts.
pub(super) fn read(dataset: &Dataset, file_bytes: u64) -> hdf5::Result<Option<Vec<String>>> {
    let clean = |bytes: &[u8]| {
        let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
        String::from_utf8_lossy(&bytes[..end]).trim_end().to_string()
    };
    let dtype = dataset.dtype()?;
    let n = dataset.space()?.size();
    let rows = 0..dataset.shape().first().copied().unwrap_or(0);
    let guard = |bytes: usize| -> hdf5::Result<()> {
        if bytes > LARGEST_TEXT || bytes as u64 > file_bytes.saturating_mul(1100) {
            return Err(format!("{n} texts of {bytes} bytes in all are more than the file can hold").into());
        }
        Ok(())
    };
    match dtype.to_descriptor()? {
        TypeDescriptor::FixedAscii(width) | TypeDescriptor::FixedUnicode(width) => {
            let bytes = width.saturating_mul(n);
            guard(bytes)?;
            let mut buffer = vec![0u8; bytes];
            if let Some(chunks) = Chunks::of(dataset, rows.clone())? {
                chunks.read(rows, (&mut buffer, Form::Stored))?;
            } else if bytes > 0 {
                // SAFETY: the buffer holds the dataset's own element size times its number of elements; the lock is held.
                let status = hdf5::sync::sync(|| unsafe {
                    H5Dread(dataset.id(), dtype.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer.as_mut_ptr().cast())
                });
                if status < 0 {
                    return Err("cannot read the text".into());
                }
            }
            Ok(Some(buffer.chunks_exact(width.max(1)).map(clean).collect()))
        }
        TypeDescriptor::VarLenAscii => {
            references(dataset, &guard)?;
            Ok(Some(dataset.read_raw::<VarLenAscii>()?.iter().map(|t| clean(t.as_bytes())).collect()))
        }
        TypeDescriptor::VarLenUnicode => {
            references(dataset, &guard)?;
            Ok(Some(dataset.read_raw::<VarLenUnicode>()?.iter().map(|t| clean(t.as_bytes())).collect()))
        }
        _ => Ok(None),
    }
}

/// Check the chunks of references to texts. The library follows such references without a check.
fn references(dataset: &Dataset, guard: &dyn Fn(usize) -> hdf5::Result<()>) -> hdf5::Result<()> {
    let bytes = dataset.dtype()?.size().saturating_mul(dataset.size());
    guard(bytes)?;
    let rows = 0..dataset.shape().first().copied().unwrap_or(0);
    let Some(chunks) = Chunks::of(dataset, rows.clone())? else { return Ok(()) };
    chunks.read(rows, (&mut vec![0; bytes], Form::Stored))
}
