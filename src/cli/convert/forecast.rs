//! `convert --dry-run`: what a conversion of visibilities would take.

use super::args::ConvertArgs;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::forecast::{Passing, Plan, Planner, Told};
use crate::cost;
use cittert_formats::{Holds, format_of_output};
use std::path::Path;

impl Plan for ConvertArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let input = self.input.files()?;
        let holds = cittert_formats::format_of(&input.all()[0])?.holds();
        ensure!(matches!(holds, Holds::Visibilities(_)), Failure::usage("--dry-run: only conversions of visibilities have a forecast"));
        let source = input.open_chosen(&self.column, planner.context)?;
        let changed =
            self.append || self.derotate || self.compression.is_some() || self.column.chosen().is_some() || !self.split.is_empty();
        let mut copied = false;
        if let Some(one) = input.one().filter(|_| !changed) {
            copied = format_of_output(one, &self.output)?.name() == cittert_formats::visibility_format(one)?.name();
        }
        let Passing { set, facts, .. } = Passing::of(&input, source.as_ref(), copied, planner)?;
        let mut forecast = cost::convert(set);
        forecast.assumptions.push("every format is written as fast as UVH5, and as large as its values in single precision".into());
        Ok(Told { command: "convert", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.output
    }
}
