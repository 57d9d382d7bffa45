//! `layout compare`: layouts side by side, by their figures of merit and by their images of the same scene.
//!
//! As in `run`, the images are made by subcommands that run as if they had been typed, and the page shows their words.

mod args;
mod design;
mod page;
mod pictures;
mod ranking;
mod results;
mod steps;

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
use std::path::{Path, PathBuf};
use steps::Pixels;

/// The name in the list of files that a comparison leaves in its folder.
const WRITER: &str = "cittert layout compare";
/// Files of a comparison beside those of its steps and its pictures.
const OWN: [&str; 3] = ["comparison.json", "report.html", steps::POINT];

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
        let own = OWN.map(str::to_owned).into_iter().chain(pictures::names(&self.designs)).chain(layouts);
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
        let scores: Vec<_> = done.iter().map(|d| results::scores(d)).collect();
        let ranking = results::rank(designs, &scores);
        let json = results::comparison(args, (designs, &done, &scores), (&ranking, pixels), self.context);
        let json = renamed(json, &self.here.display().to_string(), &self.shown.display().to_string());
        self.write("comparison.json", serde_json::to_vec_pretty(&json)?)?;
        let mut rows = pictures::of_layouts(designs, args, self.here)?;
        if args.observed.scene.is_some() {
            rows.extend(pictures::of_images(designs, self.here, steps::has_truth(args))?);
        }
        let table = page::table(designs, &scores);
        let text = format!("{}\n\n{}", page::text(&table), ranking.reason);
        shared.extend(done.into_iter().flatten());
        let told = Told { args, designs, ranking: &ranking, table, rows, done: &shared, pixels };
        self.write("report.html", page::page(told, self.context))?;
        Ok(Outcome::new(json, text))
    }

    /// Pixels of the images, which may depend on the scene.
    fn pixels(&self) -> Result<Pixels> {
        let truth: Option<SkyGrid> =
            if steps::has_truth(self.args) { Some(cittert_formats::open_image(&self.here.join(steps::TRUTH))?.grid) } else { None };
        steps::image_pixels(self.args, &self.designs, truth.as_ref())
    }
}
