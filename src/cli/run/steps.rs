//! From the sections of a configuration to the command lines of its steps.

use super::command::{DIR, Step, alike, fit, plot, relative};
use super::config::Config;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::made::Origin;
use crate::cli::sections::{Section, words, words_of};
use std::path::Path;

/// The file of a generated layout.
const MADE: &str = "layout.toml";

/// All steps of a configuration whose file is in `folder`.
///
/// # Errors
/// The scene has no file, or an option of the images is out of its range.
pub(super) fn steps(config: &Config, folder: &Path) -> Result<Vec<Step>> {
    config.image.options.check().context("image")?;
    let (layout, make) = layout(config.layout.origin()?, folder)?;
    let Some(file) = &config.scene.options.file else {
        return Err(Failure::message("scene: a run needs a file; points are for studies"));
    };
    let scene_file = relative(&file.display().to_string(), folder);
    let (simulate, image) = (&config.simulate.keys, words(&config.image.keys));
    let mut all = Vec::new();
    // A source list has no image.
    let truth = (!scene_file.to_ascii_lowercase().ends_with(".csv")).then(|| format!("{DIR}/scene.fits"));
    if truth.is_some() {
        let scene = words_of(&config.scene.keys, |key| !["file", "scene-channels"].contains(&key));
        let seen = words_of(simulate, |key| ["freq", "bandwidth", "phase-center"].contains(&key));
        let render = Step::new("Scene", "scene", "scene", "scene render").with([scene_file.clone()]);
        all.push(render.with(scene).with(seen).to("scene.fits"));
        all.push(plot("Scene", "scene.fits", "scene.png", "The scene, at the resolution of its pixels."));
    }
    all.extend(make);
    let show = Step::new("Array", "layout", "layout", "layout show").with([layout.clone()]);
    all.push(show.with(words_of(simulate, |key| key == "freq")));
    let picture = Step::new("Array", "picture layout.png", "", "plot").with([layout.clone()]);
    all.push(picture.to("layout.png").showing("layout.png", "Antenna positions."));
    let sim = Step::new("Visibilities", "simulate", "simulate", "simulate").with([format!("--layout={layout}")]);
    let sim = sim.with([format!("--scene={scene_file}")]).with(words_of(&config.scene.keys, |key| key != "file"));
    all.push(sim.with(words(simulate)).with([format!("--seed={}", config.seed)]).to("vis.uvh5"));
    let uv = plot("Visibilities", "vis.uvh5", "uv.png", "u-v coverage; each channel adds its own ring.");
    all.push(uv.with(["--what=uv".into()]));
    all.push(plot("Visibilities", "vis.uvh5", "visibilities.png", "Amplitude and phase of every visibility against baseline length."));
    all.extend(mask(config, layout));
    const DIRTY: &str = "Dirty beam and dirty image";
    all.push(Step::new(DIRTY, "beam", "beam", "beam {dir}/vis.uvh5").to("psf.fits").with(image.clone()));
    all.push(plot(DIRTY, "psf.fits", "psf.png", "Dirty beam in dB, and its largest value and rms against the distance from the peak."));
    all.push(Step::new(DIRTY, "dirty", "dirty", "dirty {dir}/vis.uvh5").to("dirty.fits").with(image.clone()));
    all.push(plot(DIRTY, "dirty.fits", "dirty.png", "Dirty image.").with(alike(truth.is_some(), false)));
    let mut cleans = config.clean.clone();
    let calibrated = config.corrupt.is_some() || config.selfcal.is_some();
    if calibrated && cleans.is_empty() {
        // The effect of errors is judged by the image without errors.
        cleans.push(Section::default());
    }
    for (i, clean) in cleans.iter().enumerate() {
        // The second section with the same algorithm gets the number 2.
        let algorithm = clean.options.algorithm;
        let twin = cleans[..i].iter().filter(|c| c.options.algorithm == algorithm).count();
        let name = if twin == 0 { algorithm.to_string() } else { format!("{algorithm}{}", twin + 1) };
        let prefix = if i == 0 { "clean".to_owned() } else { format!("clean-{name}") };
        let draw =
            |what: &str, caption: String| plot("Deconvolution", &format!("{prefix}-{what}.fits"), &format!("{prefix}-{what}.png"), caption);
        let step = Step::new("Deconvolution", format!("clean by {name}"), format!("clean.{name}"), "clean {dir}/vis.uvh5");
        all.push(step.with(image.clone()).with(words(&clean.keys)).to(&prefix));
        // Without a scene, the first image has nothing to be like.
        let like = alike(truth.is_some(), i > 0);
        all.push(draw("image", format!("Restored image of {} CLEAN.", label(&name))).with(like));
        let residual = format!("Residual of {} CLEAN in units of its noise.", label(&name));
        all.push(draw("residual", residual).with(["--what=residual".into()]));
        if i == 0 {
            let files = ("vis.uvh5", "clean-model.fits");
            all.push(fit("Deconvolution", files, "clean-fit.png", "The data and the model of CLEAN."));
        }
        all.extend(compare(&name, &format!("{prefix}-image.fits"), truth.as_deref()).map(|step| step.with(["--convolve".into()])));
    }
    if let Some(truth) = truth.as_ref().filter(|_| !cleans.is_empty()) {
        let caption = "The scene at the resolution of the image: the best that an image can be.";
        let step = Step::new("Comparison with the truth", "picture scene-convolved.png", "", "plot").with([truth.clone()]);
        let step = step.with([format!("--beam-of={DIR}/clean-image.fits"), "--title=The scene at the resolution of the image".into()]);
        all.push(step.with(alike(true, true)).to("scene-convolved.png").showing("scene-convolved.png", caption));
    }
    all.extend(mem(config, folder, &image, (truth.as_deref(), !cleans.is_empty())));
    if let Some(first) = cleans.first().filter(|_| calibrated) {
        all.extend(super::calibration::steps(config, folder, &image, first, truth.as_deref()));
    }
    Ok(all)
}

/// The layout as a word of the other steps, and the step that makes it where it is generated.
fn layout(origin: Origin<'_>, folder: &Path) -> Result<(String, Option<Step>)> {
    let make = match origin {
        Origin::Named(name) => return Ok((relative(name, folder), None)),
        Origin::Made(make) => make,
    };
    // Wrong options are found before any work is done.
    make.options.layout()?;
    let step = Step::new("Array", "layout make", "", &format!("layout make {}", make.options.kind));
    Ok((format!("{DIR}/{MADE}"), Some(step.with(words_of(&make.keys, |key| key != "kind")).to(MADE))))
}

/// The name of an algorithm in a caption.
fn label(algorithm: &str) -> String {
    if algorithm.starts_with("hogbom") { algorithm.replace("hogbom", "H\u{f6}gbom") } else { algorithm.to_owned() }
}

/// The comparison of an image with the scene, where the scene has an image.
fn compare(name: &str, image: &str, truth: Option<&str>) -> Option<Step> {
    let step = Step::new("Comparison with the truth", format!("compare {name}"), format!("compare.{name}"), "compare");
    Some(step.with([format!("{DIR}/{image}"), truth?.to_owned()]))
}

/// The image of maximum entropy. It needs no restoring beam, so it is compared with the scene without convolution.
fn mem(config: &Config, folder: &Path, image: &[String], (truth, has_clean): (Option<&str>, bool)) -> Vec<Step> {
    const SECTION: &str = "Maximum entropy";
    let Some(section) = &config.mem else { return Vec::new() };
    let own = words(&section.keys).into_iter().map(|word| match word.split_once('=') {
        Some((key @ ("--prior" | "--mask"), file)) => format!("{key}={}", relative(file, folder)),
        _ => word,
    });
    let mut all = vec![
        Step::new(SECTION, "mem", "mem", "mem {dir}/vis.uvh5").with(image.to_vec()).with(own).to("mem"),
        // A source list has no image, and an image of points in Jy/pixel has no colours in common with one in Jy/beam.
        plot(SECTION, "mem-model.fits", "mem-model.png", "Image of maximum entropy, not convolved with a beam.")
            .with(alike(truth.is_some(), truth.is_some() && has_clean)),
        plot(SECTION, "mem-residual.fits", "mem-residual.png", "Residual of maximum entropy in units of its noise.")
            .with(["--what=residual".into()]),
        fit(SECTION, ("vis.uvh5", "mem-model.fits"), "mem-fit.png", "The data and the model of maximum entropy."),
    ];
    all.extend(compare("mem", "mem-model.fits", truth));
    all
}

/// The mask of the array and its channels on the FFT grid.
fn mask(config: &Config, layout: String) -> Option<Step> {
    let (own, image) = (config.mask.as_ref()?, &config.image.options);
    let size = own.size.or(image.size).map(|size| format!("--size={size}"));
    let cell = own.cell.or(image.cell).map(|cell| format!("--cell={cell}"));
    // The band and the track are those of the visibilities.
    let shared = ["freq", "bandwidth", "channels", "phase-center", "start", "duration", "hour-angle", "integration", "elevation-limit"];
    let seen = words_of(&config.simulate.keys, |key| shared.contains(&key));
    let step = Step::new("Visibilities", "mask", "mask", "mask").with([layout]).with(size).with(cell).with(seen).to("mask.fits");
    Some(step.showing("mask.png", "Cells of the FFT grid that the baselines and channels fill."))
}
