//! Tables of columns as HDF5: one group per table, one dataset per column.

use crate::h5::H5Out;
use crate::{FormatError, Result};
use ndarray::ArrayView1;
use std::path::Path;

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Real numbers; NaN where a value is missing.
    Real(Vec<f64>),
    /// Integers.
    Integer(Vec<i64>),
    /// Texts.
    Text(Vec<String>),
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Real(v) => v.len(),
            Self::Integer(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }
}

/// A table with its name; columns have names (without a slash) and equal lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the group.
    pub name: String,
    /// Columns in order.
    pub columns: Vec<(String, Column)>,
}

/// Write tables; the datasets `TABLE/COLUMN` hold the values, `history` the text.
///
/// # Errors
/// Columns of different lengths, an existing output that may not be overwritten, or an error of the file system.
pub fn write_tables(path: &Path, tables: &[Table], history: &[String], overwrite: bool) -> Result<()> {
    for table in tables {
        let rows = table.columns.first().map_or(0, |c| c.1.len());
        if let Some((name, column)) = table.columns.iter().find(|c| c.1.len() != rows || c.0.contains('/')) {
            return Err(FormatError::Malformed {
                path: path.into(),
                place: format!("column {name:?} of table {}", table.name),
                expected: format!("a name without a slash and {rows} values"),
                found: format!("{} values", column.len()),
            });
        }
    }
    let out = H5Out::create(path, overwrite)?;
    for table in tables {
        for (name, column) in &table.columns {
            let name = format!("{}/{name}", table.name);
            match column {
                Column::Real(v) => out.array(&name, ArrayView1::from(v))?,
                Column::Integer(v) => out.array(&name, ArrayView1::from(v))?,
                Column::Text(v) => {
                    let texts: Vec<&str> = v.iter().map(String::as_str).collect();
                    out.texts(&name, &texts, &[texts.len()])?;
                }
            }
        }
    }
    out.text("history", &history.join("\n"))?;
    out.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_back_and_ragged_tables_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        let mut columns = vec![
            ("x".to_owned(), Column::Real(vec![1.5, f64::NAN, -2.0])),
            ("seed".to_owned(), Column::Integer(vec![1, 2, 3])),
            ("layout".to_owned(), Column::Text(vec!["a".into(), String::new(), "ccc".into()])),
        ];
        let table = |columns: &[(String, Column)]| Table { name: "trials".into(), columns: columns.to_vec() };
        write_tables(&path, &[table(&columns)], &["made".into()], false).unwrap();
        let file = crate::h5::open(&path, "").unwrap();
        let x = file.list("trials/x", 3).unwrap();
        assert!(x[0] == 1.5 && x[1].is_nan() && x[2] == -2.0);
        assert!(file.has("trials/layout") && file.has("trials/seed"));
        columns[1].1 = Column::Integer(vec![1]);
        assert!(write_tables(&path, &[table(&columns)], &[], true).unwrap_err().to_string().contains("seed"));
    }
}
