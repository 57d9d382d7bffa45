//! Pictures of layouts.

use super::args::{PlotArgs, What};
use super::title;
use crate::cli::failure::{Failure, Result};
use crate::cli::picture;
use crate::plot::{self, DEFAULT_HEIGHT, DEFAULT_WIDTH, Picture, uv_coverage};
use cittert_arrays::{ArrayLayout, CoveragePlan, SpectralWindow};

/// Julian date of the coverage of a layout: noon of the first day of 2025.
const ANY_DATE_JD: f64 = 2_460_677.0;

/// The antennas of a layout, or the u-v coverage of one integration towards the zenith or boresight.
pub(super) fn draw(args: &PlotArgs, array: &ArrayLayout) -> Result<Picture> {
    let (width, height) = args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT);
    match args.what {
        Some(What::Uv) => {
            let freq = args.freq.ok_or_else(|| {
                Failure::usage(format!("{}: --what uv of a layout needs --freq, because u and v count wavelengths", args.file().display()))
            })?;
            // The date only fills the time column: the baselines are those of the layout.
            let coverage = CoveragePlan::snapshot(array, ANY_DATE_JD, 1.0)?.coverage()?;
            let title = args.title_or(|| format!("u-v coverage of {}\n{}, one integration", array.name, title::frequency(freq.si())));
            let band = SpectralWindow::new(vec![freq.si()], vec![freq.si()])?;
            Ok(uv_coverage(&coverage, &band, &title, width, height)?)
        }
        Some(What::Visibilities) => Err(Failure::usage(format!(
            "{}: a layout has no visibilities: use --what antennas or --what uv, or simulate them first",
            args.file().display()
        ))),
        _ => antennas(args, array),
    }
}

/// The antennas from above.
pub(super) fn antennas(args: &PlotArgs, layout: &ArrayLayout) -> Result<Picture> {
    let (width, height) = args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT);
    Ok(plot::layout(layout, &args.title_or(|| picture::layout_title(layout)), width, height)?)
}
