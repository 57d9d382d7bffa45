//! `grid`: gridded visibilities.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::{ColumnArgs, ImagingArgs, OutputArgs};
use super::text::number;
use crate::imaging::Imager;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `grid`.
#[derive(Debug, Args)]
pub struct GridArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingArgs,
    #[command(flatten)]
    out: OutputArgs,
}

/// Put the visibilities into cells and write them as HDF5.
///
/// # Errors
/// Anything wrong with the file, the options or the disk.
pub fn run(args: &GridArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    args.out.check(path)?;
    let mut source = args.column.open(&args.input)?;
    let what = format!("gridding {}", args.input.display());
    let mut imager = Imager::new(source.as_mut(), args.imaging.options()?, &context.console).context(&what)?;
    let mut grid = imager.cells(&context.console).context(&what)?;
    grid.history.push(context.history());
    cittert_formats::write_grid(path, &grid, args.out.overwrite)?;
    let hit = grid.counts.iter().filter(|c| **c > 0).count();
    let n: u64 = grid.counts.iter().map(|c| u64::from(*c)).sum();
    if grid.n_outside > 0 {
        context.console.warn(&format!("{} visibilities lie outside the grid and are left out: use a smaller --cell", grid.n_outside));
    }
    let (channels, n_v, n_u) = grid.sum.dim();
    let json = json!({
        "output": path, "n_channels": channels, "size": [n_u, n_v], "uv_cell_wavelengths": grid.cell_wl,
        "cells_hit": hit, "n_visibilities": n, "n_outside": grid.n_outside, "sum_of_weights": grid.weights.sum(), "unit": grid.unit.name(),
    });
    let text = format!(
        "{}: {n} visibilities in {hit} cells of {channels} x {n_v} x {n_u}, a cell is {} x {} wavelengths",
        path.display(),
        number(grid.cell_wl[0]),
        number(grid.cell_wl[1])
    );
    Ok(Outcome::new(json, text).wrote(path))
}
