//! Built-in CSV tables.

use super::error::DielectricError;
use serde::Deserialize;
use std::sync::OnceLock;

/// Rows of a built-in CSV table with `#` comments, read once.
pub(super) fn read_table<T: for<'de> Deserialize<'de>>(
    rows: &'static OnceLock<Result<Vec<T>, String>>,
    text: &'static str,
    table: &'static str,
) -> Result<&'static [T], DielectricError> {
    rows.get_or_init(|| {
        csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_reader(text.as_bytes())
            .deserialize()
            .collect::<Result<_, _>>()
            .map_err(|e| e.to_string())
    })
    .as_deref()
    .map_err(|message| DielectricError::Table { table, message: message.clone() })
}
