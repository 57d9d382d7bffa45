//! `run --dry-run`: the sum of what the commands of a run would take.
//!
//! Each command is asked as if it had been typed with `--dry-run`. The set does not exist yet: `simulate` promises its header and its baselines, and the commands
//! after it look at those. Layouts are made and described, which takes little time. Pictures and comparisons are counted from the sizes of what they show.

use super::command::{DIR, Step};
use super::{RunArgs, check, commands};
use crate::cli::ahead::{Ahead, SetAhead};
use crate::cli::console::{Console, Loudness};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Sampling, Scratch, Told, measured};
use crate::cost::{self, Forecast, InputFormat, Shown, Stage};
use crate::memory::MemoryBudget;
use crate::simulate::{Method, SkyModel};
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyGrid, SpectralWindow, VisibilitySource, rows_of_block};
use ndarray::Array4;
use serde_json::{Map, Value, json};
use std::ffi::OsString;
use std::path::Path;

/// The sets of a run that have the baselines of the simulated one.
const SIMULATED: &str = "vis.uvh5";
const COPIES: [&str; 2] = ["corrupted.uvh5", "selfcal.uvh5"];

/// Time of pictures of layouts and gains, of all visibilities twice, and of data beside a model, relative to that of an image without its pixels.
const SMALL: f64 = 0.3;
const OF_SET: f64 = 2.0;
const OF_FIT: f64 = 0.5;
/// Accuracy of the visibilities of a model in a picture.
const EPSILON: f64 = 1e-6;
/// How often the scene is smoothed for its picture, where a comparison smooths it once.
const SMOOTHED: f64 = 2.0;

/// What is known of a run while its commands are asked.
#[derive(Default)]
struct Known {
    parts: Vec<(&'static str, Forecast)>,
    /// Pixels of the images, and of the scene.
    pixels: f64,
    scene_pixels: f64,
    visibilities: f64,
    /// The grid of the images, and the phase centre of the set.
    grid: Option<SkyGrid>,
    center: Option<PhaseCenter>,
    facts: Map<String, Value>,
    /// Commands without a forecast, and why.
    left_out: Vec<String>,
}

impl Plan for RunArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("makes a run. Its commands can be asked one by one: run --check prints them")?;
        planner.no_visibilities("a run simulates its own")?;
        ensure!(!self.of.schema, Failure::usage("--schema makes no run: leave out --dry-run"));
        let (path, text) = self.of.read()?;
        let (_, steps) = check(&text, path)?;
        commands(&steps, planner.context.subcommands.check)?;
        let scratch = Scratch::new()?;
        let folder = scratch.path().display().to_string();
        let context = Context {
            command_line: planner.context.command_line.clone(),
            console: Console::new(Loudness::Quiet),
            subcommands: planner.context.subcommands,
            ahead: Ahead::default(),
        };
        let inner = planner.within(&context);
        let shown = self.output().display().to_string();
        let mut known = Known::default();
        for step in &steps {
            known.ask(step, &folder, &inner).map_err(|e| e.renamed(&folder, &shown)).context(step.shown(&shown))?;
        }
        let mut forecast = cost::chain(known.parts);
        forecast.assumptions.splice(0..0, known.left_out.iter().map(|why| why.replace(&folder, &shown)));
        known.facts.insert("commands".into(), steps.len().into());
        Ok(Told { command: "run", forecast, facts: known.facts })
    }

    fn output(&self) -> &Path {
        self.of.folder().unwrap_or(Path::new("."))
    }
}

impl Known {
    /// What a command would take.
    fn ask(&mut self, step: &Step, folder: &str, planner: &Planner<'_>) -> Result<()> {
        let words: Vec<&str> = step.words.iter().map(String::as_str).collect();
        match words.first().copied().unwrap_or_default() {
            "plot" => {
                if words.iter().any(|w| w.starts_with("--model=")) {
                    self.parts.push(("pictures", self.predicted(&step.argv(folder), planner)?));
                }
                self.parts.push(("pictures", cost::shown("pictures", &self.picture(&words))));
            }
            "compare" => self.parts.push(("comparisons", cost::shown("comparisons", &self.comparison(&words)))),
            "mask" => {
                let work = Shown { pictures: 1.0, pixels: self.pixels.max(self.scene_pixels), ..Shown::default() };
                self.parts.push(("mask", cost::shown("mask", &work)));
            }
            "layout" => {
                let done = measured(|| (planner.context.subcommands.run)(&step.argv(folder), planner.context))?;
                let stages = vec![Stage { timed_s: done.seconds, ..Stage::new("layout", 0.0) }];
                self.parts.push(("layout", Forecast { stages, ..Forecast::default() }));
            }
            command => match (planner.words)(&step.argv(folder), planner) {
                Ok(told) => self.hear(told, folder, planner),
                Err(why) if why.is_unforeseen() => {
                    let why = why.to_string();
                    let why = why.strip_prefix("--dry-run: ").unwrap_or(&why);
                    self.left_out.push(format!("{command} ({}) is not counted, and takes its own time: {why}", step.title));
                }
                Err(why) => return Err(why),
            },
        }
        if words.first() == Some(&"simulate") {
            // Corruption and self-calibration change the visibilities of a set, and not its baselines.
            let name = |file: &str| Path::new(folder).join(file);
            let set = planner.context.ahead.get(&name(SIMULATED));
            let set: SetAhead = set.ok_or_else(|| Failure::message("the simulation promises no set"))?;
            self.center = set.header.phase_centers.first().cloned();
            self.visibilities = (set.n_rows() * set.header.spectrum.n_chan() * set.header.polarizations.len()) as f64;
            COPIES.iter().for_each(|copy| planner.context.ahead.promise(&name(copy), set.clone()));
        }
        Ok(())
    }

    /// Take up the forecast of a command, and the sizes that it tells.
    fn hear(&mut self, told: Told, folder: &str, planner: &Planner<'_>) {
        let size = told.facts.get("size").and_then(Value::as_array);
        let pixels: Option<f64> = size.map(|s| s.iter().filter_map(Value::as_f64).product());
        match (told.command, pixels) {
            ("scene render" | "simulate", Some(pixels)) => self.scene_pixels = pixels,
            (_, Some(pixels)) => {
                self.pixels = pixels;
                let sides: Vec<usize> = size.iter().flat_map(|s| s.iter()).filter_map(|n| Some(n.as_u64()? as usize)).collect();
                let (cell, set) = (told.facts.get("cell_rad").and_then(Value::as_f64), self.center.as_ref());
                if let ([n_l, n_m], Some(cell), Some(center)) = (&sides[..], cell, set) {
                    self.grid = SkyGrid::new(*n_l, *n_m, cell, SkyGrid::frame_of(center)).ok();
                }
                self.facts.insert("size".into(), told.facts["size"].clone());
            }
            (_, None) => {}
        }
        if told.command == "simulate" {
            let all = ["rows", "channels", "products"].into_iter().filter_map(|name| Some((name, told.facts.get(name)?)));
            self.facts.extend(all.map(|(name, value)| (name.to_owned(), value.clone())));
            if let Some(set) = planner.context.ahead.get(&Path::new(folder).join(SIMULATED)) {
                self.facts.insert("visibilities".into(), json!(set.n_rows() * set.header.spectrum.n_chan()));
            }
        }
        self.parts.push((told.command, told.forecast));
    }

    /// The work of the visibilities of a model, which a picture shows beside the data: those of an image of the size of all others.
    fn predicted(&self, argv: &[OsString], planner: &Planner<'_>) -> Result<Forecast> {
        let set = argv.iter().find_map(|word| planner.context.ahead.get(Path::new(word)));
        let (Some(mut set), Some(grid)) = (set, &self.grid) else { return Ok(Forecast::default()) };
        let data = Array4::zeros((1, 1, grid.n_m, grid.n_l));
        let (header, n_rows) = (set.header.clone(), set.n_rows());
        let band = SpectralWindow::new(vec![header.spectrum.mean_hz()], vec![header.spectrum.extent_hz()])?;
        let image = Image::new(grid.clone(), band, vec![Polarization::I], data, BrightnessUnit::JyPerPixel)?;
        let block_rows = rows_of_block(&header, MemoryBudget::default().block());
        let how = Sampling {
            rows: n_rows as f64,
            channels: header.spectrum.freq_hz().to_vec(),
            subchannels: 1,
            products: header.polarizations.len(),
            block_rows,
            method: Method::Degrid,
            epsilon: EPSILON,
            no_w: false,
        };
        let coverage = set.read_coverage(0..block_rows.min(n_rows))?;
        let (work, _) = how.work(&SkyModel::of_image(image), coverage.uvw_m)?;
        let mut forecast = cost::predict(&work, InputFormat::Uvh5);
        forecast.output_bytes = 0.0;
        Ok(forecast)
    }

    /// The pixels of a file of a run.
    fn pixels_of(&self, file: &str) -> f64 {
        if file.ends_with("scene.fits") { self.scene_pixels } else { self.pixels }
    }

    /// The work of a picture.
    fn picture(&self, words: &[&str]) -> Shown {
        let file = words.get(1).copied().unwrap_or_default();
        let has = |option: &str| words.iter().any(|w| w.starts_with(option));
        if file.ends_with(".uvh5") {
            let pictures = if has("--model=") { OF_FIT } else { OF_SET };
            return Shown { pictures, values: self.visibilities, ..Shown::default() };
        }
        if !(file.starts_with(DIR) && file.ends_with(".fits")) {
            return Shown { pictures: SMALL, ..Shown::default() };
        }
        let pixels = self.pixels_of(file);
        Shown { pictures: 1.0, pixels, smoothed: if has("--beam-of=") { SMOOTHED * pixels } else { 0.0 }, ..Shown::default() }
    }

    /// The work of a comparison.
    fn comparison(&self, words: &[&str]) -> Shown {
        if words.get(1).is_some_and(|file| file.ends_with(".calh5")) {
            return Shown { pictures: SMALL, ..Shown::default() };
        }
        let smoothed = if words.contains(&"--convolve") { self.pixels } else { 0.0 };
        Shown { pixels: self.pixels, smoothed, ..Shown::default() }
    }
}
