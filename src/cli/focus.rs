//! `focus`: phase a set to a point near the array.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use super::forecast::{Passing, Plan, Planner, Told, grown};
use super::options::{OutputArgs, SetFiles};
use super::planned::check_room_for_set;
use super::text::angle;
use crate::cost::{self, Stage};
use crate::memory::MemoryBudget;
use crate::nearfield::{
    Elements, FocusOptions, FocusRange, Focusing, FoundRange, RangeChoice, Surface, Validity, bending_rad, find_range, focus_grid,
};
use cittert_arrays::quantity::Length;
use cittert_arrays::{BrightnessUnit, FocusPoint, Image, NearField, Polarization, SkyGrid, SpectralWindow};
use clap::Args;
use ndarray::Axis;
use serde_json::json;
use std::f64::consts::FRAC_PI_8;
use std::path::{Path, PathBuf};

/// Options of `focus`.
#[derive(Debug, Args)]
pub struct FocusArgs {
    /// Visibilities of an array in the frame of its boresight.
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    how: FocusOptions,
    /// Also write the residual phase of a Fourier image of the result at each pixel, rad.
    #[arg(long, value_name = "FITS")]
    map: Option<PathBuf>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Phase a set to a point, and say where a Fourier image of it is valid.
///
/// # Errors
/// The file or an option is wrong, the data do not tell the range that is asked for, or an error of the file system.
pub fn run(args: &FocusArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    args.how.check().map_err(Failure::call)?;
    args.out.claim([path].into_iter().chain(&args.map), [&args.input])?;
    let mut source = cittert_formats::open_visibilities(&args.input)?;
    check_room_for_set(source.as_ref(), path)?;
    let what = format!("focusing {}", args.input.display());
    let grid = focus_grid(&args.how, source.header(), false).context(&what)?;
    let found = match args.how.range {
        FocusRange::Auto => {
            let nearest = args.how.nearest_m(source.header());
            let searched = focus_grid(&args.how, source.header(), true).context(&what)?;
            Some(find_range(source.as_mut(), &searched, nearest, MemoryBudget::default(), &context.console).context(&what)?)
        }
        _ => None,
    };
    let focus = args.how.point(found.as_ref().map(|f| f.range_m)).map_err(Failure::call)?;
    let focusing = Focusing::new(source.header(), focus).context(&what)?;
    let mut header = focusing.header().clone();
    header.history.push(context.history());
    if let Some(f) = &found {
        header.history.push(format!("focus: sharpest at {} m +- {} m", f.range_m, f.sigma_m));
    }
    let mut sink = args.out.visibilities(&header, context)?;
    focusing.run(source.as_mut(), sink.as_mut(), MemoryBudget::default().block(), &context.console).context(&what)?;
    sink.finish().context(format!("{}", path.display()))?;

    let elements = Elements::new(&header.layout, None)?;
    let top_hz = header.spectrum.range_hz().1;
    let surface = surface_of(&header.near_field);
    let validity = surface.as_ref().map(|s| Validity::new(&elements, focus, s, &grid, top_hz)).transpose().context(&what)?;
    let bending = focus.map(|f| bending_rad(&elements, f, top_hz));
    let mut json = json!({
        "output": path, "n_blts": source.n_rows(), "focus": focus.map(|f| [f.l, f.m, f.range_m]), "curvature_rad": bending,
        "size": [grid.n_l, grid.n_m], "cell_rad": grid.cell_rad,
    });
    let mut lines = vec![match focus {
        Some(f) if f.is_on_axis() => format!("{}: focused at {:.6}", path.display(), Length(f.range_m)),
        Some(f) => format!("{}: focused at l {:.6}, m {:.6}, {:.6} away", path.display(), f.l, f.m, Length(f.range_m)),
        None => format!("{}: phased to the boresight at infinity", path.display()),
    }];
    if let Some(f) = &found {
        lines.push(found_line(f));
        json["range_m"] = f.range_m.into();
        json["range_sigma_m"] = f.sigma_m.into();
        json["significance"] = f.significance.into();
    }
    if let Some(bending) = bending {
        lines.push(format!("curvature     {bending:.2} rad across the array were taken out"));
    }
    if let Some(v) = &validity {
        json["valid_pixels"] = v.valid.into();
        json["pixels"] = v.pixels.into();
        json["valid_radius_rad"] = v.radius_rad.into();
        json["largest_residual_rad"] = v.largest_rad().into();
        lines.push(format!(
            "valid         {} of {} pixels have a residual phase below pi/8 ({FRAC_PI_8:.3} rad), among them all within {} of the focus; the largest is {:.2} rad",
            v.valid,
            v.pixels,
            angle(v.radius_rad),
            v.largest_rad()
        ));
    }
    let mut outcome = Outcome::new(json, lines.join("\n")).wrote(path);
    if let (Some(file), Some(v)) = (&args.map, validity) {
        let band = SpectralWindow::new(vec![header.spectrum.mean_hz()], vec![header.spectrum.extent_hz()])?;
        let data = v.phase_rad.insert_axis(Axis(0)).insert_axis(Axis(0));
        let mut image = Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Other)?;
        image.object = "residual phase in rad".into();
        image.near_field = header.near_field.clone();
        image.history.push("largest residual phase of all pairs of antennas, rad; a Fourier image is valid below pi/8".into());
        args.out.image(file, &mut image, context)?;
        outcome = outcome.wrote(file);
    } else if args.map.is_some() {
        return Err(Failure::usage("--map needs a focus, or a set that says where its scene is"));
    }
    Ok(outcome)
}

/// Where the scene is: as the set says, or the plane through the focus.
fn surface_of(near: &NearField) -> Option<Surface> {
    let known = RangeChoice::Auto.surface_of(near).ok();
    let plane = |f: FocusPoint| Surface::Plane(f.range_m * f.direction()[2]);
    known.or(near.focus.map(plane))
}

fn found_line(f: &FoundRange) -> String {
    format!(
        "range         {:.6} m, standard deviation {:.2} %, {:.0} deviations above other ranges",
        f.range_m,
        100.0 * f.sigma_m / f.range_m,
        f.significance
    )
}

/// Rows that are phased first for a forecast, and lines of pixels whose residual phase is found first.
const FIRST_ROWS: usize = 1024;
const FIRST_LINES: usize = 8;

impl Plan for FocusArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.how.check().map_err(Failure::call)?;
        let search = matches!(self.how.range, FocusRange::Auto);
        ensure!(!search, Failure::unforeseen("--dry-run: no forecast of a search for the range. Give a distance, such as --range 10m"));
        let input = SetFiles::of(std::slice::from_ref(&self.input))?;
        let mut source = input.open(planner.context)?;
        let Passing { set, header, mut facts } = Passing::of(&input, source.as_ref(), false, planner)?;
        let what = format!("focusing {}", self.input.display());
        let grid = focus_grid(&self.how, &header, false).context(&what)?;
        let focus = self.how.point(None).map_err(Failure::call)?;
        let focusing = Focusing::new(&header, focus).context(&what)?;
        let rows = grown((set.rows, source.n_rows()), FIRST_ROWS, &mut |n| Ok(focusing.apply(&mut source.read_rows(0..n)?, 0)?))?;
        // The rows are read and phased together.
        let mut forecast = cost::convert(set);
        forecast.stages.retain(|s| s.name != "read");
        let held = 2.0 * set.block_bytes();
        forecast.stages.insert(1, Stage { timed_s: rows.seconds, ..Stage::new("phases", held) });
        if let Some(surface) = surface_of(&focusing.header().near_field) {
            let elements = Elements::new(&header.layout, None)?;
            let lines = grown((grid.n_m as f64, grid.n_m), FIRST_LINES, &mut |n| {
                let some = SkyGrid::new(grid.n_l, n.max(2), grid.cell_rad, grid.frame.clone())?;
                Validity::new(&elements, focus, &surface, &some, header.spectrum.range_hz().1)?;
                Ok(())
            })?;
            forecast.stages.push(Stage { timed_s: lines.seconds, ..Stage::new("residual phases", lines.held_bytes) });
        }
        forecast.assumptions.push(rows.assumption("rows"));
        facts.insert("size".into(), json!([grid.n_l, grid.n_m]));
        Ok(Told { command: "focus", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
