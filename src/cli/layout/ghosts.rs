//! `layout show --ghosts`: the map of where ghosts lie.

use super::told::Told;
use crate::cli::failure::{Failure, Result};
use crate::cli::options::OutputArgs;
use crate::cli::text::angle;
use crate::plot;
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{
    ArrayLayout, BrightnessUnit, CoveragePlan, FigureOptions, GhostMap, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow,
};
use cittert_formats::fits::{ImageOptions, write_image};
use clap::Args;
use ndarray::Axis;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Lobes of at least this level are marked in the maps of a comparison, and by default in those of `layout show`, dB.
pub(super) const LEVEL_DB: f64 = -6.0;
/// Width and height of the picture, pixels.
const SIZE: (usize, usize) = (860, 820);

/// Options of the map.
#[derive(Debug, Args)]
#[command(next_help_heading = "Map of ghosts")]
pub(super) struct GhostArgs {
    /// Draw the beam over the directions in which ghosts lie into this file: a picture (.png), or an image of the levels (.fits).
    #[arg(long, value_name = "FILE")]
    pub(super) ghosts: Option<PathBuf>,
    /// Level from which a lobe of the map counts as a ghost, in dB of the peak.
    #[arg(long, value_name = "DB", default_value_t = LEVEL_DB, allow_negative_numbers = true)]
    ghost_level: f64,
}

impl GhostArgs {
    /// Refuse what has no effect, and files that are neither a picture nor an image.
    pub(super) fn check(&self, has_freq: bool) -> Result<()> {
        let Some(file) = &self.ghosts else {
            let unused = self.ghost_level.to_bits() == LEVEL_DB.to_bits();
            return if unused { Ok(()) } else { Err(Failure::usage("--ghost-level needs --ghosts: without a map no lobe is listed")) };
        };
        if !has_freq {
            return Err(Failure::usage("--ghosts needs --freq: where ghosts lie depends on the wavelength"));
        }
        if is(file, "png") || is(file, "fits") {
            return Ok(());
        }
        Err(Failure::usage(format!("--ghosts {}: name a file that ends in .png or .fits", file.display())))
    }

    /// Make the map, write it, and tell what it shows. Returns the file.
    pub(super) fn tell(
        &self,
        (layout, given): (&ArrayLayout, &str),
        (freq, options, track): (Frequency, &FigureOptions, Option<&CoveragePlan>),
        overwrite: bool,
        told: &mut Told,
    ) -> Result<Option<&Path>> {
        let Some(file) = &self.ghosts else { return Ok(None) };
        let out = OutputArgs { output: file.clone(), overwrite };
        out.claim([file], [given])?;
        let map = layout.ghost_map(freq.si(), options, track, self.ghost_level).map_err(|e| Failure::call(e.into()))?;
        told.add(json!({ "ghost_map": summary(&map, file, self.ghost_level) }));
        told.line("ghost map", format_args!("{}, {} from the source to each side", file.display(), angle(map.radius().min(1.0).asin())));
        told.line("", in_words(&map, self.ghost_level));
        if is(file, "png") {
            let title = format!("{}\nbeam at {freq}, lobes of at least {} dB", layout.name, self.ghost_level);
            out.write(file, &plot::ghosts(&map, &title, SIZE.0, SIZE.1)?.png()?)?;
        } else {
            write_image(file, &image(&map, freq)?, ImageOptions { overwrite, double: false })?;
        }
        Ok(Some(file))
    }
}

fn is(file: &Path, ending: &str) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// The lobes in a sentence.
pub(super) fn in_words(map: &GhostMap, level_db: f64) -> String {
    if map.ghosts.steps.len() == 1 {
        return "the ghosts of a line of antennas are lines across the sky".into();
    }
    let distance = |l: &cittert_arrays::GhostLobe| l.lm[0].hypot(l.lm[1]);
    let Some(nearest) = map.lobes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
        return format!("no lobe of {level_db} dB or more");
    };
    let (count, db) = (map.lobes.len(), 10.0 * nearest.level.log10());
    let lobes = if count == 1 { "lobe".to_owned() } else { "lobes".to_owned() };
    format!(
        "{count} {lobes} of {level_db} dB or more and as many opposite, the nearest {} from the source ({:.1} dB)",
        angle(distance(nearest).min(1.0).asin()),
        if db > -0.05 { 0.0 } else { db }
    )
}

fn summary(map: &GhostMap, file: &Path, level_db: f64) -> Value {
    let lobe = |l: &cittert_arrays::GhostLobe| json!({ "l": l.lm[0], "m": l.lm[1], "distance_rad": l.lm[0].hypot(l.lm[1]).min(1.0).asin(), "level_db": 10.0 * l.level.log10() });
    json!({
        "file": file, "level_db": level_db, "radius": map.radius(), "cell": map.cell,
        "lobes": map.lobes.iter().map(lobe).collect::<Vec<_>>(),
    })
}

/// The levels as an image of direction cosines.
fn image(map: &GhostMap, freq: Frequency) -> Result<Image> {
    let side = map.levels.dim().0;
    let grid = SkyGrid::new(side, side, map.cell, SkyFrame::Boresight)?;
    let data = map.levels.clone().insert_axis(Axis(0)).insert_axis(Axis(0));
    let spectrum = SpectralWindow::new(vec![freq.si()], vec![freq.si()])?;
    Ok(Image::new(grid, spectrum, vec![Polarization::I], data, BrightnessUnit::One)?)
}
