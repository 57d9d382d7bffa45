//! The stages of `convert`: rows go block by block from one file into another.

use super::image::InputFormat;
use super::sampled::{RAW, STORED, STORED_ROW};
use super::stage::{Forecast, Stage};
use super::term::Term;

/// A set that is converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Rows.
    pub rows: f64,
    /// Channels times products.
    pub of_row: f64,
    /// Rows of a block.
    pub block_rows: f64,
    /// Format of the input.
    pub format: InputFormat,
    /// True where the output is a copy of the file, whose rows are only read.
    pub copied: bool,
}

/// The forecast of a conversion.
#[must_use]
pub fn convert(set: Conversion) -> Forecast {
    let (values, block) = (set.rows * set.of_row, set.block_rows.min(set.rows) * set.of_row * RAW);
    let output_bytes = values * STORED + set.rows * STORED_ROW;
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let read = Stage { read_bytes: output_bytes, ..Stage::new("read", block) };
    let written = if set.copied { 0.0 } else { 1.0 };
    let write = Stage::new("write", 2.0 * block).doing([(Term::WriteValue, written * values), (Term::WriteRow, set.rows)]);
    let read = read.doing([(set.format.term(), values), (Term::ReadRow, set.rows)]);
    Forecast { stages: vec![start, read, write], output_bytes, ..Forecast::default() }
}
