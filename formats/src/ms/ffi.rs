//! Declarations of the C functions of the shim, see `casacore/shim.h`. Only `table` and `keywords` call them.

use std::ffi::{c_char, c_int, c_void};

/// A table that casacore holds open.
#[repr(C)]
pub(super) struct CtTable {
    _opaque: [u8; 0],
}

/// Description of a column, as the shim reads it.
#[repr(C)]
pub(super) struct CtColumn {
    pub(super) name: *const c_char,
    pub(super) comment: *const c_char,
    pub(super) kind: i32,
    pub(super) ndim: i32,
    pub(super) shape: *const i64,
    pub(super) n_shape: i32,
}

unsafe extern "C" {
    pub(super) fn ct_error() -> *const c_char;
    pub(super) fn ct_on_terminate(end: extern "C" fn(*const c_char) -> !);
    pub(super) fn ct_create(path: *const c_char, out: *mut *mut CtTable) -> c_int;
    pub(super) fn ct_open(path: *const c_char, change: i32, out: *mut *mut CtTable) -> c_int;
    pub(super) fn ct_probe(path: *const c_char) -> c_int;
    pub(super) fn ct_free_bytes(path: *const c_char, bytes: *mut u64) -> c_int;
    pub(super) fn ct_flush(table: *mut CtTable) -> c_int;
    pub(super) fn ct_close(table: *mut CtTable, discard: i32);
    pub(super) fn ct_set_info(table: *mut CtTable, kind: *const c_char, readme: *const c_char) -> c_int;
    pub(super) fn ct_add_columns(
        table: *mut CtTable,
        columns: *const CtColumn,
        n: usize,
        manager: i32,
        manager_name: *const c_char,
        tile: *const i64,
        n_tile: usize,
    ) -> c_int;
    pub(super) fn ct_add_rows(table: *mut CtTable, n: u64) -> c_int;
    pub(super) fn ct_n_rows(table: *const CtTable) -> u64;
    pub(super) fn ct_column_info(table: *const CtTable, column: *const c_char, kind: *mut i32, ndim: *mut i32) -> c_int;
    pub(super) fn ct_cell_shape(table: *const CtTable, column: *const c_char, row: u64, shape: *mut i64, n: *mut i32) -> c_int;
    pub(super) fn ct_put(
        table: *mut CtTable,
        column: *const c_char,
        kind: i32,
        start: u64,
        rows: u64,
        shape: *const i64,
        n_shape: usize,
        data: *const c_void,
    ) -> c_int;
    pub(super) fn ct_get(
        table: *const CtTable,
        column: *const c_char,
        kind: i32,
        start: u64,
        rows: u64,
        shape: *const i64,
        n_shape: usize,
        data: *mut c_void,
    ) -> c_int;
    pub(super) fn ct_put_strings(table: *mut CtTable, column: *const c_char, row: u64, n: i32, values: *const *const c_char) -> c_int;
    pub(super) fn ct_get_string(table: *const CtTable, column: *const c_char, row: u64, index: usize, value: *mut *const c_char) -> c_int;
    pub(super) fn ct_put_keyword(
        table: *mut CtTable,
        column: *const c_char,
        group: *const c_char,
        key: *const c_char,
        kind: i32,
        n: i32,
        values: *const c_void,
    ) -> c_int;
    pub(super) fn ct_put_table_keyword(table: *mut CtTable, key: *const c_char, subtable: *const CtTable) -> c_int;
    pub(super) fn ct_names(table: *const CtTable, group: *const c_char, keywords: i32, text: *mut *const c_char) -> c_int;
    pub(super) fn ct_get_keyword(
        table: *const CtTable,
        column: *const c_char,
        group: *const c_char,
        key: *const c_char,
        index: usize,
        found: *mut i32,
        number: *mut f64,
        text: *mut *const c_char,
    ) -> c_int;
}
