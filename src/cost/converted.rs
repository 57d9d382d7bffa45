//! The stages of `convert`, `applycal` and `corrupt`: rows go block by block from one file into another.

use super::held::COVERAGE;
use super::image::InputFormat;
use super::sampled::{RAW, STORED, STORED_ROW, WRITER};
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

/// A set whose visibilities are multiplied by gains or divided by them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gained {
    /// The set. Where its file is copied, the visibilities of the copy are changed.
    pub set: Conversion,
    /// True where the file holds numbers of 64 bits.
    pub double: bool,
    /// How often its rows are read.
    pub readings: f64,
    /// Gains that are made, and kept for a table.
    pub gains: f64,
}

/// A value of a record of a UVFITS file or a Measurement Set, as it is read.
const RECORD: f64 = 24.0;
/// A value of a file whose visibilities are changed: what the file held before is compared. Numbers of 64 bits are read to keep what does not change.
const COMPARED: f64 = 28.0;
const COMPARED_DOUBLE: f64 = 26.0;
/// The time and the antennas of a row, from which gains are drawn.
const SURVEYED: f64 = 25.0;
/// A gain with its flag and its error, while it is made and in the table.
const GAIN: f64 = 47.0;

impl Conversion {
    fn values(&self) -> f64 {
        self.rows * self.of_row
    }

    fn block_values(&self) -> f64 {
        self.block_rows.min(self.rows) * self.of_row
    }

    /// Bytes of a block of rows.
    #[must_use]
    pub fn block_bytes(&self) -> f64 {
        self.block_values() * RAW + self.block_rows.min(self.rows) * COVERAGE
    }

    fn output_bytes(&self) -> f64 {
        self.values() * STORED + self.rows * STORED_ROW
    }

    /// The start of the program and some passes that read the set.
    fn read(&self, passes: f64) -> Vec<Stage> {
        let read = Stage { read_bytes: passes * self.output_bytes(), ..Stage::new("read", self.block_values() * RAW) };
        vec![
            Stage::new("start", 0.0).doing([(Term::Command, 1.0)]),
            read.doing([(self.format.term(), passes * self.values()), (Term::ReadRow, passes * self.rows)]),
        ]
    }
}

/// The forecast of a conversion.
#[must_use]
pub fn convert(set: Conversion) -> Forecast {
    let written = if set.copied { 0.0 } else { 1.0 };
    let write = Stage::new("write", 2.0 * set.block_values() * RAW);
    let mut stages = set.read(1.0);
    stages.push(write.doing([(Term::WriteValue, written * set.values()), (Term::WriteRow, set.rows)]));
    Forecast { stages, output_bytes: set.output_bytes(), ..Forecast::default() }
}

/// The forecast of gains that go into a set or out of it.
#[must_use]
pub fn gained(work: Gained) -> Forecast {
    let set = &work.set;
    let (values, block) = (set.values(), set.block_values());
    let numbers = if work.double { 2.0 } else { 1.0 };
    let output = match (set.copied, work.double) {
        (true, true) => block * (COMPARED + COMPARED_DOUBLE),
        (true, false) => block * COMPARED,
        (false, _) => WRITER,
    };
    let record = if set.format == InputFormat::Uvh5 { 0.0 } else { block * RECORD };
    let surveyed = if work.gains > 0.0 { set.rows * SURVEYED } else { 0.0 };
    let held = block * RAW + set.block_rows.min(set.rows) * COVERAGE + output + record + surveyed + work.gains * GAIN;
    let written = if set.copied { (Term::Edit, numbers * values) } else { (Term::WriteGains, values) };
    let made = if work.gains > 0.0 { 2.0 } else { 1.0 };
    let mut stages = set.read(work.readings);
    stages.push(Stage::new("gains", held).doing([(Term::Apply, made * values), written, (Term::GainRow, set.rows)]));
    Forecast { stages, output_bytes: numbers * set.output_bytes(), ..Forecast::default() }
}
