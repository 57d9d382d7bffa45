//! Writing HDF5 files: scalars and small arrays at once, large arrays in runs of rows.

use super::failure::failed;
use super::read::paths;
use super::strings;
use crate::atomic::AtomicFile;
use crate::{FormatError, Result};
use hdf5::{Dataset, Extents, Group, H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayView, Dimension};
use std::path::Path;

/// Compression of the large arrays of an HDF5 file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// None. This is fastest, and compression hardly shrinks measured visibilities.
    #[default]
    None,
    /// LZF: fast; readable by h5py and by cittert.
    Lzf,
    /// Gzip of level 1 to 9 after a shuffle of bytes; readable by every program.
    Gzip(u8),
}

/// Largest chunk, bytes. It is well below the chunk cache of 1 MiB of the library, so that appending rows never reads a chunk back.
const CHUNK_BYTES: usize = 1 << 18;

/// What the output must be, for errors.
pub(super) const WRITTEN: &str = "room on the disk and leave to write";

/// An HDF5 file being written beside its final name.
pub(crate) struct H5Out {
    // The order of the fields matters: the file must be closed before the hidden file is removed.
    pub(super) file: hdf5::File,
    pub(super) out: AtomicFile,
}

/// A dataset that grows by rows.
#[derive(Debug)]
pub(crate) struct Rows {
    pub(super) dataset: Dataset,
    pub(super) rows: usize,
}

impl H5Out {
    /// Begin a file.
    pub(crate) fn create(path: &Path, overwrite: bool) -> Result<Self> {
        let out = AtomicFile::create(path, overwrite)?;
        // The structures of HDF5 1.10 have checksums, so that damage is found on reading.
        // Without the times of its objects, a file depends on its content alone.
        let mut options = hdf5::File::with_options();
        let file = options.with_fapl(|p| p.libver_v110()).with_fcpl(|p| p.obj_track_times(false)).create(out.path());
        let file = file.map_err(|e| failed(path, "new HDF5 file", WRITTEN, &e))?;
        Ok(Self { file, out })
    }

    /// The final name.
    pub(crate) fn path(&self) -> &Path {
        self.out.target()
    }

    pub(super) fn fail(&self, name: &str, error: &hdf5::Error) -> FormatError {
        failed(self.path(), name, WRITTEN, error)
    }

    /// Create a group and its parents.
    fn group_of<'a>(&self, name: &'a str) -> Result<(Group, &'a str)> {
        let (folder, leaf) = name.rsplit_once('/').unwrap_or(("", name));
        for at in paths(folder).filter(|at| !self.file.link_exists(at)) {
            self.file.create_group_builder().obj_track_times(false).create(at).map_err(|e| self.fail(at, &e))?;
        }
        let group = if folder.is_empty() { self.file.as_group() } else { self.file.group(folder) };
        group.map(|g| (g, leaf)).map_err(|e| self.fail(name, &e))
    }

    /// A scalar.
    pub(crate) fn scalar<T: H5Type>(&self, name: &str, value: T) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        group.new_dataset::<T>().create(leaf).and_then(|d| d.write_scalar(&value)).map_err(|e| self.fail(name, &e))
    }

    /// A text, stored with exactly its length.
    pub(crate) fn text(&self, name: &str, text: &str) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        strings::write(&group, leaf, &[text], &[]).map_err(|e| self.fail(name, &e))
    }

    /// Texts in an array of the given shape.
    pub(crate) fn texts(&self, name: &str, texts: &[&str], shape: &[usize]) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        strings::write(&group, leaf, texts, shape).map_err(|e| self.fail(name, &e))
    }

    /// A whole array.
    pub(crate) fn array<T: H5Type, D: Dimension>(&self, name: &str, values: ArrayView<'_, T, D>) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        group.new_dataset_builder().with_data(values).create(leaf).map(|_| ()).map_err(|e| self.fail(name, &e))
    }

    /// An array of this shape, one element of its first axis after the other, so that it is never in memory as a whole.
    pub(crate) fn array_by_rows<T: H5Type, D: Dimension>(
        &self,
        name: &str,
        shape: &[usize],
        mut row: impl FnMut(usize) -> ndarray::Array<T, D>,
    ) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        let dataset = group.new_dataset::<T>().shape(shape).create(leaf).map_err(|e| self.fail(name, &e))?;
        for k in 0..shape.first().copied().unwrap_or(0) {
            let mut part = vec![SliceOrIndex::Index(k)];
            part.extend((1..shape.len()).map(|_| SliceOrIndex::from(..)));
            dataset.write_slice(row(k).view(), Selection::new(Hyperslab::from(part))).map_err(|e| self.fail(name, &e))?;
        }
        Ok(())
    }

    /// A dataset without a value, as h5py writes for None.
    pub(crate) fn none(&self, name: &str) -> Result<()> {
        let (group, leaf) = self.group_of(name)?;
        group.new_dataset::<f32>().shape(Extents::Null).create(leaf).map(|_| ()).map_err(|e| self.fail(name, &e))
    }

    /// A dataset that grows by rows of shape `tail`. `expected_rows`, the size of the first block, sets the size of the chunks.
    pub(crate) fn rows<T: H5Type>(&self, name: &str, tail: &[usize], expected_rows: usize, compression: Compression) -> Result<Rows> {
        let (group, leaf) = self.group_of(name)?;
        let row_bytes = (tail.iter().product::<usize>() * T::type_descriptor().size()).max(1);
        let mut chunk = vec![(CHUNK_BYTES / row_bytes).clamp(1, expected_rows.clamp(1, 8192))];
        chunk.extend_from_slice(tail);
        // A row larger than a chunk is cut along the channels.
        if let [_, channels, rest @ ..] = &mut chunk[..] {
            let one = rest.iter().product::<usize>().max(1) * T::type_descriptor().size();
            *channels = (*channels).min((CHUNK_BYTES / one).max(1));
        }
        let mut extents = vec![hdf5::Extent::resizable(0)];
        extents.extend(tail.iter().map(|n| hdf5::Extent::fixed(*n)));
        let mut builder = group.new_dataset_builder().empty::<T>().chunk(chunk);
        builder = match compression {
            Compression::None => builder,
            Compression::Lzf => builder.lzf(),
            Compression::Gzip(level) => builder.shuffle().deflate(level.min(9)),
        };
        let shape = Extents::new(hdf5::SimpleExtents::new(extents));
        let dataset = builder.shape(shape).create(leaf).map_err(|e| self.fail(name, &e))?;
        Ok(Rows { dataset, rows: 0 })
    }

    /// Append rows.
    pub(crate) fn append<T: H5Type + Clone, D: Dimension>(&self, rows: &mut Rows, name: &str, values: ArrayView<'_, T, D>) -> Result<()> {
        let n = values.shape().first().copied().unwrap_or(0);
        let mut shape = rows.dataset.shape();
        shape[0] = rows.rows + n;
        let mut parts = vec![SliceOrIndex::from(rows.rows..rows.rows + n)];
        parts.extend((1..shape.len()).map(|_| SliceOrIndex::from(..)));
        let standard = values.as_standard_layout();
        let done = rows
            .dataset
            .resize(shape.clone())
            .and_then(|()| rows.dataset.write_slice(standard.view(), Selection::new(Hyperslab::from(parts))));
        done.map_err(|e| self.fail(name, &e))?;
        rows.rows += n;
        Ok(())
    }

    /// Read back rows that were written.
    pub(crate) fn read_back<T: H5Type>(&self, rows: &Rows, name: &str, range: std::ops::Range<usize>) -> Result<ndarray::ArrayD<T>> {
        let mut parts = vec![SliceOrIndex::from(range)];
        parts.extend((1..rows.dataset.ndim()).map(|_| SliceOrIndex::from(..)));
        rows.dataset.read_slice::<T, _, ndarray::IxDyn>(Selection::new(Hyperslab::from(parts))).map_err(|e| self.fail(name, &e))
    }

    /// Flush, close and give the file its final name.
    pub(crate) fn finish(self) -> Result<()> {
        let Self { file, out } = self;
        // Closing alone may hide that the disk was full for the last bytes.
        file.flush().map_err(|e| failed(out.target(), "flush to disk", WRITTEN, &e))?;
        file.close().map_err(|e| failed(out.target(), "close", WRITTEN, &e))?;
        out.commit()
    }
}
