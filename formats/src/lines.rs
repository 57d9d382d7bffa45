//! Texts of comma-separated columns with names, read line by line.

use crate::{FormatError, Result, read_text};
use std::path::Path;

/// The lines of a file. Lines that begin with `#` are comments.
pub(crate) struct Lines<'a> {
    path: &'a Path,
    names: Vec<String>,
    reader: csv::Reader<std::io::Cursor<String>>,
    record: csv::StringRecord,
}

impl<'a> Lines<'a> {
    /// Open a file that may have these columns.
    ///
    /// # Errors
    /// A column of another name, or one that stands twice.
    pub(crate) fn open(path: &'a Path, known: &[&str]) -> Result<Self> {
        let text = read_text(path)?;
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(std::io::Cursor::new(text));
        let names: Vec<String> = reader.headers().map_err(|e| broken(path, &e))?.iter().map(str::to_ascii_lowercase).collect();
        let strange = names.iter().enumerate().find(|(k, n)| !known.contains(&n.as_str()) || names[..*k].contains(n));
        if let Some((_, name)) = strange {
            let expected = format!("names out of {}, each once", known.join(", "));
            return Err(FormatError::malformed(path, "names of the columns", expected, format!("{name:?}")));
        }
        Ok(Self { path, names, reader, record: csv::StringRecord::new() })
    }

    /// Check that columns are there.
    pub(crate) fn require(&self, names: &[&str]) -> Result<()> {
        match names.iter().find(|n| !self.has(n)) {
            None => Ok(()),
            Some(name) => Err(FormatError::malformed(self.path, "names of the columns", format!("a column {name}"), self.names.join(","))),
        }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// Go to the next line; false at the end.
    pub(crate) fn next(&mut self) -> Result<bool> {
        self.reader.read_record(&mut self.record).map_err(|e| broken(self.path, &e))
    }

    pub(crate) fn text(&self, name: &str) -> Result<String> {
        Ok(self.names.iter().position(|n| n == name).and_then(|k| self.record.get(k)).unwrap_or("").to_owned())
    }

    pub(crate) fn number(&self, name: &str) -> Result<f64> {
        let field = self.text(name)?;
        let line = self.record.position().map_or(0, csv::Position::line);
        let number = field.parse::<f64>().ok().filter(|v| v.is_finite());
        number.ok_or_else(|| FormatError::malformed(self.path, format!("line {line}, {name}"), "a finite number", format!("{field:?}")))
    }

    /// The number of a column that may be missing.
    pub(crate) fn number_or(&self, name: &str, other: f64) -> Result<f64> {
        if self.has(name) { self.number(name) } else { Ok(other) }
    }
}

fn broken(path: &Path, error: &csv::Error) -> FormatError {
    let line = error.position().map_or("the text".to_owned(), |p| format!("line {}", p.line()));
    FormatError::malformed(path, line, "as many fields as column names", error.to_string())
}

/// A name as a field: in quotation marks where it needs them.
pub(crate) fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r', '#']) || name.trim() != name {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
