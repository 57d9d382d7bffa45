//! `grid`: gridded visibilities.

use super::context::{Context, Outcome};
use super::failure::Result;
use super::forecast::{Plan, Planner, Told};
use super::options::ImageOfArgs;
use super::text::number;
use crate::cost::{self, WavePasses};
use clap::Args;
use serde_json::json;

/// Options of `grid`.
#[derive(Debug, Args)]
pub struct GridArgs {
    #[command(flatten)]
    of: ImageOfArgs,
}

/// Why a range is refused.
const NO_WAVES: &str = "cells of the u-v plane know nothing of spherical waves; focus the set (cittert focus)";

/// Sum the visibilities in cells of the u-v plane and write the cells as HDF5.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &GridArgs, context: &Context) -> Result<Outcome> {
    args.of.no_range(NO_WAVES)?;
    let mut grid = args.of.imaged("gridding", context, |imager| imager.cells(&context.console))?;
    grid.history.push(context.history());
    let path = &args.of.out.output;
    cittert_formats::write_grid(path, &grid, args.of.out.overwrite)?;
    let hit = grid.counts.iter().filter(|c| **c > 0).count();
    let n: u64 = grid.counts.iter().map(|c| u64::from(*c)).sum();
    if grid.n_outside > 0 {
        context.console.warn(&format!("{} visibilities lie outside the grid and are left out: use a smaller --cell", grid.n_outside));
    }
    let (channels, n_v, n_u) = grid.sum.dim();
    let json = json!({
        "output": path, "n_channels": channels, "size": [n_u, n_v], "uv_cell_wavelengths": grid.cell_wl,
        "cells_filled": hit, "n_visibilities": n, "n_outside": grid.n_outside, "sum_of_weights": grid.weights.sum(), "unit": grid.unit.name(),
    });
    let text = format!(
        "{}: {n} visibilities in {hit} cells of {channels} x {n_v} x {n_u}, a cell is {} x {} wavelengths",
        path.display(),
        number(grid.cell_wl[0]),
        number(grid.cell_wl[1])
    );
    Ok(Outcome::new(json, text).wrote(path))
}

impl Plan for GridArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.of.no_range(NO_WAVES)?;
        self.of.planned("grid", planner, (cost::grid, |_| WavePasses::default()), None)
    }

    fn output(&self) -> &std::path::Path {
        &self.of.out.output
    }
}
