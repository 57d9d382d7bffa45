//! Subtables of a Measurement Set, opened to read.

use super::table::Table;
use crate::{FormatError, Result};
use std::path::Path;

/// Largest number of rows of a subtable. More indicate a damaged file.
const MAX_ROWS: u64 = 1 << 20;

/// Open a subtable and count its rows.
pub(super) fn open(ms: &Path, name: &str) -> Result<(Table, usize)> {
    let path = ms.join(name);
    if !path.join("table.dat").is_file() {
        return Err(FormatError::malformed(ms, name, "a subtable (every Measurement Set has it)", "none"));
    }
    let table = Table::open(&path)?;
    let rows = table.n_rows();
    if rows > MAX_ROWS {
        return Err(FormatError::malformed(&path, "table.dat", format!("at most {MAX_ROWS} rows"), format!("{rows} rows")));
    }
    Ok((table, rows as usize))
}
