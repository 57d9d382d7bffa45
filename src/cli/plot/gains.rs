//! Pictures of gain tables.

use super::args::{PlotArgs, What};
use crate::calibrate::{CompareOptions, gain_differences};
use crate::cli::failure::{Context as _, Result};
use crate::plot::{self, DEFAULT_HEIGHT, DEFAULT_WIDTH, GainPlot, GainQuantity, Picture};
use cittert_formats::calh5::read_gains;

pub(super) fn draw(args: &PlotArgs) -> Result<Picture> {
    let table = read_gains(args.file())?;
    let differences = match &args.truth {
        None => None,
        Some(path) => {
            let options = CompareOptions { gradient: args.gradient, flux_scale: args.flux_scale };
            let what = format!("comparing {} with {}", args.file().display(), path.display());
            Some(gain_differences(&table, &read_gains(path)?, options).context(what)?)
        }
    };
    let quantity = if args.what == Some(What::Amplitude) { GainQuantity::Amplitude } else { GainQuantity::Phase };
    let name = if quantity == GainQuantity::Phase { "phases" } else { "amplitudes" };
    let title = args.title_or(|| {
        let beside = if differences.is_some() { "Solved and true gain" } else { "Gain" };
        format!("{beside} {name}\n{}", table.layout.name)
    });
    let (n_time, n_ant) = (table.time_jd.len(), table.layout.n_ant());
    let height = if n_time > 1 && n_ant > 12 { DEFAULT_HEIGHT * 9 / 8 } else { DEFAULT_HEIGHT * 3 / 4 };
    let (width, height) = args.size(DEFAULT_WIDTH, height);
    plot::gains(&table, &GainPlot { quantity, differences, title, width, height }).context(format!("drawing {}", args.file().display()))
}
