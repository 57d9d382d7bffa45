//! The tables of independent software that the tests compare with.

use std::path::PathBuf;

/// The path of a table in `tests/oracle` of the project.
fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/oracle").join(name)
}

/// The text of a table. A missing table fails the test.
pub(crate) fn text(name: &str) -> String {
    let path = path(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("no oracle table {}: {e}", path.display()))
}

/// A table with a header.
pub(crate) struct Table {
    names: Vec<String>,
    pub rows: Vec<csv::StringRecord>,
}

impl Table {
    /// The table of a name. A missing or empty table fails the test.
    pub fn open(name: &str) -> Self {
        let text = text(name);
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        let names = reader.headers().unwrap().iter().map(str::to_owned).collect();
        let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
        assert!(!rows.is_empty(), "{name} has no rows");
        Self { names, rows }
    }

    pub fn text<'a>(&self, row: &'a csv::StringRecord, name: &str) -> &'a str {
        let i = self.names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}"));
        &row[i]
    }

    pub fn number(&self, row: &csv::StringRecord, name: &str) -> f64 {
        self.text(row, name).parse().unwrap()
    }
}

#[test]
#[should_panic(expected = "tests/oracle/absent.csv")]
fn a_missing_table_fails_with_its_path() {
    text("absent.csv");
}
