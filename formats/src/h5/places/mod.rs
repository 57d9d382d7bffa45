//! Where the chunks of a dataset lie in its file.
//!
//! The library reads for one thread at a time, and always whole chunks where it hands them out as stored. With the places known, all threads
//! read at once, and of chunks without filters only the rows that are needed. The library finds a place by a search from the first chunk on, so
//! the index is read here. Two kinds are known: the B-tree of version 1, which h5py and pyuvdata write, and the extensible array, which this
//! crate writes. Every other kind, and whatever is not as it should be, is left to the library.
//!
//! A dataset without chunks lies in one piece, whose runs of rows are read as if they were chunks.
//!
//! # Reference
//! The HDF Group, HDF5 File Format Specification 3.0, sections II, III.A, IV.A and VII.

mod array;
mod header;
pub(super) mod raw;
#[cfg(test)]
mod tests;
mod tree;

use array::Array;
use header::{Index, index_of, plain};
use raw::Place;
use tree::Tree;

use hdf5::Dataset;
use hdf5::plist::file_access::FileDriver;
use hdf5_sys::h5::herr_t;
use hdf5_sys::h5f::H5Fget_vfd_handle;
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5o::H5O_info1_t;
use hdf5_sys::h5p::H5P_DEFAULT;
use std::ffi::c_uint;
use std::fs::File;
use std::ops::Range;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::ptr::null_mut;

/// Most chunks whose places are kept.
const MOST_CHUNKS: usize = 1 << 24;
/// The address is asked for, but not the sizes of indices: to sum them, the library goes through every tree, also one that goes in circles.
const BASIC: c_uint = 1;

unsafe extern "C" {
    /// Part of the library since 1.10.3, but missing in the bindings.
    fn H5Oget_info2(object: hid_t, info: *mut H5O_info1_t, fields: c_uint) -> herr_t;
}

/// The places of the chunks that some rows lie in.
pub(super) struct Places {
    file: File,
    chunks: Found,
}

/// How places are found.
enum Found {
    Listed {
        /// First row of the first chunk, rows of a chunk, and number of chunks side by side.
        start: usize,
        high: usize,
        columns: usize,
        all: Vec<Place>,
    },
    /// In a dataset that lies in one piece: where it begins, and the size of a row and of a run of rows, bytes.
    InOnePiece { begin: u64, row: u64, run: u32 },
}

impl Places {
    /// Places for some rows. `None` where the library must find the chunks.
    pub(super) fn of(dataset: &Dataset, (shape, chunk): (&[usize], &[usize]), size: usize, rows: &Range<usize>) -> Option<Self> {
        let file = opened(dataset)?;
        if !dataset.is_chunked() {
            return Self::in_one_piece((dataset, file), (shape, chunk), size);
        }
        let mut info = H5O_info1_t::default();
        // SAFETY: the struct is of the type that this function fills; the lock of the library is held.
        if hdf5::sync::sync(|| unsafe { H5Oget_info2(dataset.id(), &mut info, BASIC) }) < 0 {
            return None;
        }
        let index = index_of(&file, info.addr, (chunk, size))?;
        let counts: Vec<usize> = shape.iter().zip(chunk).map(|(n, step)| n.div_ceil(*step)).collect();
        let columns = counts[1..].iter().try_fold(1_usize, |all, n| all.checked_mul(*n))?;
        let groups = rows.start / chunk[0]..rows.end.div_ceil(chunk[0]).min(counts[0]);
        let n = groups.len().checked_mul(columns).filter(|n| *n <= MOST_CHUNKS)?;
        let start = groups.start * chunk[0];
        let all = match index {
            Index::Tree(root) => Tree::places((&file, root), (chunk, &counts), groups, n)?,
            Index::Array(array) => {
                // Its elements are in order of the chunks of the largest shape, which may differ from those of the shape of now.
                let extents = dataset.space().and_then(|s| s.extents()).ok()?;
                if !extents.iter().skip(1).all(|e| e.max == Some(e.dim)) {
                    return None;
                }
                let length = chunk.iter().try_fold(size, |n, step| n.checked_mul(*step))?;
                Array::places((&file, &array), u32::try_from(length).ok()?, groups.start.checked_mul(columns)?, n)?
            }
        };
        Some(Self { file, chunks: Found::Listed { start, high: chunk[0], columns, all } })
    }

    /// Places of runs of `chunk[0]` whole rows, of a dataset that lies in one piece.
    fn in_one_piece((dataset, file): (&Dataset, File), (shape, chunk): (&[usize], &[usize]), size: usize) -> Option<Self> {
        // Neither is known of values that lie in the header, in other files, or were never written.
        let (begin, stored) = (dataset.offset()?, dataset.storage_size());
        let bytes = |sides: &[usize]| sides.iter().try_fold(size as u64, |n, side| n.checked_mul(*side as u64));
        let (whole, row, run) = (bytes(shape)?, bytes(&shape[1..])?, u32::try_from(bytes(chunk)?).ok()?);
        let known = stored == whole && begin.checked_add(whole).is_some() && shape[1..] == chunk[1..];
        known.then_some(Self { file, chunks: Found::InOnePiece { begin, row, run } })
    }

    /// The chunk that begins at row `first`, in a column of chunks.
    pub(super) fn get(&self, first: usize, column: usize) -> Option<Place> {
        match &self.chunks {
            Found::Listed { start, high, columns, all } => {
                let group = first.checked_sub(*start)? / high;
                all.get(group * columns + column).copied()
            }
            Found::InOnePiece { begin, row, run } => Some(Place { address: begin + first as u64 * row, bytes: *run, skipped: 0 }),
        }
    }

    /// `n` bytes from an address on, in empty memory.
    pub(super) fn read(&self, address: u64, n: usize, mut bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
        bytes.reserve_exact(n);
        while bytes.len() < n {
            let at = libc::off_t::try_from(address.saturating_add(bytes.len() as u64)).map_err(std::io::Error::other)?;
            let missing = n - bytes.len();
            let rest = &mut bytes.spare_capacity_mut()[..missing];
            // SAFETY: the memory has room for as many bytes as are asked for.
            let got = unsafe { libc::pread(self.file.as_raw_fd(), rest.as_mut_ptr().cast(), missing, at) };
            match usize::try_from(got) {
                Ok(0) => return Err(std::io::ErrorKind::UnexpectedEof.into()),
                // SAFETY: so many bytes more were written. To clear the memory first would take time.
                Ok(got) => unsafe { bytes.set_len(bytes.len() + got) },
                Err(_) => {
                    let e = std::io::Error::last_os_error();
                    if e.kind() != std::io::ErrorKind::Interrupted {
                        return Err(e);
                    }
                }
            }
        }
        Ok(bytes)
    }
}

/// The file of a dataset, where the library reads it with plain system calls and does not change it.
fn opened(dataset: &Dataset) -> Option<File> {
    let file = dataset.file().ok()?;
    if !file.is_read_only() || !matches!(file.access_plist().ok()?.get_driver(), Ok(FileDriver::Sec2)) {
        return None;
    }
    let mut handle = null_mut();
    // SAFETY: gives the address of a descriptor for this driver; the lock of the library is held.
    if hdf5::sync::sync(|| unsafe { H5Fget_vfd_handle(file.id(), H5P_DEFAULT, &mut handle) }) < 0 || handle.is_null() {
        return None;
    }
    // SAFETY: the descriptor of this driver is an int, which is open as long as the file is.
    let own = unsafe { BorrowedFd::borrow_raw(*handle.cast::<libc::c_int>()) }.try_clone_to_owned().ok()?;
    let own = File::from(own);
    plain(&own)?.then_some(own)
}
