//! Changes to a copy of a UVH5 file: columns, or the data with their weights and flags, and the history. Every other dataset, attribute and
//! keyword of the file stays as it is.

use super::names::dataset_of;
use super::read::Uvh5Reader;
use crate::columns::{check_columns, check_rows};
use crate::h5::{Compression, H5Out, Rows, Stored};
use crate::{ColumnSink, Edit, FormatError, Result};
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilitySink, VisibilitySource};
use hdf5::H5Type;
use ndarray::{Array3, ArrayView3, Ix3, Zip};
use num_complex::Complex;
use std::ops::Range;
use std::path::Path;

const DATA: &str = "Data/visdata";
const FLAGS: &str = "Data/flags";
const WEIGHTS: &str = "Data/weights";
/// Size of the blocks whose flags or weights are copied together, bytes.
const COPY_BYTES: usize = 1 << 24;

/// A copy of a UVH5 file that is being changed.
pub(super) struct Uvh5Edit {
    out: H5Out,
    /// The file as it was.
    old: Uvh5Reader,
    columns: Vec<Column>,
    data: Option<Data>,
    rows: usize,
}

/// Visibilities that are written.
struct Column {
    name: &'static str,
    rows: Rows,
    stored: Stored,
}

struct Data {
    vis: Column,
    flags: Rows,
    /// `None` as long as the weights are the numbers of samples.
    weights: Option<Rows>,
}

impl Uvh5Edit {
    /// Begin a copy.
    pub(super) fn begin(from: &Path, to: &Path, edit: &Edit) -> Result<Self> {
        let old = Uvh5Reader::open(from)?;
        let out = H5Out::copy_of(from, to, edit.overwrite)?;
        if !edit.history.is_empty() {
            let text = [old.history_text()?.unwrap_or_default()].into_iter().filter(|t| !t.is_empty()).chain(edit.history.iter().cloned());
            let text = text.collect::<Vec<_>>().join("\n");
            out.remove("Header/history")?;
            out.text("Header/history", &text)?;
        }
        let columns = edit.columns.iter().map(|c| Column::open(&out, &old, dataset_of(*c))).collect::<Result<_>>()?;
        let data = if edit.data { Some(Data::open(&out, &old)?) } else { None };
        Ok(Self { out, old, columns, data, rows: 0 })
    }

    fn range(&self, block: &VisibilityBlock) -> Range<usize> {
        self.rows..self.rows + block.n_rows()
    }

    fn complete(self) -> Result<()> {
        check_rows(self.out.path(), self.rows, self.old.n_rows())?;
        let Self { out, old, columns, data, .. } = self;
        // Datasets that are still open would keep the file open.
        drop((old, columns, data));
        out.finish()
    }
}

impl Column {
    /// The dataset, made anew where there is none or where it cannot hold any complex number.
    fn open(out: &H5Out, old: &Uvh5Reader, name: &'static str) -> Result<Self> {
        match out.existing(name)? {
            Some((rows, stored @ (Stored::Single | Stored::Double))) => Ok(Self { name, rows, stored }),
            other => {
                drop(other);
                out.remove(name)?;
                let (n, n_chan, n_pol) = old.header().shape(old.n_rows());
                let rows = out.rows::<Complex<f32>>(name, &[n_chan, n_pol], n, Compression::None)?;
                out.fill(&rows, name, n)?;
                Ok(Self { name, rows, stored: Stored::Single })
            }
        }
    }

    /// Write rows. With 64-bit floats, numbers that are equal to 32 bits stay as they are.
    fn put(&self, out: &H5Out, start: usize, values: ArrayView3<'_, Complex<f32>>) -> Result<()> {
        if self.stored == Stored::Single {
            return out.put(&self.rows, self.name, start, values);
        }
        let stored = out.get::<Complex<f64>>(&self.rows, self.name, start..start + values.dim().0)?;
        let shape = stored.shape().to_vec();
        let mut stored = stored.into_dimensionality::<Ix3>().map_err(|_| {
            FormatError::malformed(out.path(), self.name, format!("shape {:?}", values.shape()), format!("shape {shape:?}"))
        })?;
        Zip::from(&mut stored).and(values).for_each(|s, v| {
            if Complex::new(s.re as f32, s.im as f32) != *v {
                *s = Complex::new(f64::from(v.re), f64::from(v.im));
            }
        });
        out.put(&self.rows, self.name, start, stored.view())
    }
}

impl Data {
    fn open(out: &H5Out, old: &Uvh5Reader) -> Result<Self> {
        let vis = Column::open(out, old, DATA)?;
        let flags = match out.existing(FLAGS)? {
            Some((rows, Stored::Boolean)) => rows,
            other => {
                drop(other);
                anew(out, old, FLAGS, Uvh5Reader::flags)?
            }
        };
        let weights = match out.existing(WEIGHTS)? {
            None => None,
            Some((rows, Stored::Single)) => Some(rows),
            other => {
                drop(other);
                Some(anew(out, old, WEIGHTS, Uvh5Reader::weights)?)
            }
        };
        Ok(Self { vis, flags, weights })
    }

    fn put(&mut self, out: &H5Out, old: &Uvh5Reader, range: Range<usize>, block: &VisibilityBlock) -> Result<()> {
        self.vis.put(out, range.start, block.vis.view())?;
        let before = old.flags(range.clone())?;
        let mut flags = before.clone();
        flags.zip_mut_with(&block.flags, |f, new| *f |= *new);
        if flags != before {
            out.put(&self.flags, FLAGS, range.start, flags.view())?;
        }
        if same(&block.weights, &old.weights(range.clone())?) {
            return Ok(());
        }
        let weights = match self.weights.take() {
            Some(weights) => weights,
            None => anew(out, old, WEIGHTS, Uvh5Reader::samples)?,
        };
        out.put(&weights, WEIGHTS, range.start, block.weights.view())?;
        self.weights = Some(weights);
        Ok(())
    }
}

fn same(a: &Array3<f32>, b: &Array3<f32>) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

/// Reads one quantity of some rows.
type Get<T> = fn(&Uvh5Reader, Range<usize>) -> Result<Array3<T>>;

/// A dataset made anew with the values of each row.
fn anew<T: H5Type + Clone>(out: &H5Out, old: &Uvh5Reader, name: &str, get: Get<T>) -> Result<Rows> {
    let (n, n_chan, n_pol) = old.header().shape(old.n_rows());
    out.remove(name)?;
    let rows = out.rows::<T>(name, &[n_chan, n_pol], n, Compression::Lzf)?;
    out.fill(&rows, name, n)?;
    let step = (COPY_BYTES / (size_of::<T>() * n_chan * n_pol).max(1)).max(1);
    for start in (0..n).step_by(step) {
        out.put(&rows, name, start, get(old, start..(start + step).min(n))?.view())?;
    }
    Ok(rows)
}

impl ColumnSink for Uvh5Edit {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        self.old.header().check_block(block).map_err(|e| FormatError::values(self.out.path(), e))?;
        check_columns(self.out.path(), block, columns, self.columns.len())?;
        let range = self.range(block);
        for (column, values) in self.columns.iter().zip(columns) {
            column.put(&self.out, range.start, values.view())?;
        }
        if let Some(data) = &mut self.data {
            data.put(&self.out, &self.old, range.clone(), block)?;
        }
        self.rows = range.end;
        Ok(())
    }
}

impl VisibilitySink for Uvh5Edit {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write_columns(block, &[])?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        Ok(self.complete()?)
    }
}
