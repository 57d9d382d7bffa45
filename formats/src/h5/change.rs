//! Changing single datasets in a copy of an HDF5 file. All other objects of the copy stay as they are.

use super::failure::failed;
use super::write::{H5Out, Rows, WRITTEN};
use crate::Result;
use crate::atomic::AtomicFile;
use hdf5::filters::Filter;
use hdf5::types::{FloatSize, TypeDescriptor};
use hdf5::{H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayView3, ArrayViewD, Axis, IxDyn};
use std::ops::Range;
use std::path::Path;

/// Size of the cache of chunks, bytes. Chunks of other programs may be larger than the usual cache, and would be unpacked and packed once a block.
const CACHE_BYTES: usize = 1 << 26;
/// Number of places of the cache.
const CACHE_PLACES: usize = 12_421;

/// How an existing dataset stores its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stored {
    /// 32-bit floats, or complex numbers of them.
    Single,
    /// 64-bit floats, or complex numbers of them.
    Double,
    /// Booleans, as h5py stores them.
    Boolean,
    /// Anything else.
    Other,
}

impl Stored {
    fn of(dtype: &TypeDescriptor) -> Self {
        match dtype {
            TypeDescriptor::Float(FloatSize::U4) => Self::Single,
            TypeDescriptor::Float(FloatSize::U8) => Self::Double,
            TypeDescriptor::Boolean => Self::Boolean,
            TypeDescriptor::Compound(c) => {
                let mut parts = c.fields.iter().map(|f| Self::of(&f.ty));
                let first = parts.next().unwrap_or(Self::Other);
                if parts.all(|p| p == first) { first } else { Self::Other }
            }
            _ => Self::Other,
        }
    }
}

impl H5Out {
    /// Begin with a copy of another file.
    pub(crate) fn copy_of(from: &Path, path: &Path, overwrite: bool) -> Result<Self> {
        let out = AtomicFile::create(path, overwrite)?;
        out.fill_from(from)?;
        let mut options = hdf5::File::with_options();
        let file = options.with_fapl(|p| p.chunk_cache(CACHE_PLACES, CACHE_BYTES, 0.75)).open_rw(out.path());
        let file = file.map_err(|e| failed(path, "copy of the HDF5 file", WRITTEN, &e))?;
        Ok(Self { file, out })
    }

    /// Remove an object, if there is one.
    pub(crate) fn remove(&self, name: &str) -> Result<()> {
        if self.file.link_exists(name) { self.file.unlink(name).map_err(|e| self.fail(name, &e)) } else { Ok(()) }
    }

    /// A dataset of the copy with its numbers; `None` where there is none of that name.
    pub(crate) fn existing(&self, name: &str) -> Result<Option<(Rows, Stored)>> {
        if !self.file.link_exists(name) {
            return Ok(None);
        }
        let open = || -> hdf5::Result<(Rows, Stored)> {
            let dataset = self.file.dataset(name)?;
            // Other filters change values, or can only be read.
            let plain = |f: &Filter| matches!(f, Filter::Deflate(_) | Filter::Shuffle | Filter::Fletcher32 | Filter::LZF);
            let filters_keep_all = dataset.filters().iter().all(plain);
            let stored = if filters_keep_all { Stored::of(&dataset.dtype()?.to_descriptor()?) } else { Stored::Other };
            Ok((Rows { dataset, rows: 0 }, stored))
        };
        open().map(Some).map_err(|e| self.fail(name, &e))
    }

    /// Give a dataset that grows its full number of rows.
    pub(crate) fn fill(&self, rows: &Rows, name: &str, n: usize) -> Result<()> {
        let mut shape = rows.dataset.shape();
        if let Some(first) = shape.first_mut() {
            *first = n;
        }
        rows.dataset.resize(shape).map_err(|e| self.fail(name, &e))
    }

    /// Replace rows \[row, chan, pol\] from `start` on.
    pub(crate) fn put<T: H5Type + Clone>(&self, rows: &Rows, name: &str, start: usize, values: ArrayView3<'_, T>) -> Result<()> {
        let range = start..start + values.len_of(Axis(0));
        let standard = values.as_standard_layout();
        let mut view: ArrayViewD<'_, T> = standard.view().into_dyn();
        // Old versions of the format have a second axis of length 1.
        if rows.dataset.ndim() == 4 {
            view = view.insert_axis(Axis(1));
        }
        rows.dataset.write_slice(view, selection(range, rows.dataset.ndim())).map_err(|e| self.fail(name, &e))
    }

    /// Rows of the copy, \[row, chan, pol\].
    pub(crate) fn get<T: H5Type>(&self, rows: &Rows, name: &str, range: Range<usize>) -> Result<ndarray::ArrayD<T>> {
        let ndim = rows.dataset.ndim();
        let all = rows.dataset.read_slice::<T, _, IxDyn>(selection(range, ndim)).map_err(|e| self.fail(name, &e))?;
        Ok(if ndim == 4 { all.index_axis_move(Axis(1), 0) } else { all })
    }
}

fn selection(range: Range<usize>, ndim: usize) -> Selection {
    let mut parts = vec![SliceOrIndex::from(range)];
    parts.extend((1..ndim).map(|_| SliceOrIndex::from(..)));
    Selection::new(Hyperslab::from(parts))
}
