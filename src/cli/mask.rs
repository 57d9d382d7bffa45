//! `mask`: the cells of the FFT grid that an array fills.

use super::context::{Context, Outcome};
use super::failure::{Failure, Result};
use super::forecast::{Plan, Planner, Told, grown};
use super::options::{OutputArgs, load_array};
use super::picture;
use crate::cost::{self, Stage, Term};
use crate::memory::{ImageWork, check_images};
use crate::simulate::mask::{UvMask, uv_mask};
use crate::simulate::{BandOptions, PlannedTrack, TrackOptions};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{SkyGrid, SpectralWindow};
use cittert_formats::fits::{LinearAxis, write_plane};
use clap::Args;
use serde_json::Map;
use std::path::Path;

/// Options of `mask`.
#[derive(Debug, Args)]
pub struct MaskArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    #[command(flatten)]
    band: BandOptions,
    #[command(flatten)]
    track: TrackOptions,
    /// Number of pixels along each side of the image, which is also the number of cells of its Fourier grid.
    #[arg(long, value_name = "N")]
    size: usize,
    /// Size of a pixel of the image. A u-v cell is 1 / (size x cell) wavelengths.
    #[arg(long, value_name = "ANGLE")]
    cell: Angle,
    /// Do not write the picture beside the FITS file.
    #[arg(long)]
    no_png: bool,
    #[command(flatten)]
    out: OutputArgs,
}

/// Number of rows in a block.
const BLOCK_ROWS: usize = 65_536;

/// Make the mask and write it as FITS (counts on the u-v grid, in wavelengths) and PNG.
///
/// # Errors
/// The layout or an option is wrong, or an error of the file system.
pub fn run(args: &MaskArgs, context: &Context) -> Result<Outcome> {
    let fits = &args.out.output;
    if fits.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Failure::usage(format!("-o {}: name the FITS file; the picture is written beside it as .png", fits.display())));
    }
    let png = fits.with_extension("png");
    args.out.claim([fits].into_iter().chain((!args.no_png).then_some(&png)), [&args.layout])?;
    let layout = load_array(&args.layout)?;
    let spectrum = args.band.spectrum()?;
    let PlannedTrack { center, plan } = args.track.plan(&layout).map_err(Failure::call)?;
    super::planned::warn(&plan, context);
    super::planned::check_size(&plan, spectrum.n_chan(), None, context)?;
    let grid = SkyGrid::new(args.size, args.size, args.cell.si(), SkyGrid::frame_of(&center))?;
    check_images((args.size, args.size), ImageWork::Transform)?;
    let mask = uv_mask(&grid, &spectrum, &mut plan.blocks(BLOCK_ROWS))?;
    write(args, &mask, &spectrum, context)?;
    if mask.outside > 0 {
        context.console.warn(&format!(
            "{} of {} visibilities lie outside the grid (longest baseline {:.4e} wavelengths, grid {:.4e}): use a smaller --cell",
            mask.outside,
            mask.samples,
            mask.longest_wavelengths,
            mask.cell_u * (args.size / 2) as f64
        ));
    }
    let mut outcome = outcome(&mask, args).wrote(fits);
    if !args.no_png {
        let title = format!("u-v coverage of {}", layout.name);
        args.out.write(&png, &picture::mask(&mask, &title)?)?;
        outcome = outcome.wrote(png);
    }
    Ok(outcome)
}

fn write(args: &MaskArgs, mask: &UvMask, spectrum: &SpectralWindow, context: &Context) -> Result<()> {
    let crpix = (args.size / 2 + 1) as f64;
    let axis = |name: &str, cdelt| LinearAxis { ctype: name.into(), cunit: "lambda".into(), crpix, crval: 0.0, cdelt };
    let counts = mask.counts.mapv(f64::from);
    let history = [
        context.history(),
        format!("u-v mask at {} Hz, {} channels over {} Hz", spectrum.mean_hz(), spectrum.n_chan(), spectrum.extent_hz()),
    ];
    write_plane(
        &args.out.output,
        counts.view(),
        &[axis("UU", mask.cell_u), axis("VV", mask.cell_v)],
        "hits",
        &history,
        args.out.overwrite,
    )?;
    Ok(())
}

fn outcome(mask: &UvMask, args: &MaskArgs) -> Outcome {
    let json = serde_json::json!({
        "output": args.out.output,
        "cells_hit": mask.cells_hit(),
        "disc_fraction": mask.disc_fraction(),
        "grid_fraction": mask.grid_fraction(),
        "visibilities_per_cell": mask.visibilities_per_cell(),
        "n_visibilities": mask.samples,
        "n_outside": mask.outside,
        "uv_cell_wavelengths": mask.cell_u,
        "longest_wavelengths": mask.longest_wavelengths,
    });
    let text = format!(
        "{} cells of {} x {} hit; {:.2} % of the disc of the longest baseline ({:.4e} wavelengths) filled; {:.2} visibilities in a cell that is hit",
        mask.cells_hit(),
        args.size,
        args.size,
        100.0 * mask.disc_fraction(),
        mask.longest_wavelengths,
        mask.visibilities_per_cell()
    );
    Outcome::new(json, text)
}

impl Plan for MaskArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("makes a mask")?;
        planner.no_visibilities("the rows of a mask follow from the layout")?;
        let layout = load_array(&self.layout)?;
        let spectrum = self.band.spectrum()?;
        let PlannedTrack { center, plan } = self.track.plan(&layout).map_err(Failure::call)?;
        let grid = SkyGrid::new(self.size, self.size, self.cell.si(), SkyGrid::frame_of(&center))?;
        check_images((self.size, self.size), ImageWork::Transform)?;
        let found = grown((plan.n_rows() as f64, plan.n_rows()), BLOCK_ROWS.min(plan.n_rows() / 4), &mut |n| {
            uv_mask(&grid, &spectrum, &mut (0..n).step_by(BLOCK_ROWS).map(|first| plan.rows(first..(first + BLOCK_ROWS).min(n))))?;
            Ok(())
        })?;
        let pixels = (self.size * self.size) as f64;
        let mut forecast = cost::timed("mask", (found.seconds, found.held_bytes), if self.no_png { 0.0 } else { 1.0 });
        let write = Stage::new("write", found.held_bytes + 2.0 * pixels * 8.0);
        forecast.stages.push(write.doing([(Term::WritePixel, pixels), (Term::PicturePixel, if self.no_png { 0.0 } else { pixels })]));
        forecast.output_bytes += 4.0 * pixels;
        forecast.assumptions.push(found.assumption("rows"));
        let mut facts = Map::new();
        facts.insert("rows".into(), plan.n_rows().into());
        facts.insert("channels".into(), spectrum.n_chan().into());
        facts.insert("size".into(), serde_json::json!([self.size, self.size]));
        Ok(Told { command: "mask", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
