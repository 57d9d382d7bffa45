//! The row of Measurement Sets in the table of formats.

use super::{MsColumn, MsOptions, MsSource, MsWriter, is_measurement_set};
use crate::Result;
use crate::registry::{Created, VisibilityFormat};
use cittert_arrays::{VisibilityHeader, VisibilitySource};
use std::path::Path;

/// Measurement Sets: DATA is read and written.
#[derive(Debug, Clone, Copy)]
pub struct MeasurementSet;

impl VisibilityFormat for MeasurementSet {
    fn name(&self) -> &'static str {
        "Measurement Set"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ms"]
    }

    fn description(&self) -> &'static str {
        "a directory of casacore tables, version 2; Jy, and a phase centre on the sky"
    }

    fn sniff(&self, path: &Path, _: &[u8]) -> bool {
        is_measurement_set(path)
    }

    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(MsSource::open(path, MsColumn::Data)?))
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, overwrite: bool) -> Result<Option<Created>> {
        let writer = MsWriter::create(path, header, MsOptions { overwrite, ..MsOptions::default() })?;
        let notes = writer.notes().to_vec();
        Ok(Some(Created { sink: Box::new(writer), notes }))
    }
}
