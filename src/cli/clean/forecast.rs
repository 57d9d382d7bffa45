//! `clean --dry-run`: what CLEAN would take, with the number of cycles that a rehearsal has shown.

use super::{CleanCommandArgs, half_field_rad};
use crate::calibrate::{ApplyOptions, CalibratedSource, starting_phases};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::cli::forecast::{Acts, Ended, Plan, Planner, Scratch, Told, Watch, facts, format_of, say_waves, waves_of_image};
use crate::cli::options::{loaded, with_range};
use crate::cli::verdict;
use crate::cost::{self, CleanWork, Course, WavePasses};
use crate::deconvolve::{CleanOptions, EXTENDED, chosen_scales};
use crate::imaging::{Imager, Outlook, clean_once};
use cittert_arrays::{Image, SkyGrid, VisibilitySource};

/// The stages that a rehearsal times.
const ACTS: Acts = Acts {
    before: &["test of phases", "weights of the test", "read", "weights", "beam", "dirty image"],
    cycles: &["scales", "minor cycles", "major cycles", "spherical waves"],
    after: &["restored image", "write"],
};

/// The work of one CLEAN by a deconvolver with these options.
pub(in crate::cli) fn work_of(clean: &CleanOptions, name: &str, outlook: &Outlook) -> CleanWork {
    let g = &outlook.grid;
    let beam_px = 1.0 / (outlook.uv_range_wl.1 * g.cell_rad);
    CleanWork {
        components: clean.niter as f64,
        gain: clean.gain,
        course: None,
        most_cycles: clean.max_major as f64,
        hogbom: name == "hogbom",
        scales: if name == EXTENDED { scales_of(clean, (beam_px, outlook.uv_range_wl.0 * g.cell_rad), g) } else { 0.0 },
        tested: false,
        judged: None,
        twice: false,
    }
}

/// Half of the power of the kernel of a scale lies beyond this many cycles over its width.
const HALF_POWER: f64 = 0.4;

/// Number of scales of the minor cycle, for a beam of this width and baselines from so many cycles a pixel on. A scale most of whose power lies below the shortest
/// baseline is not measured, and not used.
fn scales_of(clean: &CleanOptions, (beam_px, shortest): (f64, f64), grid: &SkyGrid) -> f64 {
    let mut scales = clean.scales(beam_px);
    if scales.widths_px.is_empty() {
        scales.widths_px = chosen_scales(&scales, &clean.tuning, grid.n_l.min(grid.n_m));
    }
    scales.widths_px.iter().filter(|width| **width * shortest <= HALF_POWER).count() as f64
}

impl CleanCommandArgs {
    /// Clean the data and judge the model. All images are then thrown away.
    fn rehearse(&self, source: &mut dyn VisibilitySource, watch: &Watch<'_>, context: &Context) -> Result<Ended> {
        let imaging = with_range(&self.imaging)?;
        let imager = Imager::new(source, imaging.clone(), watch)?;
        let field_rad = half_field_rad(imager.grid());
        if !self.startmod.may_solve(imager.survey().uv_range_wl.0, field_rad) {
            let (model, counts) = self.model(imager, watch)?;
            return Ok(Ended { counts, verdict: verdict::timed(source, (model, &imaging), context)? });
        }
        drop(imager);
        let gains = starting_phases(source, self.startmod, field_rad, watch)?;
        let mut calibrated;
        let data: &mut dyn VisibilitySource = match &gains {
            Some(table) => {
                calibrated = CalibratedSource::new(source, table, ApplyOptions::default())?;
                &mut calibrated
            }
            None => source,
        };
        let (model, counts) = self.model(Imager::new(data, imaging.clone(), watch)?, watch)?;
        Ok(Ended { counts, verdict: verdict::timed(data, (model, &imaging), context)? })
    }

    /// The model, and the cycles and components of all output channels. The images are written where there is room for them.
    fn model(&self, mut imager: Imager<'_>, watch: &Watch<'_>) -> Result<(Image, (f64, f64))> {
        let options = loaded(&self.clean, imager.grid())?;
        let cleaned = clean_once(&mut imager, &options, watch)?;
        let (cycles, components) = cleaned.counts();
        let scratch = Scratch::for_image(imager.grid().n_l * imager.grid().n_m * imager.channels().len());
        let (_, model) = cleaned.deliver(&imager, |_, image| scratch.as_ref().map_or(Ok(()), |s| s.image(&image)))?;
        scratch.map_or(Ok(()), |s| s.image(&model))?;
        Ok((model, (cycles as f64, components as f64)))
    }
}

impl Plan for CleanCommandArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.clean.check()?;
        let input = self.input.files()?;
        let mut source = input.open_chosen(&self.column, planner.context)?;
        let mut looked = planner.outlook(source.as_mut(), &self.imaging)?;
        let waves = waves_of_image(&self.imaging, source.header(), &mut looked.0, planner)?;
        let outlook = &looked.0;
        let work = CleanWork {
            tested: self.startmod.may_solve(outlook.uv_range_wl.0, half_field_rad(&outlook.grid)),
            judged: verdict::transform(source.header(), &looked, &self.imaging, waves.is_some())?,
            twice: self.hold_out.is_made(source.as_ref(), &outlook.grid, &self.imaging),
            ..work_of(&self.clean, self.clean.entry()?.name, outlook)
        };
        let format = format_of(&input, planner.context)?;
        let forecast = |course: Option<Course>| {
            let work = CleanWork { course, ..work };
            let plain = cost::clean(outlook, (format, planner.threads), &work, &planner.speeds);
            let Some(waves) = &waves else { return plain };
            let mut forecast = waves.put_into(plain, outlook, &WavePasses::of_clean(outlook, &work, (waves, &planner.speeds)));
            forecast.assumptions.push(WavePasses::LIT_TILES.into());
            forecast
        };
        let first = forecast(None);
        let exists = input.exist(planner.context);
        let rehearsed = planner.rehearsed((&first, exists), &ACTS, |watch| {
            self.rehearse(source.as_mut(), watch, planner.context).context(format!("imaging {input}"))
        })?;
        let forecast = planner.after(rehearsed.as_ref(), first, &|course| forecast(Some(course)));
        let mut facts = facts(outlook);
        if let Some(waves) = &waves {
            say_waves(waves, outlook, &mut facts);
        }
        Ok(Told { command: "clean", forecast, facts })
    }

    fn output(&self) -> &std::path::Path {
        &self.out.output
    }
}
