//! The steps of injected errors and of self-calibration.

use super::command::{DIR, Step, alike, fit, plot, relative};
use super::config::Config;
use crate::calibrate::{GainMode, StartFrom};
use crate::cli::sections::{Section, words, words_of};
use crate::deconvolve::CleanOptions;
use std::path::Path;

const SECTION: &str = "Errors and self-calibration";

/// The scene as words of the step that corrupts the data.
fn scene_words(config: &Config, folder: &Path) -> Vec<String> {
    let file = config.scene.options.file.iter().map(|f| format!("--scene={}", relative(&f.display().to_string(), folder)));
    file.chain(words_of(&config.scene.keys, |key| key != "file")).collect()
}

/// The steps that corrupt the data, self-calibrate them, image each set, and compare each image with the scene.
///
/// `image` holds the words of every image, `clean` the deconvolution of the error-free data, `truth` the path of the image of the scene.
pub(super) fn steps(config: &Config, folder: &Path, image: &[String], clean: &Section<CleanOptions>, truth: Option<&str>) -> Vec<Step> {
    let mut set = "vis.uvh5";
    let picture = |name: &str, caption: &str| {
        let step = plot(SECTION, &format!("{name}-image.fits"), &format!("{name}-image.png"), caption).with(alike(truth.is_some(), true));
        step.with([format!("--title={}", caption.trim_end_matches('.'))])
    };
    let compare = |name: &str, shift: Option<String>| {
        let command = format!("compare {DIR}/{name}-image.fits {DIR}/scene.fits --convolve");
        truth.map(|_| Step::new(SECTION, format!("compare {name}"), format!("compare.{name}"), &command).with(shift))
    };
    let mut all = Vec::new();
    if let Some(section) = &config.corrupt {
        let seed = section.options.seed.is_none().then(|| format!("--seed={}", config.seed));
        let step = Step::new(SECTION, "corrupt", "corrupt", "corrupt {dir}/vis.uvh5 -o {dir}/corrupted.uvh5 --gains {dir}/truth.calh5");
        let of_scene = ["pointing-rms", "width-rms", "band-shape", "band-offset-rms", "band-width-rms"];
        let scene = if section.keys.keys().any(|key| of_scene.contains(&key.as_str())) { scene_words(config, folder) } else { Vec::new() };
        let mut keys = section.keys.clone();
        if let Some(toml::Value::String(path)) = keys.get_mut("band-shape").filter(|v| v.as_str().is_some_and(|p| p.ends_with(".csv"))) {
            *path = relative(path, folder);
        }
        all.push(step.with(words(&keys)).with(seed).with(scene));
        set = "corrupted.uvh5";
        let step = Step::new(SECTION, "clean the corrupted data", "clean.corrupted", "clean {dir}/corrupted.uvh5 --startmod=never");
        all.push(step.with(image.to_vec()).with(words(&clean.keys)).to("corrupted"));
        all.push(picture("corrupted", "Image of the data with errors."));
        all.extend(compare("corrupted", None));
    }
    if let Some(section) = &config.selfcal {
        let mut keys = section.keys.clone();
        for (key, value) in deconvolver(&section.keys, &config.clean, clean) {
            keys.entry(key).or_insert(value);
        }
        for file in ["model", "prior", "mask"] {
            if let Some(toml::Value::String(path)) = keys.get_mut(file) {
                *path = relative(path, folder);
            }
        }
        let step = Step::new(SECTION, "self-calibrate", "selfcal", &format!("selfcal {DIR}/{set}"));
        all.push(step.with(image.to_vec()).with(words(&keys)).to("selfcal"));
        all.push(picture("selfcal", "Image after self-calibration."));
        all.extend(compare("selfcal", Some("--shift".into())));
        let fitted = ("selfcal.uvh5", "selfcal-model.fits");
        all.push(fit(SECTION, fitted, "selfcal-fit.png", "The self-calibrated data and the model."));
        let mut gains = plot(SECTION, "selfcal.calh5", "selfcal-gains.png", "Gain phases that self-calibration found.");
        if config.corrupt.is_some() {
            // A model that is made from the data does not fix the position of the sky, and with amplitudes it does not fix the flux.
            let of = &section.options;
            let free = of.rounds.model.is_none() && of.rounds.start != StartFrom::Point;
            let gradient = free.then(|| "--gradient".to_owned());
            let amplitudes = of.solve.mode == GainMode::AmpPhase;
            let scale = amplitudes.then(|| "--flux-scale".to_owned());
            let step = Step::new(SECTION, "compare gains", "compare.gains", "compare {dir}/selfcal.calh5 {dir}/truth.calh5");
            all.push(step.with(gradient.clone()).with(scale.clone()));
            let against = |step: Step| step.with([format!("--truth={DIR}/truth.calh5")]).with(gradient.clone()).with(scale.clone());
            gains =
                against(plot(SECTION, "selfcal.calh5", "selfcal-gains.png", "Gain phases that self-calibration found, and the true ones."));
            if amplitudes {
                let step = plot(SECTION, "selfcal.calh5", "selfcal-amplitudes.png", "Gain amplitudes that were found, and the true ones.");
                all.push(against(step).with(["--what=amplitude".into()]));
            }
        }
        all.push(gains);
    } else if config.corrupt.is_some() {
        all.push(plot(SECTION, "truth.calh5", "true-gains.png", "Gain phases that were put in."));
    }
    all
}

/// Keys of the first `[[clean]]`, or of the first with the same algorithm. They are used where the section does not give its own.
fn deconvolver(own: &toml::Table, all: &[Section<CleanOptions>], first: &Section<CleanOptions>) -> toml::Table {
    let named = own.get("deconvolver").or_else(|| own.get("algorithm")).and_then(toml::Value::as_str);
    let like = match named {
        None => Some(first),
        Some(name) => all.iter().find(|c| c.options.algorithm.name() == name),
    };
    let mut keys = like.map(|c| c.keys.clone()).unwrap_or_default();
    // Without a name of its own, self-calibration chooses its deconvolver.
    keys.remove("algorithm");
    keys.remove("deconvolver");
    keys
}
