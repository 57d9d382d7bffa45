//! Columns beside the data (model, corrected, residual), copied from one file to another.

use super::failure::Result;
use super::options::SetFiles;
use cittert_arrays::{ArrayError, VisibilitySource};
use cittert_formats::{JoinedSource, VisColumn};
use ndarray::Array3;
use num_complex::Complex;
use std::ops::Range;
use std::path::Path;

/// The columns of an input that an output keeps, open to read.
#[derive(Default)]
pub(super) struct Beside {
    /// Their names in the output.
    pub(super) columns: Vec<VisColumn>,
    /// Notes for the user on columns that are kept under another name.
    pub(super) notes: Vec<String>,
    /// Columns that are not kept, one line each.
    pub(super) lost: Vec<String>,
    sources: Vec<Box<dyn VisibilitySource>>,
}

impl Beside {
    /// Open the columns of `input` that a file called `output` can keep.
    ///
    /// # Errors
    /// A damaged input, or an output of no known format.
    pub(super) fn open(input: &SetFiles, output: &Path) -> Result<Self> {
        let to = cittert_formats::format_to_write(output)?;
        let have = input.columns()?;
        let joined = if input.one().is_none() && !have.is_empty() { Some(JoinedSource::open(input.all(), have[0])?) } else { None };
        let mut kept = Self::default();
        for column in &have {
            let name = column.name();
            let place = place_of(*column, |c| to.keeps(c) && !(c != *column && have.contains(&c)));
            match place {
                Some(place) => {
                    if place != *column {
                        kept.notes.push(format!(
                            "the column {name:?} is kept as {:?}, as {} has no other place for it",
                            place.name(),
                            to.name()
                        ));
                    }
                    kept.columns.push(place);
                    kept.sources.push(match (&joined, input.one()) {
                        (Some(set), _) => Box::new(set.column(*column)),
                        (None, Some(one)) => cittert_formats::open_column(one, *column)?,
                        (None, None) => continue,
                    });
                }
                None => {
                    let how = format!("`convert --column {name}` writes it as data");
                    kept.lost.push(format!("lost in {}: the column {name:?} ({how})", to.name()));
                }
            }
        }
        Ok(kept)
    }

    /// Leave out a column that the command writes itself.
    pub(super) fn without(mut self, column: VisColumn) -> Self {
        if let Some(k) = self.columns.iter().position(|c| *c == column) {
            self.columns.remove(k);
            drop(self.sources.remove(k));
        }
        self
    }

    /// The visibilities of the columns in some rows.
    ///
    /// # Errors
    /// Damage to the file.
    pub(super) fn read(&mut self, rows: Range<usize>) -> Result<Vec<Array3<Complex<f32>>>, ArrayError> {
        self.sources.iter_mut().map(|s| Ok(s.read_rows(rows.clone())?.vis)).collect()
    }
}

/// The column in which a column is stored: the same one, or `corrected` for the residual if the format has no column for it, as in uvsub of
/// CASA.
pub(super) fn place_of(column: VisColumn, free: impl Fn(VisColumn) -> bool) -> Option<VisColumn> {
    let other = if column == VisColumn::Residual { Some(VisColumn::Corrected) } else { None };
    [Some(column), other].into_iter().flatten().find(|c| free(*c))
}
