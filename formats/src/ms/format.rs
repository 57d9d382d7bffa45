//! Measurement Sets in the table of formats.

use super::annotations;
use super::codes::name_of;
use super::edit::MsEdit;
use super::read::MsSource;
use super::write::MsWriter;
use crate::format::{Format, Holds, Label, VisibilityFormat, refuse_options};
use crate::{CreateOptions, Created, Edit, Result, VisColumn};
use cittert_arrays::{VisibilityHeader, VisibilitySource};
use std::path::Path;

/// True for a directory that holds a casacore table with subtables of a Measurement Set, complete or not.
#[must_use]
pub fn is_measurement_set(path: &Path) -> bool {
    path.join("table.dat").is_file() && ["ANTENNA", "SPECTRAL_WINDOW", "DATA_DESCRIPTION"].iter().any(|name| path.join(name).is_dir())
}

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
        self.open_column(path, VisColumn::Data)
    }

    fn columns(&self, path: &Path) -> Result<Vec<VisColumn>> {
        Ok(MsSource::open(path, VisColumn::Data)?.columns().split_off(1))
    }

    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(MsSource::open(path, column)?))
    }

    fn keeps(&self, column: VisColumn) -> bool {
        name_of(column).is_some()
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>> {
        refuse_options(self, path, options)?;
        let writer = MsWriter::create(path, header, options)?;
        let notes = writer.notes().to_vec();
        Ok(Some(Created { sink: Box::new(writer), notes }))
    }

    fn unread(&self, path: &Path, _: &dyn VisibilityFormat) -> Result<Vec<String>> {
        MsSource::open(path, VisColumn::Data)?.unread()
    }

    fn loses(&self, header: &VisibilityHeader) -> Vec<String> {
        let mut lines = annotations::lost(&header.annotations);
        if header.layout.antennas().iter().any(|a| a.sensitivity.is_some() || a.position_error_m.is_some()) {
            lines.push("SEFD, Tsys and position errors of the antennas".into());
        }
        lines
    }

    fn edit(&self, from: &Path, to: &Path, edit: &Edit) -> Result<Option<Created>> {
        Ok(Some(Created { sink: Box::new(MsEdit::begin(from, to, edit)?), notes: Vec::new() }))
    }
}
