//! Reads the line catalogues, CSV with comment lines.

use crate::atmosphere::error::PhysicsError;

/// Reads the rows of a numeric table of `N` columns below one header line.
///
/// # Errors
/// [`PhysicsError::Table`] with the line at fault.
pub(super) fn read_rows<const N: usize>(table: &'static str, text: &str) -> Result<Vec<[f64; N]>, PhysicsError> {
    let fault = |line: u64, problem: String| PhysicsError::Table { table: table.to_owned(), line, problem };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| fault(0, e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != N {
            return Err(fault(line, format!("{} columns where {N} are due", record.len())));
        }
        let mut row = [0.0; N];
        for (value, field) in row.iter_mut().zip(record.iter()) {
            *value = field.parse().map_err(|_| fault(line, format!("'{field}' is not a number")))?;
        }
        rows.push(row);
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_numbers_below_comments_and_header() {
        let rows = read_rows::<2>("t", "# note\na,b\n1,2\n3,4.5\n").unwrap();
        assert_eq!(rows, vec![[1.0, 2.0], [3.0, 4.5]]);
    }

    #[test]
    fn names_the_line_of_a_bad_number() {
        let message = read_rows::<2>("t", "a,b\n1,2\n3,x\n").unwrap_err().to_string();
        assert_eq!(message, "table t, line 3: 'x' is not a number");
    }

    #[test]
    fn refuses_a_wrong_column_count() {
        assert!(read_rows::<3>("t", "a,b\n1,2\n").is_err());
    }
}
