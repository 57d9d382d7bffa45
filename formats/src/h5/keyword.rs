//! Single values of HDF5 files as keywords.

use super::read::{H5In, Number};
use super::write::H5Out;
use crate::Result;
use cittert_arrays::Keyword;
use hdf5::types::TypeDescriptor;

impl H5In {
    /// The value of a dataset that holds one number, text or truth value, or nothing; `None` for anything else.
    pub(crate) fn keyword(&self, name: &str) -> Result<Option<Keyword>> {
        let Some(dataset) = self.dataset(name)? else { return Ok(None) };
        let failed = |e: &hdf5::Error| self.wrong(name, "a keyword", e.to_string());
        if dataset.space().map_err(|e| failed(&e))?.is_null() {
            return Ok(Some(Keyword::Empty));
        }
        if dataset.size() != 1 {
            return Ok(None);
        }
        let dtype = dataset.dtype().and_then(|d| d.to_descriptor()).map_err(|e| failed(&e))?;
        if dtype == TypeDescriptor::Boolean {
            return Ok(self.real(name)?.map(|v| Keyword::Logical(v != 0.0)));
        }
        if let Ok(kind) = self.number_kind(&dataset, name) {
            self.shape(&dataset, name)?;
            return Ok(match kind {
                Number::Real => self.real(name)?.map(Keyword::Real),
                _ => self.all::<i64>(&dataset).map_err(|e| failed(&e))?.first().map(|v| Keyword::Integer(*v)),
            });
        }
        Ok(self.text(name)?.map(Keyword::Text))
    }
}

impl H5Out {
    /// A keyword.
    pub(crate) fn keyword(&self, name: &str, value: &Keyword) -> Result<()> {
        match value {
            Keyword::Text(text) => self.text(name, text),
            Keyword::Integer(number) => self.scalar(name, *number),
            Keyword::Real(number) => self.scalar(name, *number),
            Keyword::Logical(value) => self.scalar(name, *value),
            Keyword::Empty => self.none(name),
        }
    }
}
