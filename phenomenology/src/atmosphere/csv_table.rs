//! Rows of a CSV table with a header and comment lines that begin with `#`. Every error names the table and the line.

use super::error::PhysicsError;

/// A CSV table in memory.
pub(super) struct CsvTable {
    name: String,
    pub(super) header: CsvRow,
    pub(super) rows: Vec<CsvRow>,
}

/// One row with the number of its line.
pub(super) struct CsvRow {
    pub(super) line: u64,
    pub(super) fields: csv::StringRecord,
}

impl CsvRow {
    fn new(fields: csv::StringRecord) -> Self {
        Self { line: fields.position().map_or(0, csv::Position::line), fields }
    }
}

impl CsvTable {
    /// Reads the text of a table.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] for rows of unequal length.
    pub(super) fn read(name: &str, text: &str) -> Result<Self, PhysicsError> {
        let fault = |e: csv::Error| table_error(name, e.position().map_or(0, csv::Position::line), e.to_string());
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = CsvRow::new(reader.headers().map_err(fault)?.clone());
        let rows = reader.records().map(|r| r.map(CsvRow::new).map_err(fault)).collect::<Result<_, _>>()?;
        Ok(Self { name: name.to_owned(), header, rows })
    }

    /// The error for a line of this table; line 0 means the whole table.
    pub(super) fn fault(&self, line: u64, problem: String) -> PhysicsError {
        table_error(&self.name, line, problem)
    }

    /// The number in a column of a row.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] for a field that is missing or not a number.
    pub(super) fn number(&self, row: &CsvRow, column: usize) -> Result<f64, PhysicsError> {
        let field = row.fields.get(column).ok_or_else(|| self.fault(row.line, format!("column {} is missing", column + 1)))?;
        field.parse().map_err(|_| self.fault(row.line, format!("'{field}' is not a number")))
    }

    /// All rows as `N` numbers.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] for another number of columns, or a field that is not a number.
    pub(super) fn numbers<const N: usize>(&self) -> Result<Vec<[f64; N]>, PhysicsError> {
        let row = |row: &CsvRow| {
            if row.fields.len() != N {
                return Err(self.fault(row.line, format!("{} columns, expected {N}", row.fields.len())));
            }
            let mut numbers = [0.0; N];
            for (column, number) in numbers.iter_mut().enumerate() {
                *number = self.number(row, column)?;
            }
            Ok(numbers)
        };
        self.rows.iter().map(row).collect()
    }
}

fn table_error(name: &str, line: u64, problem: String) -> PhysicsError {
    PhysicsError::Table { table: name.to_owned(), line, problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read<const N: usize>(text: &str) -> Result<Vec<[f64; N]>, PhysicsError> {
        CsvTable::read("t", text)?.numbers()
    }

    #[test]
    fn reads_numbers_below_comments_and_header() {
        assert_eq!(read("# note\na,b\n1,2\n3,4.5\n").unwrap(), vec![[1.0, 2.0], [3.0, 4.5]]);
    }

    #[test]
    fn names_the_line_of_a_bad_number() {
        let message = read::<2>("a,b\n1,2\n3,x\n").unwrap_err().to_string();
        assert_eq!(message, "table t, line 3: 'x' is not a number");
    }

    #[test]
    fn refuses_a_wrong_column_count() {
        assert!(read::<3>("a,b\n1,2\n").is_err());
    }
}
