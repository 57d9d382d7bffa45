//! Measurement Sets in the table of formats.

use super::options::{MsColumn, MsOptions, is_measurement_set};
use super::read::MsSource;
use super::write::MsWriter;
use crate::format::{Format, Holds, Label, VisibilityFormat, refuse_options};
use crate::{ColumnSink, CreateOptions, Created, FormatError, Result, VisColumn};
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::path::Path;

/// Measurement Sets: DATA, MODEL_DATA and CORRECTED_DATA are read and written.
#[derive(Debug, Clone, Copy)]
pub struct MeasurementSet;

impl Format for MeasurementSet {
    fn label(&self) -> Label {
        Label {
            name: "Measurement Set",
            extensions: &["ms"],
            description: "a directory of casacore tables, version 2; Jy, and a phase centre on the sky",
        }
    }

    fn sniff(&self, path: &Path, _: &[u8]) -> bool {
        is_measurement_set(path)
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Visibilities(self)
    }
}

impl VisibilityFormat for MeasurementSet {
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(MsSource::open(path, MsColumn::Data)?))
    }

    fn columns(&self, path: &Path) -> Result<Vec<VisColumn>> {
        let has = MsSource::open(path, MsColumn::Data)?.columns();
        Ok(VisColumn::ALL.into_iter().skip(1).filter(|c| MsColumn::of(*c).is_some_and(|m| has.contains(&m))).collect())
    }

    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        let what = || FormatError::unsupported(path, format!("a Measurement Set has no column {:?}", column.name()));
        Ok(Box::new(MsSource::open(path, MsColumn::of(column).ok_or_else(what)?)?))
    }

    fn keeps(&self, column: VisColumn) -> bool {
        MsColumn::of(column).is_some()
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>> {
        refuse_options(self, path, options)?;
        let has = |c| options.columns.contains(&c);
        let how = MsOptions {
            model: has(VisColumn::Model),
            corrected: has(VisColumn::Corrected),
            overwrite: options.overwrite,
            linear_hands: false,
        };
        let writer = MsWriter::create(path, header, how)?;
        let notes = writer.notes().to_vec();
        let sink = Columns { writer, columns: options.columns.clone() };
        Ok(Some(Created { sink: Box::new(sink), notes }))
    }
}

/// A Measurement Set and the order in which its columns are given.
struct Columns {
    writer: MsWriter,
    columns: Vec<VisColumn>,
}

impl ColumnSink for Columns {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        let given = |column| self.columns.iter().position(|c| *c == column).and_then(|k| columns.get(k)).cloned();
        let (model, corrected) = (given(VisColumn::Model), given(VisColumn::Corrected));
        self.writer.write_with(block, model, corrected)
    }
}

impl VisibilitySink for Columns {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        self.writer.write_block(block)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        Box::new(self.writer).finish()
    }

    fn finish_with_notes(self: Box<Self>) -> Result<Vec<String>, ArrayError> {
        Box::new(self.writer).finish_with_notes()
    }
}
