//! Keywords of tables and columns: units, measures, links to subtables.

use super::ffi;
use super::table::{Element, Kind, Table, lock, text};
use crate::{FormatError, Result};
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;
use std::ptr;

/// Place of a keyword: in the table or in a column, at the top level or in a record such as MEASINFO.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<'a> {
    column: Option<&'a str>,
    group: Option<&'a str>,
    key: &'a str,
}

impl<'a> Place<'a> {
    pub(super) fn table(key: &'a str) -> Self {
        Self { column: None, group: None, key }
    }

    pub(super) fn column(column: &'a str, key: &'a str) -> Self {
        Self { column: Some(column), group: None, key }
    }

    pub(super) fn measure(column: &'a str, key: &'a str) -> Self {
        Self { column: Some(column), group: Some("MEASINFO"), key }
    }

    fn texts(&self, path: &Path) -> Result<(Option<CString>, Option<CString>, CString)> {
        let optional = |s: Option<&str>| s.map(|s| text(path, s)).transpose();
        Ok((optional(self.column)?, optional(self.group)?, text(path, self.key)?))
    }
}

fn pointer(text: &Option<CString>) -> *const c_char {
    text.as_ref().map_or(ptr::null(), |t| t.as_ptr())
}

impl Table {
    fn put_keyword(&mut self, place: Place<'_>, kind: Kind, n: i32, values: *const c_void) -> Result<()> {
        let names = place.texts(&self.path)?;
        let _lock = lock();
        // SAFETY: the callers below pass n values (one for n < 0) of the type that `kind` names.
        let code = unsafe {
            ffi::ct_put_keyword(self.handle.as_ptr(), pointer(&names.0), pointer(&names.1), names.2.as_ptr(), kind as i32, n, values)
        };
        self.done(code, place.key)
    }

    /// Put a keyword that is one number or truth value.
    pub(super) fn put_keyword_value<T: Element>(&mut self, place: Place<'_>, value: T) -> Result<()> {
        self.put_keyword(place, T::KIND, -1, ptr::from_ref(&value).cast())
    }

    /// Put a keyword that is an array of numbers.
    pub(super) fn put_keyword_values<T: Element>(&mut self, place: Place<'_>, values: &[T]) -> Result<()> {
        self.put_keyword(place, T::KIND, values.len() as i32, values.as_ptr().cast())
    }

    /// Put a keyword that is a text (`scalar`) or an array of texts.
    pub(super) fn put_keyword_text(&mut self, place: Place<'_>, values: &[&str], scalar: bool) -> Result<()> {
        let texts = values.iter().map(|v| text(&self.path, v)).collect::<Result<Vec<_>>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|t| t.as_ptr()).collect();
        if scalar && pointers.is_empty() {
            return Err(FormatError::malformed(&self.path, place.key, "one text", "none"));
        }
        self.put_keyword(place, Kind::String, if scalar { -1 } else { pointers.len() as i32 }, pointers.as_ptr().cast())
    }

    /// Link a subtable.
    pub(super) fn put_table_keyword(&mut self, key: &str, subtable: &Self) -> Result<()> {
        let name = text(&self.path, key)?;
        let _lock = lock();
        // SAFETY: two open handles and a NUL-terminated text.
        let code = unsafe { ffi::ct_put_table_keyword(self.handle.as_ptr(), name.as_ptr(), subtable.handle.as_ptr()) };
        self.done(code, key)
    }

    fn get_keyword(&self, place: Place<'_>, index: usize) -> Result<Option<(f64, String)>> {
        let names = place.texts(&self.path)?;
        let (mut found, mut number, mut value) = (0, 0.0, ptr::null());
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated texts or null, places for the three results.
        let code = unsafe {
            ffi::ct_get_keyword(
                self.handle.as_ptr(),
                pointer(&names.0),
                pointer(&names.1),
                names.2.as_ptr(),
                index,
                &mut found,
                &mut number,
                &mut value,
            )
        };
        self.done(code, place.key)?;
        if found == 0 || value.is_null() {
            return Ok(None);
        }
        // SAFETY: the shim points at a NUL-terminated text that lives until its next call.
        Ok(Some((number, unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())))
    }

    /// The number (or truth value, as 0 or 1) of a keyword, or element `index` of an array.
    pub(super) fn keyword_number(&self, place: Place<'_>, index: usize) -> Result<Option<f64>> {
        Ok(self.get_keyword(place, index)?.filter(|v| v.1.is_empty()).map(|v| v.0))
    }

    /// The text of a keyword, or element `index` of an array of texts.
    pub(super) fn keyword_text(&self, place: Place<'_>, index: usize) -> Result<Option<String>> {
        Ok(self.get_keyword(place, index)?.map(|v| v.1).filter(|t| !t.is_empty()))
    }
}
