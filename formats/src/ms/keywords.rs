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

    /// In a record of the table.
    pub(super) fn record(group: &'a str, key: &'a str) -> Self {
        Self { column: None, group: Some(group), key }
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

    fn names(&self, group: Option<&str>, keywords: bool) -> Result<Vec<(char, String)>> {
        let group = group.map(|g| text(&self.path, g)).transpose()?;
        let mut lines = ptr::null();
        let _lock = lock();
        // SAFETY: open handle, NUL-terminated text or null, a place for one pointer.
        let code = unsafe { ffi::ct_names(self.handle.as_ptr(), pointer(&group), i32::from(keywords), &mut lines) };
        self.done(code, "names")?;
        // SAFETY: on success the shim points at a NUL-terminated text that lives until its next call.
        let lines = unsafe { CStr::from_ptr(lines) }.to_string_lossy();
        Ok(lines.lines().filter_map(|l| l.chars().next().zip(l.get(2..))).map(|(letter, name)| (letter, name.to_string())).collect())
    }

    /// Names of the keywords of the table, or of a record among them, each with a letter for its type, see `casacore/shim.h`.
    pub(super) fn keyword_names(&self, group: Option<&str>) -> Result<Vec<(char, String)>> {
        self.names(group, true)
    }

    /// Names of the columns.
    pub(super) fn column_names(&self) -> Result<Vec<String>> {
        Ok(self.names(None, false)?.into_iter().map(|(_, name)| name).collect())
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
