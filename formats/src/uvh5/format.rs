//! UVH5 in the table of formats.

use super::edit::Uvh5Edit;
use super::read::Uvh5Reader;
use super::write::Uvh5Writer;
use crate::format::{Format, Holds, Label, VisibilityFormat};
use crate::{CreateOptions, Created, Edit, Result, VisColumn, h5};
use cittert_arrays::{VisibilityHeader, VisibilitySource};
use std::path::Path;

pub(crate) struct Uvh5;

impl Format for Uvh5 {
    fn label(&self) -> Label {
        Label {
            name: "UVH5",
            extensions: &["uvh5", "h5", "hdf5"],
            description: "the native format (HDF5); holds everything, boresight sets too",
        }
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        start.starts_with(h5::SIGNATURE) && h5::has(path, "Data/visdata")
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Visibilities(self)
    }
}

impl VisibilityFormat for Uvh5 {
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(Uvh5Reader::open(path)?))
    }

    fn columns(&self, path: &Path) -> Result<Vec<VisColumn>> {
        Uvh5Reader::columns(path)
    }

    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(Uvh5Reader::open_column(path, column)?))
    }

    fn keeps(&self, _: VisColumn) -> bool {
        true
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>> {
        let writer = if options.append { Uvh5Writer::append } else { Uvh5Writer::create }(path, header, options)?;
        Ok(Some(Created { sink: Box::new(writer), notes: Vec::new() }))
    }

    fn keeps_samples(&self) -> bool {
        true
    }

    fn unread(&self, path: &Path, to: &dyn VisibilityFormat) -> Result<Vec<String>> {
        Uvh5Reader::open(path)?.unread(to.keeps_samples())
    }

    fn edit(&self, from: &Path, to: &Path, edit: &Edit) -> Result<Option<Created>> {
        Ok(Some(Created { sink: Box::new(Uvh5Edit::begin(from, to, edit)?), notes: Vec::new() }))
    }
}
