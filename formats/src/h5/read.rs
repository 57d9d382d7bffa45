//! Reading HDF5 files: scalars, texts and small arrays by name, large arrays in runs of rows.

use super::chunks::Chunks;
use super::failure::failed;
use super::flaws::is_elsewhere;
use super::{contiguous, convert, parts, strings};
use crate::{FormatError, Result};
use bytemuck::Pod;
use cittert_arrays::RowPart;
use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, H5Type, Hyperslab, Selection, SliceOrIndex};
use hdf5_sys::h5l::{H5L_type_t::H5L_TYPE_EXTERNAL, H5Lunregister};
use ndarray::{ArrayD, Dimension};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Once;

/// Largest factor by which the filters can shrink data, approximately.
const LARGEST_RATIO: u64 = 1100;
/// A chunk below this size (bytes) is read even where it is large compared to the file.
const SMALL_CHUNK: u64 = 1 << 24;
/// Largest number of elements of an array that is read at once.
const MOST_WHOLE: usize = 1 << 24;
/// Number of the bitshuffle filter in HDF5.
const BITSHUFFLE: i32 = 32008;

/// What a dataset must be, for errors.
pub(super) const SOUND: &str = "data that can be read (are they damaged?)";

/// Shape of a dataset.
type Shape = Vec<usize>;

/// The groups on the way to a name, and the name itself.
pub(super) fn paths(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('/').map(|(end, _)| &name[..end]).chain([name]).filter(|at| !at.is_empty())
}

/// An open HDF5 file.
pub(crate) struct H5In {
    file: hdf5::File,
    path: PathBuf,
    bytes: u64,
}

/// Make the library unable to follow a link to another file, in the whole process. The probe names such links before they are met.
fn follow_no_links() {
    static ONCE: Once = Once::new();
    // SAFETY: a plain call; the lock of the library is held.
    ONCE.call_once(|| {
        hdf5::sync::sync(|| unsafe { H5Lunregister(H5L_TYPE_EXTERNAL) });
    });
}

impl H5In {
    /// Open a file without the probe of [`super::open`].
    pub(super) fn open_unprobed(path: &Path) -> Result<Self> {
        let bytes = std::fs::metadata(path).map_err(|e| FormatError::io(path, "read", e))?.len();
        follow_no_links();
        // Without a chunk cache the library reads a chunk by its true size. With a cache it trusts the size that the file states.
        let open = hdf5::File::with_options().with_fapl(|p| p.chunk_cache(1, 0, 1.0)).open(path);
        let file = open.map_err(|e| failed(path, "HDF5 structure", "a whole file (is it truncated or damaged?)", &e))?;
        Ok(Self { file, path: path.into(), bytes })
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// True where every part of a path leads somewhere. The library reports an error for a path through a missing group.
    fn linked(&self, name: &str) -> bool {
        paths(name).all(|at| self.file.link_exists(at))
    }

    /// The dataset of that name, where there is one.
    pub(crate) fn dataset(&self, name: &str) -> Result<Option<Dataset>> {
        if !self.linked(name) {
            return Ok(None);
        }
        let dataset = self.file.dataset(name).map_err(|e| failed(&self.path, name, SOUND, &e))?;
        if is_elsewhere(&dataset) {
            return Err(self.wrong(name, "values in this file", "values in another file, which is not opened"));
        }
        Ok(Some(dataset))
    }

    /// The dataset of that name, or an error that names it.
    pub(crate) fn require(&self, name: &str) -> Result<Dataset> {
        self.dataset(name)?.ok_or_else(|| self.missing(name))
    }

    /// True where there is a group or dataset of that name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.dataset(name).map_or(true, |d| d.is_some()) || self.group(name).is_some()
    }

    /// The group of that name; the empty name is the root.
    pub(super) fn group(&self, name: &str) -> Option<hdf5::Group> {
        let group = || self.file.group(if name.is_empty() { "/" } else { name }).ok();
        self.linked(name).then(group).flatten()
    }

    /// Names in a group; none where there is no such group.
    pub(crate) fn members(&self, group: &str) -> Result<Vec<String>> {
        match self.group(group) {
            Some(g) => g.member_names().map_err(|e| failed(&self.path, group, SOUND, &e)),
            None => Ok(Vec::new()),
        }
    }

    /// `name` is not in the file.
    pub(crate) fn missing(&self, name: &str) -> FormatError {
        FormatError::malformed(&self.path, name, "a dataset of this name", "none")
    }

    /// The content of `name` is not what was expected.
    pub(crate) fn wrong(&self, name: &str, expected: impl Into<String>, found: impl Into<String>) -> FormatError {
        FormatError::malformed(&self.path, name, expected, found)
    }

    fn fail(&self, name: &str, error: &hdf5::Error) -> FormatError {
        failed(&self.path, name, SOUND, error)
    }

    /// Shape of a dataset, after checks that the file can hold what it claims and that its filters are known.
    pub(crate) fn shape(&self, dataset: &Dataset, name: &str) -> Result<Shape> {
        let shape = dataset.get_shape().map_err(|e| self.fail(name, &e))?;
        if shape.contains(&0) {
            return Ok(shape);
        }
        for filter in dataset.filters() {
            if !filter.is_available() {
                let hint = if filter.id() == BITSHUFFLE { " (bitshuffle): rewrite the file with gzip, lzf or no compression" } else { "" };
                return Err(FormatError::unsupported(&self.path, format!("{name} is compressed with HDF5 filter {}{hint}", filter.id())));
            }
        }
        let size = dataset.dtype().map_err(|e| self.fail(name, &e))?.size() as u64;
        let claimed = shape.iter().try_fold(size, |n, s| n.checked_mul(*s as u64)).unwrap_or(u64::MAX);
        let held = dataset.storage_size().min(self.bytes);
        let chunks = dataset.chunk().unwrap_or_default();
        if claimed > held.saturating_mul(if chunks.is_empty() { 1 } else { LARGEST_RATIO }) {
            return Err(self.wrong(
                name,
                format!("data for its shape {shape:?}"),
                format!("{held} bytes stored (damaged, or never written)"),
            ));
        }
        // The library trusts these sizes and reads beyond its buffers where they are wrong.
        let extents = dataset.space().and_then(|s| s.extents()).map_err(|e| self.fail(name, &e))?;
        let limits = extents.iter().map(|e| e.max.unwrap_or(usize::MAX));
        if chunks.iter().zip(limits).any(|(c, most)| *c > most) {
            return Err(self.wrong(name, format!("chunks within its shape {shape:?}"), format!("chunks of {chunks:?}")));
        }
        let chunk = chunks.iter().try_fold(size, |n, s| n.checked_mul(*s as u64)).unwrap_or(u64::MAX);
        if chunk > SMALL_CHUNK && chunk > self.bytes.saturating_mul(LARGEST_RATIO) {
            return Err(self.wrong(name, "chunks no larger than the file", format!("chunks of {chunk} bytes")));
        }
        Ok(shape)
    }

    /// All numbers of a dataset as 64-bit floats (booleans as 0 and 1), with its shape; `None` where there is no such dataset or it is empty.
    pub(crate) fn reals(&self, name: &str) -> Result<Option<(Shape, Vec<f64>)>> {
        let Some(dataset) = self.dataset(name)? else { return Ok(None) };
        let space = dataset.space().map_err(|e| self.fail(name, &e))?;
        if space.is_null() {
            return Ok(None);
        }
        let shape = self.shape(&dataset, name)?;
        if dataset.size() > MOST_WHOLE {
            return Err(self.wrong(name, format!("at most {MOST_WHOLE} numbers"), format!("shape {shape:?}")));
        }
        let values = match self.number_kind(&dataset, name)? {
            Number::Real => self.all::<f64>(&dataset),
            // 64-bit integers are exact up to 2^53, far more than any count or number in these files.
            Number::Integer => self.all::<i64>(&dataset).map(|v| v.into_iter().map(|i| i as f64).collect()),
            Number::Enum => self.all::<i8>(&dataset).map(|v| v.into_iter().map(f64::from).collect()),
        };
        Ok(Some((shape, values.map_err(|e| self.fail(name, &e))?)))
    }

    /// All values of a dataset, converted by the library to `T`.
    pub(super) fn all<T: H5Type + Pod>(&self, dataset: &Dataset) -> hdf5::Result<Vec<T>> {
        let rows = dataset.shape().first().copied().unwrap_or(0);
        match Chunks::of(dataset, 0..rows)? {
            Some(chunks) => convert::values(dataset, dataset.size(), |out, form| chunks.read(0..rows, (out, form))),
            None => dataset.read_raw::<T>(),
        }
    }

    /// As [`H5In::shaped`], and refuse anything but numbers and booleans.
    pub(crate) fn numbers(&self, name: &str, expected: &[&[usize]]) -> Result<Dataset> {
        let dataset = self.shaped(name, expected)?;
        self.number_kind(&dataset, name)?;
        Ok(dataset)
    }

    /// As [`H5In::numbers`], where there is a dataset of that name.
    pub(crate) fn optional_numbers(&self, name: &str, expected: &[&[usize]]) -> Result<Option<Dataset>> {
        self.dataset(name)?.map(|_| self.numbers(name, expected)).transpose()
    }

    /// Refuse anything but complex numbers: compounds of r and i. The library would leave a missing part uninitialised.
    pub(crate) fn demand_complex(&self, dataset: &Dataset, name: &str) -> Result<()> {
        let dtype = dataset.dtype().and_then(|d| d.to_descriptor()).map_err(|e| self.fail(name, &e))?;
        let number = |t: &TypeDescriptor| matches!(t, TypeDescriptor::Float(_) | TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_));
        if let TypeDescriptor::Compound(c) = &dtype
            && c.fields.len() == 2
            && ["r", "i"].iter().all(|name| c.fields.iter().any(|f| f.name == *name && number(&f.ty)))
        {
            return Ok(());
        }
        Err(self.wrong(name, "complex numbers (a compound of r and i)", dtype.to_string()))
    }

    /// The dataset of that name with one of the expected shapes, after the checks of [`H5In::shape`].
    pub(crate) fn shaped(&self, name: &str, expected: &[&[usize]]) -> Result<Dataset> {
        let dataset = self.require(name)?;
        let shape = self.shape(&dataset, name)?;
        if !expected.contains(&shape.as_slice()) {
            return Err(self.wrong(name, format!("shape {:?}", expected[0]), format!("{shape:?}")));
        }
        Ok(dataset)
    }

    pub(super) fn number_kind(&self, dataset: &Dataset, name: &str) -> Result<Number> {
        let dtype = dataset.dtype().and_then(|d| d.to_descriptor()).map_err(|e| self.fail(name, &e))?;
        match dtype {
            TypeDescriptor::Float(_) => Ok(Number::Real),
            TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => Ok(Number::Integer),
            TypeDescriptor::Boolean | TypeDescriptor::Enum(_) => Ok(Number::Enum),
            other => Err(self.wrong(name, "numbers", other.to_string())),
        }
    }

    /// The number of a dataset that holds one; `None` where there is no such dataset or it is empty.
    pub(crate) fn real(&self, name: &str) -> Result<Option<f64>> {
        match self.reals(name)? {
            None => Ok(None),
            Some((shape, values)) => match values[..] {
                [] => Ok(None),
                [value] => Ok(Some(value)),
                _ => Err(self.wrong(name, "one number", format!("shape {shape:?}"))),
            },
        }
    }

    /// The number of a dataset that must be there.
    pub(crate) fn require_real(&self, name: &str) -> Result<f64> {
        self.real(name)?.ok_or_else(|| self.missing(name))
    }

    /// A count that must be there and must not be negative.
    pub(crate) fn count(&self, name: &str) -> Result<usize> {
        let value = self.require_real(name)?;
        if value >= 0.0 && value.fract() == 0.0 && value < 1e18 {
            return Ok(value as usize);
        }
        Err(self.wrong(name, "a count", value.to_string()))
    }

    /// All numbers of a dataset that must be there, with one axis of `len`.
    pub(crate) fn list(&self, name: &str, len: usize) -> Result<Vec<f64>> {
        let (shape, values) = self.reals(name)?.ok_or_else(|| self.missing(name))?;
        if values.len() != len {
            return Err(self.wrong(name, format!("{len} numbers"), format!("shape {shape:?}")));
        }
        Ok(values)
    }

    /// Texts of a dataset; `None` where there is no such dataset or it holds no texts.
    pub(crate) fn texts(&self, name: &str) -> Result<Option<Vec<String>>> {
        let Some(dataset) = self.dataset(name)? else { return Ok(None) };
        if dataset.space().map_err(|e| self.fail(name, &e))?.is_null() {
            return Ok(None);
        }
        self.shape(&dataset, name)?;
        self.strings(&dataset).map_err(|e| self.fail(name, &e))
    }

    /// Texts of an open dataset.
    pub(super) fn strings(&self, dataset: &Dataset) -> hdf5::Result<Option<Vec<String>>> {
        strings::read(dataset, self.bytes)
    }

    /// First text of a dataset.
    pub(crate) fn text(&self, name: &str) -> Result<Option<String>> {
        Ok(self.texts(name)?.and_then(|t| t.into_iter().next()))
    }

    /// True if rows of these datasets can be read in parts.
    pub(crate) fn has_parts(&self, datasets: parts::Three<'_>) -> bool {
        parts::can(datasets)
    }

    /// Bytes of chunks that are in memory at once while these datasets are read in parts.
    pub(crate) fn held_of_parts(&self, datasets: parts::Three<'_>) -> usize {
        parts::held(datasets)
    }

    /// Read rows of these datasets and give them to `take` in parts of `step` rows, in any order and on any thread.
    pub(crate) fn parts(
        &self,
        (datasets, names): (parts::Three<'_>, [&str; 3]),
        (rows, step): (Range<usize>, usize),
        take: &(dyn Fn(RowPart<'_>) + Sync),
    ) -> Result<()> {
        parts::read(datasets, rows.clone(), step, take).map_err(|(k, e)| self.fail(&some_rows(names[k], &rows), &e))
    }

    /// Rows of a dataset, converted by the library to `T`.
    pub(crate) fn rows<T: H5Type + Pod, D: Dimension>(
        &self,
        dataset: &Dataset,
        name: &str,
        rows: Range<usize>,
    ) -> Result<ndarray::Array<T, D>> {
        let mut parts = vec![SliceOrIndex::from(rows.clone())];
        parts.extend((1..dataset.ndim()).map(|_| SliceOrIndex::from(..)));
        let place = |e: &hdf5::Error| self.fail(&some_rows(name, &rows), e);
        let read = || match Chunks::of(dataset, rows.clone())? {
            Some(chunks) => {
                let mut shape = dataset.shape();
                shape[0] = rows.len();
                let values = convert::values(dataset, shape.iter().product(), |out, form| chunks.read(rows.clone(), (out, form)))?;
                ArrayD::from_shape_vec(shape, values).map_err(|e| hdf5::Error::from(e.to_string()))
            }
            None => match contiguous::tiles::<T>(dataset, rows.len()) {
                Some(parts) => contiguous::read(dataset, rows.clone(), &parts),
                None => dataset.read_slice::<T, _, ndarray::IxDyn>(Selection::new(Hyperslab::from(parts))),
            },
        };
        let mut all: ArrayD<T> = read().map_err(|e| place(&e))?;
        // Old versions of the format have a fourth axis of length 1, which is removed.
        while D::NDIM.is_some_and(|n| all.ndim() > n) {
            let Some(axis) = (1..all.ndim()).find(|a| all.shape()[*a] == 1) else { break };
            all = all.index_axis_move(ndarray::Axis(axis), 0);
        }
        let shape = all.shape().to_vec();
        all.into_dimensionality::<D>().map_err(|_| self.wrong(name, format!("{:?} axes", D::NDIM), format!("shape {shape:?}")))
    }
}

/// Some rows of a dataset, for errors.
fn some_rows(name: &str, rows: &Range<usize>) -> String {
    format!("{name}, rows {} to {}", rows.start, rows.end.saturating_sub(1))
}

#[derive(Clone, Copy)]
pub(super) enum Number {
    Real,
    Integer,
    Enum,
}
