//! `convert --dry-run`: what a conversion of visibilities would take.

use super::args::ConvertArgs;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Told, format_of};
use crate::cost;
use crate::memory::MemoryBudget;
use cittert_arrays::rows_of_block;
use cittert_formats::{Holds, format_of_output};
use serde_json::Map;
use std::path::Path;

impl Plan for ConvertArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let alone = "--nodes: one process converts a set. Several sets can be converted at the same time";
        ensure!(planner.ranks == 1, Failure::usage(alone));
        let input = self.input.files()?;
        let holds = cittert_formats::format_of(&input.all()[0])?.holds();
        ensure!(matches!(holds, Holds::Visibilities(_)), Failure::usage("--dry-run: only conversions of visibilities have a forecast"));
        let source = input.open_chosen(&self.column, planner.context)?;
        let (header, found) = (source.header(), source.n_rows());
        let of_row = header.spectrum.n_chan() * header.polarizations.len();
        let rows = found as f64 * planner.stretch((found * header.spectrum.n_chan()) as f64)?;
        let changed =
            self.append || self.derotate || self.compression.is_some() || self.column.chosen().is_some() || !self.split.is_empty();
        let mut copied = false;
        if let Some(one) = input.one().filter(|_| !changed) {
            copied = format_of_output(one, &self.output)?.name() == cittert_formats::visibility_format(one)?.name();
        }
        let set = cost::Conversion {
            rows,
            of_row: of_row as f64,
            block_rows: rows_of_block(header, MemoryBudget::default().block()) as f64,
            format: format_of(&input)?,
            copied,
        };
        let mut facts = Map::new();
        facts.insert("rows".into(), rows.into());
        facts.insert("channels".into(), header.spectrum.n_chan().into());
        facts.insert("products".into(), header.polarizations.len().into());
        facts.insert("copied".into(), copied.into());
        let mut forecast = cost::convert(set);
        forecast.assumptions.push("every format is written as fast as UVH5, and as large as its values in single precision".into());
        Ok(Told { command: "convert", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.output
    }
}
