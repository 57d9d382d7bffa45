//! Tables that are compiled in as text.

use serde::de::DeserializeOwned;

/// The rows of a CSV table with a header line and lines of comment after `#`. A row that does not fit is left out, so each user of a table
/// tests how many rows there are.
pub(crate) fn rows<T: DeserializeOwned>(csv: &str) -> Vec<T> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(csv.as_bytes()).into_deserialize().flatten().collect()
}
