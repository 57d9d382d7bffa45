//! The work of commands whose rows go block by block from one file into another.

use super::{Planner, format_of};
use crate::cli::failure::Result;
use crate::cli::options::SetFiles;
use crate::cost::Conversion;
use crate::memory::MemoryBudget;
use cittert_arrays::{VisibilityHeader, VisibilitySource, rows_of_block};
use serde_json::{Map, Value};

/// A set that passes through a command, and what is said of it.
pub(in crate::cli) struct Passing {
    pub(in crate::cli) set: Conversion,
    pub(in crate::cli) header: VisibilityHeader,
    pub(in crate::cli) facts: Map<String, Value>,
}

impl Passing {
    /// Look at a set. `copied` is true where the output is a copy of its file.
    ///
    /// # Errors
    /// The file is wrong, or several processes are meant.
    pub(in crate::cli) fn of(input: &SetFiles, source: &dyn VisibilitySource, copied: bool, planner: &Planner<'_>) -> Result<Self> {
        planner.alone("works on a set. Several sets can be worked on at the same time")?;
        let header = source.header().clone();
        let (channels, products, found) = (header.spectrum.n_chan(), header.polarizations.len(), source.n_rows());
        let rows = found as f64 * planner.stretch((found * channels) as f64)?;
        let set = Conversion {
            rows,
            of_row: (channels * products) as f64,
            block_rows: rows_of_block(&header, MemoryBudget::default().block()) as f64,
            format: format_of(input, planner.context)?,
            copied,
        };
        let mut facts = Map::new();
        facts.insert("rows".into(), rows.into());
        facts.insert("channels".into(), channels.into());
        facts.insert("products".into(), products.into());
        facts.insert("copied".into(), copied.into());
        Ok(Self { set, header, facts })
    }
}
