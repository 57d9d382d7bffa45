//! From the sections of a configuration to the command lines of its steps.

use super::command::{DIR, Step, plot, relative, strings};
use super::config::Config;
use crate::cli::failure::{Failure, Result};
use crate::cli::sections::{Section, words};
use std::path::Path;

/// All steps of a configuration whose file is in `folder`.
///
/// # Errors
/// The scene has no file.
pub(super) fn steps(config: &Config, folder: &Path) -> Result<Vec<Step>> {
    let mut all = Vec::new();
    let layout = relative(&config.layout.name, folder);
    let Some(file) = &config.scene.options.file else {
        return Err(Failure::message("scene: a run needs a file; points are for studies"));
    };
    let scene_file = relative(&file.display().to_string(), folder);
    let simulate = &config.simulate.keys;
    let seed = format!("--seed={}", config.seed);

    let mut show = strings(&["layout", "show", &layout]);
    show.extend(words(simulate).into_iter().filter(|w| w.starts_with("--freq=")));
    all.push(Step::new("Array", "layout", "layout", show));
    let mut picture = Step::new("Array", "picture layout.png", "", strings(&["plot", &layout, "-o", "{dir}/layout.png"]));
    picture.picture = Some(("layout.png".into(), "Antenna positions.".into()));
    all.push(picture);

    let mut scene = words(&config.scene.keys);
    scene.retain(|w| !w.starts_with("--file="));
    scene.insert(0, format!("--scene={scene_file}"));
    let mut sim = vec!["simulate".to_owned(), format!("--layout={layout}")];
    sim.extend(scene);
    sim.extend(words(simulate));
    sim.extend([seed, "-o".into(), format!("{DIR}/vis.uvh5")]);
    all.push(Step::new("Visibilities", "simulate", "simulate", sim));
    all.push(plot("Visibilities", "vis.uvh5", "uv.png", &["--what=uv"], "u-v coverage; each channel adds its own ring."));
    all.push(plot(
        "Visibilities",
        "vis.uvh5",
        "visibilities.png",
        &["--what=visibilities"],
        "Amplitude and phase against baseline length.",
    ));

    let image = words(&config.image.keys);
    all.extend(mask(config, &layout));
    let with_image = |mut w: Vec<String>| {
        w.extend(image.iter().cloned());
        w
    };
    let beam = with_image(strings(&["beam", "{dir}/vis.uvh5", "-o", "{dir}/psf.fits"]));
    all.push(Step::new("Dirty beam and dirty image", "beam", "beam", beam));
    all.push(plot("Dirty beam and dirty image", "psf.fits", "psf.png", &[], "Dirty beam."));
    let dirty = with_image(strings(&["dirty", "{dir}/vis.uvh5", "-o", "{dir}/dirty.fits"]));
    all.push(Step::new("Dirty beam and dirty image", "dirty", "dirty", dirty));
    all.push(plot("Dirty beam and dirty image", "dirty.fits", "dirty.png", &[], "Dirty image."));

    let truth = all_truth(config, &scene_file, &mut all);
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
        let mut w = with_image(vec!["clean".to_owned(), format!("{DIR}/vis.uvh5")]);
        w.extend(words(&clean.keys));
        w.extend(["-o".into(), format!("{DIR}/{prefix}")]);
        all.push(Step::new("Deconvolution", format!("clean by {name}"), format!("clean.{name}"), w));
        let caption = format!("Restored image, {name}.");
        all.push(plot("Deconvolution", &format!("{prefix}-image.fits"), &format!("{prefix}-image.png"), &[], caption));
        let caption = format!("Residual, {name}.");
        all.push(plot("Deconvolution", &format!("{prefix}-residual.fits"), &format!("{prefix}-residual.png"), &["--symmetric"], caption));
        if let Some(truth) = &truth {
            let compare = vec!["compare".to_owned(), format!("{DIR}/{prefix}-image.fits"), truth.clone(), "--convolve".into()];
            all.push(Step::new("Comparison with the truth", format!("compare {name}"), format!("compare.{name}"), compare));
        }
    }
    all.extend(mem(config, folder, &image, truth.as_deref()));
    if let Some(first) = cleans.first().filter(|_| calibrated) {
        all.extend(super::calibration::steps(config, folder, &image, first, truth.as_deref()));
    }
    Ok(all)
}

/// The image of maximum entropy. It needs no restoring beam, so it is compared with the scene without convolution.
fn mem(config: &Config, folder: &Path, image: &[String], truth: Option<&str>) -> Vec<Step> {
    const SECTION: &str = "Maximum entropy";
    let Some(section) = &config.mem else { return Vec::new() };
    let mut w = strings(&["mem", "{dir}/vis.uvh5"]);
    w.extend(image.iter().cloned());
    w.extend(words(&section.keys).into_iter().map(|word| match word.split_once('=') {
        Some((key @ ("--prior" | "--mask"), file)) => format!("{key}={}", relative(file, folder)),
        _ => word,
    }));
    w.extend(strings(&["-o", "{dir}/mem"]));
    let mut all = vec![
        Step::new(SECTION, "mem", "mem", w),
        plot(SECTION, "mem-model.fits", "mem-model.png", &[], "Image of maximum entropy, unconvolved."),
        plot(SECTION, "mem-residual.fits", "mem-residual.png", &["--symmetric"], "Residual of the dirty image."),
    ];
    if let Some(truth) = truth {
        let w = strings(&["compare", "{dir}/mem-model.fits", truth]);
        all.push(Step::new("Comparison with the truth", "compare mem", "compare.mem", w));
    }
    all
}

/// The mask of the array and its channels on the FFT grid.
fn mask(config: &Config, layout: &str) -> Option<Step> {
    let mut w = vec!["mask".to_owned(), layout.to_owned()];
    let (own, image) = (config.mask.as_ref()?, &config.image.options);
    w.extend(own.size.or(image.size).map(|size| format!("--size={size}")));
    w.extend(own.cell.or(image.cell).map(|cell| format!("--cell={cell}")));
    // The band and the track are those of the visibilities.
    let mut keys = config.simulate.keys.clone();
    let shared = ["freq", "bandwidth", "channels", "phase-center", "start", "duration", "hour-angle", "integration", "elevation-limit"];
    keys.retain(|key, _| shared.contains(&key));
    w.extend(words(&keys));
    w.extend(["-o".into(), format!("{DIR}/mask.fits")]);
    let mut step = Step::new("Visibilities", "mask", "mask", w);
    step.picture = Some(("mask.png".into(), "Cells of the FFT grid that the baselines and channels fill.".into()));
    Some(step)
}

/// Adds the step that makes an image of the scene, and returns the path of that image. A source list has none.
fn all_truth(config: &Config, scene_file: &str, all: &mut Vec<Step>) -> Option<String> {
    let lower = scene_file.to_ascii_lowercase();
    if lower.ends_with(".csv") {
        return None;
    }
    let mut w = vec!["scene".to_owned(), "render".into(), scene_file.to_owned()];
    w.extend(words(&config.scene.keys).into_iter().filter(|x| !x.starts_with("--file=") && x != "--scene-channels"));
    let sim = words(&config.simulate.keys);
    w.extend(sim.into_iter().filter(|x| ["--freq=", "--bandwidth=", "--phase-center="].iter().any(|p| x.starts_with(p))));
    w.extend(["-o".into(), format!("{DIR}/scene.fits")]);
    let mut picture = plot("Scene", "scene.fits", "scene.png", &[], "The scene.");
    picture.section = "Scene";
    all.insert(0, picture);
    all.insert(0, Step::new("Scene", "scene", "scene", w));
    Some(format!("{DIR}/scene.fits"))
}
