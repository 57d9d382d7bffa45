//! `layout compare`: layouts side by side, by their figures of merit and by their images of the same scene.
//!
//! As in `run`, the images are made by subcommands that run as if they had been typed, and the page shows their words.

mod args;
mod common;
mod design;
mod page;
mod pictures;
mod ranking;
mod results;
mod score;
mod steps;
mod vary;

use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Result};
use crate::cli::options::OutputArgs;
use crate::cli::run::command::{Done, Step};
use crate::cli::run::perform::perform;
use crate::cli::run::place::{refuse_taken, renamed};
pub use args::CompareArgs;
use cittert_arrays::{BuiltinLayout, SkyGrid};
use cittert_formats::atomic::{AtomicDir, Replaces};
use design::Design;
use page::Told;
use score::Score;
use std::path::{Path, PathBuf};
use steps::Pixels;
use vary::{Point, Variant, What};

/// The name in the list of files that a comparison leaves in its folder.
const WRITER: &str = "cittert layout compare";
/// Files of a comparison beside those of its steps and its pictures.
const OWN: [&str; 3] = ["comparison.json", "report.html", steps::POINT];

/// The quality of the images of variants: what varied, and for each layout its points.
type Varied = (What, Vec<Vec<Point>>);

/// Compare the layouts.
///
/// # Errors
/// Fewer than two layouts, a layout or an option that is wrong, or an error of the file system. The output then does not exist.
pub(super) fn run(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    args.check()?;
    let target = &args.output;
    let files = args.layouts.iter().filter(|name| BuiltinLayout::find(name).is_none()).map(PathBuf::from);
    let out = OutputArgs { output: target.clone(), overwrite: args.overwrite };
    out.claim([target], files.chain(args.observed.scene.clone()))?;
    let designs = design::load(args)?;
    let folder = AtomicDir::create(target, args.overwrite, Replaces::FilesOf(WRITER))?;
    let comparison = Comparison { args, context, designs, here: folder.path(), shown: target };
    refuse_taken(target, WRITER, &comparison.outputs(), &comparison.names())?;
    let outcome = comparison.make()?;
    folder.commit()?;
    Ok(outcome.wrote(target.join("report.html")))
}

/// A comparison that grows in a hidden folder.
struct Comparison<'a> {
    args: &'a CompareArgs,
    context: &'a Context,
    designs: Vec<Design>,
    here: &'a Path,
    shown: &'a Path,
}

impl Comparison<'_> {
    /// All steps, as far as the names of their outputs are concerned.
    fn outputs(&self) -> Vec<Step> {
        let pixels = steps::beam_pixels(self.args, &self.designs);
        let of = |d: &Design| [steps::beam(&d.name, self.args, pixels), steps::images(&d.name, self.args, pixels)].concat();
        steps::truth(self.args).into_iter().chain(self.designs.iter().flat_map(of)).collect()
    }

    /// Files that no step writes.
    fn names(&self) -> Vec<String> {
        let errors = |d: &Design| steps::IMAGES.iter().map(|made| format!("{}/{}", d.name, steps::error_file(made))).collect::<Vec<_>>();
        let layouts = self.designs.iter().map(|d| format!("{}/layout.toml", d.name));
        let truths = self.designs.iter().map(|d| steps::scene_file(&d.name, self.args));
        let varied = vary::ALL.into_iter().map(vary::file).chain(self.designs.iter().flat_map(vary::names));
        let own = OWN.map(str::to_owned).into_iter().chain(pictures::names(&self.designs)).chain(layouts).chain(truths).chain(varied);
        own.chain(self.designs.iter().flat_map(errors)).collect()
    }

    fn perform(&self, step: Step) -> Result<Done> {
        self.context.console.note(&step.title);
        perform(step, &self.here.display().to_string(), &self.shown.display().to_string(), self.context)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
        std::fs::write(self.here.join(name), bytes).context(format!("writing {}", self.shown.join(name).display()))
    }

    fn make(&self) -> Result<Outcome> {
        let (args, designs) = (self.args, &self.designs);
        self.write(steps::POINT, steps::POINT_TEXT)?;
        let mut shared: Vec<Done> = steps::truth(args).map(|step| self.perform(step)).transpose()?.into_iter().collect();
        let pixels = args.observed.scene.as_ref().map(|_| self.pixels()).transpose()?;
        let beam = steps::beam_pixels(args, designs);
        let mut done: Vec<Vec<Done>> = Vec::new();
        for d in designs {
            let folder = self.here.join(&d.name);
            std::fs::create_dir(&folder).context(format!("making {}", self.shown.join(&d.name).display()))?;
            self.write(&format!("{}/layout.toml", d.name), d.layout.to_toml())?;
            let images = pixels.map(|p| steps::images(&d.name, args, p)).unwrap_or_default();
            done.push(steps::beam(&d.name, args, beam).into_iter().chain(images).map(|s| self.perform(s)).collect::<Result<_>>()?);
        }
        let resolution_rad = if steps::has_truth(args) { Some(self.judge(&mut done)?) } else { None };
        let scores: Vec<_> = done.iter().map(|d| results::scores(d)).collect();
        let mut parts = Vec::new();
        let varied = match pixels.zip(resolution_rad) {
            Some((pixels, resolution)) => self.vary((pixels, resolution), &scores, &mut parts)?,
            None => Vec::new(),
        };
        let ranking = results::rank(designs, &scores);
        let json = results::comparison(args, (designs, &done, &scores), (&ranking, pixels, resolution_rad), &varied, self.context);
        let json = renamed(json, &self.here.display().to_string(), &self.shown.display().to_string());
        self.write("comparison.json", serde_json::to_vec_pretty(&json)?)?;
        let mut rows = pictures::of_layouts(designs, args, self.here)?;
        if args.observed.scene.is_some() {
            rows.extend(pictures::of_images(designs, self.here, resolution_rad.map(|r| common::rule(args, r)))?);
        }
        let curves = varied.iter().map(|(what, points)| vary::section(*what, designs, points, self.here)).collect::<Result<_>>()?;
        let table = page::table(designs, &scores);
        let text = format!("{}\n\n{}", page::text(&table), ranking.reason);
        shared.extend(done.into_iter().flatten().chain(parts));
        let told = Told { args, designs, ranking: &ranking, table, rows, curves, done: &shared, pixels };
        self.write("report.html", page::page(told, self.context))?;
        Ok(Outcome::new(json, text))
    }

    /// Compare all images with the truth, by one rule. Returns their common resolution, rad.
    fn judge(&self, done: &mut [Vec<Done>]) -> Result<f64> {
        let resolution_rad = common::resolution_rad(&self.designs, self.here)?;
        common::write_truths(self.args, &self.designs, self.here)?;
        for (d, done) in self.designs.iter().zip(done) {
            for step in steps::errors(&d.name, self.args, resolution_rad) {
                done.push(self.perform(step)?);
            }
        }
        Ok(resolution_rad)
    }

    /// Image the scene with parts of every layout and of the band.
    fn vary(&self, (pixels, resolution): (Pixels, f64), scores: &[Vec<Score>], all: &mut Vec<Done>) -> Result<Vec<Varied>> {
        let mut found = Vec::new();
        for what in vary::ALL {
            let mut points = Vec::new();
            for (d, own) in self.designs.iter().zip(scores) {
                let of = |v| self.point(d, v, (own, what.title()), (pixels, resolution), all);
                points.push(
                    vary::variants(what, d, self.args)?.into_iter().map(of).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect(),
                );
            }
            if points.iter().any(|p: &Vec<Point>| p.len() > 1) {
                found.push((what, points));
            }
        }
        Ok(found)
    }

    /// The quality of the image of one variant. That of the layout itself is known from its `own` scores.
    fn point(
        &self,
        d: &Design,
        variant: Variant,
        (own, section): (&[Score], &'static str),
        (pixels, resolution): (Pixels, f64),
        all: &mut Vec<Done>,
    ) -> Result<Option<Point>> {
        let x = variant.x;
        let of = |scores: &[Score]| scores.iter().find(|s| s.key == "mem").map(|s| Point { x, score: s.clone() });
        if variant.name.is_none() {
            return Ok(of(own));
        }
        if variant.has_own_layout() {
            self.write(&variant.layout_file(&d.name), variant.layout.to_toml())?;
        }
        let work = self.here.join(&d.name).join(steps::WORK);
        std::fs::create_dir(&work).context(format!("making {}", self.shown.join(&d.name).join(steps::WORK).display()))?;
        let steps = steps::varied(&d.name, self.args, pixels, resolution, (&variant, section));
        let done: Vec<Done> = steps.into_iter().map(|step| self.perform(step)).collect::<Result<_>>()?;
        std::fs::remove_dir_all(&work).context(format!("removing {}", self.shown.join(&d.name).join(steps::WORK).display()))?;
        let found = of(&results::scores(&done));
        all.extend(done);
        Ok(found)
    }

    /// Pixels of the images, which may depend on the scene.
    fn pixels(&self) -> Result<Pixels> {
        let truth: Option<SkyGrid> =
            if steps::has_truth(self.args) { Some(cittert_formats::open_image(&self.here.join(steps::TRUTH))?.grid) } else { None };
        steps::image_pixels(self.args, &self.designs, truth.as_ref())
    }
}
