//! Patterns as columns: one line or row for each frequency and direction.

use crate::fits::table::Table;
use crate::{FormatError, Result, read_text};
use cittert_arrays::pattern::{PatternSample, SampledPattern};
use std::path::Path;

/// Names of the columns.
const NAMES: [&str; 5] = ["theta_deg", "power", "power_db", "freq_ghz", "phi_deg"];
/// Frequency of samples that state none, Hz.
const ANY_HZ: f64 = 1e9;

/// Which of [`NAMES`] are there.
#[derive(Clone, Copy)]
struct Present([bool; NAMES.len()]);

impl Present {
    /// Check that the columns make a pattern.
    fn of(path: &Path, names: &[String]) -> Result<Self> {
        let has = NAMES.map(|n| names.iter().any(|name| name.eq_ignore_ascii_case(n)));
        if has[0] && (has[1] != has[2]) {
            return Ok(Self(has));
        }
        let expected = "theta_deg, and power or power_db (and freq_ghz, phi_deg where there are several)";
        Err(FormatError::malformed(path, "names of the columns", expected, names.join(",")))
    }

    /// The sample of a row; `value` gives the number in a column.
    fn sample(self, mut value: impl FnMut(&str) -> Result<f64>) -> Result<PatternSample> {
        let mut optional = |k: usize, default: f64| if self.0[k] { value(NAMES[k]) } else { Ok(default) };
        let power = if self.0[1] { optional(1, 0.0)? } else { 10.0_f64.powf(optional(2, 0.0)? / 10.0) };
        Ok(PatternSample {
            theta_rad: optional(0, 0.0)?.to_radians(),
            freq_hz: optional(3, ANY_HZ / 1e9)? * 1e9,
            phi_rad: optional(4, 0.0)?.to_radians(),
            power,
        })
    }
}

pub(super) fn read_csv(path: &Path) -> Result<SampledPattern> {
    let text = read_text(path)?;
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let broken = |e: csv::Error| {
        let line = e.position().map_or("the text".to_owned(), |p| format!("line {}", p.line()));
        FormatError::malformed(path, line, "as many fields as column names", e.to_string())
    };
    let names: Vec<String> = reader.headers().map_err(broken)?.iter().map(str::to_owned).collect();
    let present = Present::of(path, &names)?;
    let mut samples = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(0, csv::Position::line);
        samples.push(present.sample(|name| {
            let field = names.iter().position(|n| n.eq_ignore_ascii_case(name)).and_then(|k| record.get(k)).unwrap_or("");
            let number = field.parse::<f64>().ok().filter(|v| v.is_finite());
            number.ok_or_else(|| FormatError::malformed(path, format!("line {line}, {name}"), "a finite number", format!("{field:?}")))
        })?);
    }
    table_of(path, &samples)
}

/// The table of the samples of a file.
fn table_of(path: &Path, samples: &[PatternSample]) -> Result<SampledPattern> {
    SampledPattern::of_samples(samples).map_err(|e| FormatError::values(path, e))
}

/// The pattern of a binary table; `None` where it has no column `theta_deg`.
pub(super) fn of_table(path: &Path, table: &Table) -> Result<Option<SampledPattern>> {
    let names: Vec<String> = table.names().map(str::to_owned).collect();
    if !names.iter().any(|n| n.eq_ignore_ascii_case(NAMES[0])) {
        return Ok(None);
    }
    let present = Present::of(path, &names)?;
    let row = |k: usize| {
        present.sample(|name| {
            let number = table.real(k, &name.to_ascii_uppercase()).filter(|v| v.is_finite());
            number.ok_or_else(|| FormatError::malformed(path, format!("row {k}, {name}"), "a finite number", "none"))
        })
    };
    let samples = (0..table.rows()).map(row).collect::<Result<Vec<_>>>()?;
    table_of(path, &samples).map(Some)
}

#[cfg(test)]
mod tests {
    use crate::fits::HeaderWriter;
    use crate::fits::table::{Form, TableWriter};

    #[test]
    fn a_fits_table_is_read_like_the_columns_of_a_text() {
        let mut table = TableWriter::new("PATTERN", vec![("THETA_DEG", Form::Double(1), "deg"), ("POWER", Form::Double(1), "")]);
        [[0.0, 4.0], [10.0, 2.0], [20.0, 0.0]].iter().for_each(|row| table.each(row));
        let mut primary = HeaderWriter::default();
        primary.logical("SIMPLE", true, "");
        primary.integer("BITPIX", 8, "");
        primary.integer("NAXIS", 0, "");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [primary.finish(), table.finish(|_| {})].concat()).unwrap();
        let pattern = crate::read_pattern(file.path()).unwrap();
        assert!((pattern.power(10f64.to_radians().sin(), 0.0, 1e9) - 0.5).abs() < 1e-12);
    }
}
