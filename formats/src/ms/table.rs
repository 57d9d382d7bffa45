//! A casacore table as a safe type. Every length is checked here, and every C++ exception becomes an error that names the table.

use super::ffi::{self, CtColumn, CtTable};
use super::unwritten;
use crate::{FormatError, Result};
use num_complex::Complex;
use serde::Deserialize;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io;
use std::path::{Path, PathBuf};
use std::ptr::{self, NonNull};
use std::sync::{Mutex, MutexGuard};

/// casacore has one cache of open tables for the whole process, without a lock. This lock allows one call at a time.
static CASACORE: Mutex<()> = Mutex::new(());

pub(super) fn lock() -> MutexGuard<'static, ()> {
    // A panic in another thread happens between two calls, so casacore is in a consistent state.
    CASACORE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Element type of a column or keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(super) enum Kind {
    Bool = 0,
    Int = 1,
    Float = 2,
    Double = 3,
    Complex = 4,
    String = 5,
}

/// A type with the same memory layout as a type of casacore.
///
/// # Safety
/// `KIND` must name casacore's type of the same size and layout, and every bit pattern that casacore writes must be valid.
pub(super) unsafe trait Element: Copy + Default {
    const KIND: Kind;
}

macro_rules! elements {
    ($($rust:ty => $kind:ident),*) => { $(
        // SAFETY: casacore's Bool is C++ bool (0 or 1), Int int32, Float and Double IEEE, Complex std::complex<float>: two floats in
        // sequence, as in num_complex's Complex, which is #[repr(C)].
        unsafe impl Element for $rust {
            const KIND: Kind = Kind::$kind;
        }
    )* };
}

elements!(bool => Bool, i32 => Int, f32 => Float, f64 => Double, Complex<f32> => Complex);

/// A column of a table, as the schema has it.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Column {
    pub(super) table: String,
    #[serde(rename = "column")]
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Axes of the array in a cell, -1 for a scalar, 0 for any array.
    pub(super) ndim: i32,
    /// Length of the one axis, where it is fixed.
    pub(super) length: Option<i64>,
    /// A unit for each number of a cell, with blanks between them.
    pub(super) units: String,
    /// The kind of measure, for programs that convert between frames.
    pub(super) measure: String,
    pub(super) comment: String,
}

/// Storage manager of some columns: the layout of the cells on the disk.
#[derive(Debug, Clone)]
pub(super) enum Manager {
    /// Buckets of rows.
    Standard,
    /// Incremental: only changes from row to row are stored.
    Incremental,
    /// Tiles of this shape (the last axis counts rows), for cells of any shape.
    TiledShape(Vec<i64>),
    /// Tiles of this shape, for cells of a fixed shape.
    TiledColumn(Vec<i64>),
}

/// An open table. Dropping one that was created and not flushed discards it.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) handle: NonNull<CtTable>,
    /// Path for errors. For an output it is the final name, not the hidden name that the table has while it is written.
    pub(super) path: PathBuf,
    discard: bool,
}

/// How a table is opened.
#[derive(Debug, Clone, Copy)]
enum How {
    Create,
    Read,
    Change,
}

// SAFETY: every use of the handle holds the lock, and casacore binds no table to a thread.
unsafe impl Send for Table {}

pub(super) fn text(path: &Path, s: &str) -> Result<CString> {
    CString::new(s).map_err(|_| FormatError::unsupported(path, format!("the text {s:?} holds a NUL, which no table can")))
}

/// The last error of casacore. The caller must hold the lock.
fn message() -> String {
    // SAFETY: the shim returns a NUL-terminated text that lives until its next call, which the lock delays.
    let text = unsafe { CStr::from_ptr(ffi::ct_error()) };
    text.to_string_lossy().into_owned()
}

/// An error where fewer than `need` bytes are free in `folder`. casacore writes in destructors, and there a full disk ends the process.
pub(super) fn check_space(folder: &Path, label: &Path, need: u64) -> Result<()> {
    let name = text(label, &folder.to_string_lossy())?;
    let mut free = 0;
    // SAFETY: NUL-terminated text, a place for one number; casacore is not involved.
    let code = unsafe { ffi::ct_free_bytes(name.as_ptr(), &mut free) };
    if code != 0 || free >= need {
        // A file system that does not report its free space is not an error.
        return Ok(());
    }
    let what = format!("No space left on device: {need} bytes are needed, {free} are free");
    Err(FormatError::io(label, "write", io::Error::new(io::ErrorKind::StorageFull, what)))
}

fn check(code: c_int, path: &Path, place: &str) -> Result<()> {
    if code == 0 {
        return Ok(());
    }
    Err(FormatError::malformed(path, place, "a table that casacore accepts (a Measurement Set is made of such)", message()))
}

impl Table {
    fn with_path(path: &Path, label: &Path, how: How) -> Result<Self> {
        let create = matches!(how, How::Create);
        let change = i32::from(matches!(how, How::Change));
        let name = path.to_str().ok_or_else(|| FormatError::unsupported(label, "casacore needs a path in UTF-8"))?;
        let name = text(label, name)?;
        let mut out = ptr::null_mut();
        let _lock = lock();
        // SAFETY: `name` is NUL-terminated and `out` is a place for the handle.
        // The lock is held during the fork of the probe, so that no other thread is inside casacore.
        let code = unsafe { if create { 0 } else { ffi::ct_probe(name.as_ptr()) } };
        check(code, label, "table")?;
        // SAFETY: as above.
        let code = unsafe { if create { ffi::ct_create(name.as_ptr(), &mut out) } else { ffi::ct_open(name.as_ptr(), change, &mut out) } };
        check(code, label, "table")?;
        match NonNull::new(out) {
            Some(handle) => Ok(Self { handle, path: label.into(), discard: create }),
            None => Err(FormatError::malformed(label, "table", "an open table", "nothing")),
        }
    }

    /// Create a table without columns at `path`. Errors name `label`.
    pub(super) fn create(path: &Path, label: &Path) -> Result<Self> {
        unwritten::end_in_order();
        Self::with_path(path, label, How::Create)
    }

    /// Open a table to change it. Errors name `label`.
    pub(super) fn open_to_change(path: &Path, label: &Path) -> Result<Self> {
        unwritten::end_in_order();
        Self::with_path(path, label, How::Change)
    }

    /// Open a table to read.
    pub(super) fn open(path: &Path) -> Result<Self> {
        Self::with_path(path, path, How::Read)
    }

    pub(super) fn done(&self, code: c_int, place: &str) -> Result<()> {
        check(code, &self.path, place)
    }

    /// Write everything to the disk.
    pub(super) fn flush(&mut self) -> Result<()> {
        let _lock = lock();
        // SAFETY: the handle is open.
        let code = unsafe { ffi::ct_flush(self.handle.as_ptr()) };
        self.done(code, "flush")?;
        self.discard = false;
        Ok(())
    }

    /// Write type and a line of text to `table.info`, by which programs recognise a Measurement Set.
    pub(super) fn set_info(&mut self, kind: &str, readme: &str) -> Result<()> {
        let (kind, readme) = (text(&self.path, kind)?, text(&self.path, readme)?);
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated texts.
        let code = unsafe { ffi::ct_set_info(self.handle.as_ptr(), kind.as_ptr(), readme.as_ptr()) };
        self.done(code, "table.info")
    }

    /// Add columns that share one storage manager called `name`.
    pub(super) fn add_columns(&mut self, columns: &[&Column], manager: &Manager, name: &str) -> Result<()> {
        let texts = columns.iter().map(|c| Ok((text(&self.path, &c.name)?, text(&self.path, &c.comment)?))).collect::<Result<Vec<_>>>()?;
        let specs: Vec<CtColumn> = columns
            .iter()
            .zip(&texts)
            .map(|(c, (name, comment))| CtColumn {
                name: name.as_ptr(),
                comment: comment.as_ptr(),
                kind: c.kind as i32,
                ndim: c.ndim,
                shape: c.length.as_slice().as_ptr(),
                n_shape: c.length.as_slice().len() as i32,
            })
            .collect();
        let (code, tile): (i32, &[i64]) = match manager {
            Manager::Standard => (0, &[]),
            Manager::Incremental => (1, &[]),
            Manager::TiledShape(tile) => (2, tile),
            Manager::TiledColumn(tile) => (3, tile),
        };
        let manager_name = text(&self.path, name)?;
        let _lock = lock();
        // SAFETY: the texts and shapes behind the pointers of `specs` outlive the call; lengths are those of the slices.
        let code = unsafe {
            ffi::ct_add_columns(self.handle.as_ptr(), specs.as_ptr(), specs.len(), code, manager_name.as_ptr(), tile.as_ptr(), tile.len())
        };
        self.done(code, name)
    }

    /// Append empty rows.
    pub(super) fn add_rows(&mut self, n: usize) -> Result<()> {
        let _lock = lock();
        // SAFETY: the handle is open.
        let code = unsafe { ffi::ct_add_rows(self.handle.as_ptr(), n as u64) };
        self.done(code, "new rows")
    }

    /// Number of rows.
    pub(super) fn n_rows(&self) -> u64 {
        let _lock = lock();
        // SAFETY: the handle is open.
        unsafe { ffi::ct_n_rows(self.handle.as_ptr()) }
    }

    /// Number of axes of the cells of a column: -1 for scalars, 0 for any number; `None` where there is no such column of this type.
    pub(super) fn column_ndim(&self, column: &str, kind: Kind) -> Result<Option<i32>> {
        let name = text(&self.path, column)?;
        let (mut found, mut ndim) = (-1, -1);
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated text, places for two integers.
        let code = unsafe { ffi::ct_column_info(self.handle.as_ptr(), name.as_ptr(), &mut found, &mut ndim) };
        self.done(code, column)?;
        Ok((found == kind as i32).then_some(ndim))
    }

    /// Shape of a cell, fastest axis first; `None` for a cell that was never written.
    pub(super) fn cell_shape(&self, column: &str, row: usize) -> Result<Option<Vec<usize>>> {
        let name = text(&self.path, column)?;
        let (mut shape, mut n) = ([0_i64; 8], 0);
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated text, room for the 8 axes that the shim writes at most.
        let code = unsafe { ffi::ct_cell_shape(self.handle.as_ptr(), name.as_ptr(), row as u64, shape.as_mut_ptr(), &mut n) };
        self.done(code, column)?;
        let Ok(n) = usize::try_from(n) else { return Ok(None) };
        let sides = shape.get(..n).map(|sides| sides.iter().map(|s| usize::try_from(*s)).collect::<std::result::Result<Vec<_>, _>>());
        match sides {
            Some(Ok(sides)) => Ok(Some(sides)),
            _ => Err(FormatError::malformed(&self.path, format!("{column}, row {row}"), "at most 8 axes", format!("{n} axes {shape:?}"))),
        }
    }

    /// The name of a column and the shape of its cells for the shim, and the number of rows of `values` values.
    fn cells(&self, column: &str, cell: &[usize], values: usize) -> Result<(CString, Vec<i64>, usize)> {
        let size: usize = cell.iter().product();
        if size == 0 || !values.is_multiple_of(size) {
            let expected = format!("whole cells of shape {cell:?}");
            return Err(FormatError::malformed(&self.path, column, expected, format!("{values} values")));
        }
        Ok((text(&self.path, column)?, cell.iter().map(|n| *n as i64).collect(), values / size))
    }

    /// Put the cells of a run of rows, all of the shape `cell` (fastest axis first; empty: scalars).
    pub(super) fn put<T: Element>(&mut self, column: &str, start: usize, cell: &[usize], values: &[T]) -> Result<()> {
        let (name, shape, rows) = self.cells(column, cell, values.len())?;
        let _lock = lock();
        // SAFETY: `values` holds rows * size elements of the type that KIND names; the shim only reads them.
        let code = unsafe {
            ffi::ct_put(
                self.handle.as_ptr(),
                name.as_ptr(),
                T::KIND as i32,
                start as u64,
                rows as u64,
                shape.as_ptr(),
                shape.len(),
                values.as_ptr().cast::<c_void>(),
            )
        };
        self.done(code, column)
    }

    /// Get the cells of a run of rows, all of the shape `cell`, into `out`.
    pub(super) fn get_into<T: Element>(&self, column: &str, start: usize, cell: &[usize], out: &mut [T]) -> Result<()> {
        if out.is_empty() {
            return Ok(());
        }
        match self.column_ndim(column, T::KIND)? {
            Some(ndim) if (ndim < 0) == cell.is_empty() && (ndim <= 0 || ndim as usize == cell.len()) => {}
            _ => {
                let shape = if cell.is_empty() { "scalars".into() } else { format!("arrays of shape {cell:?}") };
                let expected = format!("a column of {:?} {shape}", T::KIND);
                return Err(FormatError::malformed(&self.path, column, expected, "none of that kind"));
            }
        }
        let (name, shape, rows) = self.cells(column, cell, out.len())?;
        let _lock = lock();
        // SAFETY: `out` has room for rows * size elements of the type that KIND names, and casacore checks the column's type and the
        // cells' shapes before it writes.
        let code = unsafe {
            ffi::ct_get(
                self.handle.as_ptr(),
                name.as_ptr(),
                T::KIND as i32,
                start as u64,
                rows as u64,
                shape.as_ptr(),
                shape.len(),
                out.as_mut_ptr().cast::<c_void>(),
            )
        };
        self.done(code, &format!("{column}, rows {start} to {}", start + rows - 1))
    }

    /// Get the scalars of `rows` rows.
    pub(super) fn scalars<T: Element>(&self, column: &str, start: usize, rows: usize) -> Result<Vec<T>> {
        let mut out = vec![T::default(); rows];
        self.get_into(column, start, &[], &mut out)?;
        Ok(out)
    }

    /// Get one cell as it is, with its shape (fastest axis first).
    pub(super) fn array<T: Element>(&self, column: &str, row: usize) -> Result<(Vec<usize>, Vec<T>)> {
        let shape = self.cell_shape(column, row)?;
        let Some(shape) = shape.filter(|s| !s.is_empty() && s.iter().product::<usize>() > 0) else {
            return Err(FormatError::malformed(&self.path, format!("{column}, row {row}"), "an array", "an empty cell"));
        };
        let size = shape.iter().try_fold(1_usize, |n, s| n.checked_mul(*s)).filter(|n| *n <= 1 << 26);
        let Some(size) = size else {
            return Err(FormatError::malformed(&self.path, format!("{column}, row {row}"), "a small array", format!("shape {shape:?}")));
        };
        let mut out = vec![T::default(); size];
        self.get_into(column, row, &shape, &mut out)?;
        Ok((shape, out))
    }

    /// Put a text, or an array of texts, into a cell.
    pub(super) fn put_text(&mut self, column: &str, row: usize, values: &[&str], scalar: bool) -> Result<()> {
        let texts = values.iter().map(|v| text(&self.path, v)).collect::<Result<Vec<_>>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|t| t.as_ptr()).collect();
        let name = text(&self.path, column)?;
        let n = if scalar { -1 } else { pointers.len() as i32 };
        if scalar && pointers.is_empty() {
            return Err(FormatError::malformed(&self.path, column, "one text", "none"));
        }
        let _lock = lock();
        // SAFETY: NUL-terminated texts that outlive the call; at least one for a scalar, n otherwise.
        let code = unsafe { ffi::ct_put_strings(self.handle.as_ptr(), name.as_ptr(), row as u64, n, pointers.as_ptr()) };
        self.done(code, column)
    }

    /// The text of a cell, or the element `index` of an array of texts.
    pub(super) fn get_text(&self, column: &str, row: usize, index: usize) -> Result<String> {
        if self.column_ndim(column, Kind::String)?.is_none() || row as u64 >= self.n_rows() {
            return Err(FormatError::malformed(&self.path, column, format!("a text in row {row}"), "none"));
        }
        let name = text(&self.path, column)?;
        let mut value = ptr::null();
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated text, a place for one pointer.
        let code = unsafe { ffi::ct_get_string(self.handle.as_ptr(), name.as_ptr(), row as u64, index, &mut value) };
        self.done(code, &format!("{column}, row {row}"))?;
        // SAFETY: on success the shim points at a NUL-terminated text that lives until its next call.
        Ok(unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())
    }
}

impl Drop for Table {
    fn drop(&mut self) {
        let _lock = lock();
        // SAFETY: the handle is open and is not used again.
        unsafe { ffi::ct_close(self.handle.as_ptr(), i32::from(self.discard)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms::keywords::Place;

    fn temp() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t");
        (dir, path)
    }

    fn column(name: &str, kind: Kind, ndim: i32) -> Column {
        let [table, units, measure, comment] = [(); 4].map(|()| String::new());
        Column { table, name: name.into(), kind, ndim, length: None, units, measure, comment }
    }

    fn visibilities_times_names() -> [Column; 3] {
        [column("V", Kind::Complex, 2), column("T", Kind::Double, -1), column("N", Kind::String, -1)]
    }

    #[test]
    fn cells_and_keywords_go_both_ways() {
        let (_dir, path) = temp();
        let vis: Vec<Complex<f32>> = (0..24).map(|i| Complex::new(i as f32, -1.0)).collect();
        {
            let mut t = Table::create(&path, &path).unwrap();
            let [v, times, names] = visibilities_times_names();
            t.add_columns(&[&times, &names], &Manager::Standard, "ssm").unwrap();
            t.add_columns(&[&v], &Manager::TiledShape(vec![2, 3, 8]), "tiled").unwrap();
            t.add_rows(4).unwrap();
            t.put("V", 0, &[2, 3], &vis).unwrap();
            t.put("T", 0, &[], &[1.0, 2.0, 3.0, 4.0]).unwrap();
            t.put_text("N", 3, &["three"], true).unwrap();
            t.put_keyword_text(Place::column("T", "QuantumUnits"), &["s"], false).unwrap();
            t.put_keyword_text(Place::measure("T", "Ref"), &["UTC"], true).unwrap();
            t.put_keyword_value(Place::table("MS_VERSION"), 2.0_f32).unwrap();
            t.flush().unwrap();
        }
        let t = Table::open(&path).unwrap();
        assert_eq!(t.n_rows(), 4);
        assert_eq!(t.scalars::<f64>("T", 1, 2).unwrap(), [2.0, 3.0]);
        let mut back = vec![Complex::default(); 12];
        t.get_into("V", 2, &[2, 3], &mut back).unwrap();
        assert_eq!(back, vis[12..]);
        assert_eq!(t.get_text("N", 3, 0).unwrap(), "three");
        assert_eq!(t.keyword_text(Place::measure("T", "Ref"), 0).unwrap().as_deref(), Some("UTC"));
        assert_eq!(t.keyword_text(Place::column("T", "QuantumUnits"), 0).unwrap().as_deref(), Some("s"));
        assert_eq!(t.keyword_text(Place::column("T", "QuantumUnits"), 1).unwrap(), None);
        assert_eq!(t.keyword_number(Place::table("MS_VERSION"), 0).unwrap(), Some(2.0));
        assert_eq!(t.keyword_number(Place::table("NONE"), 0).unwrap(), None);
    }

    #[test]
    fn what_does_not_fit_is_an_error_and_no_abort() {
        let (_dir, path) = temp();
        let mut t = Table::create(&path, &path).unwrap();
        let [v, times, _] = visibilities_times_names();
        t.add_columns(&[&times], &Manager::Standard, "ssm").unwrap();
        t.add_columns(&[&v], &Manager::TiledShape(vec![2, 3, 8]), "tiled").unwrap();
        t.add_rows(2).unwrap();
        assert!(t.put("V", 0, &[2, 3], &[Complex::<f32>::default(); 7]).is_err());
        assert!(t.put("V", 1, &[2, 3], &[Complex::<f32>::default(); 12]).is_err(), "past the last row");
        assert!(t.put("V", 0, &[2, 3], &[0.0_f64; 12]).is_err(), "another type");
        assert!(t.scalars::<i32>("T", 0, 2).is_err());
        assert!(t.scalars::<f64>("NONE", 0, 2).is_err());
        assert!(t.scalars::<f64>("T", 1, 2).is_err());
        assert!(t.array::<Complex<f32>>("V", 0).is_err() || t.cell_shape("V", 0).unwrap().is_some());
        assert!(t.get_text("T", 0, 0).is_err());
        assert!(Table::open(Path::new("/nonexistent/t")).unwrap_err().to_string().contains("/nonexistent/t"));
        drop(t);
        assert!(!path.exists(), "an unfinished table is discarded");
    }
}
