//! The steps of injected errors and of self-calibration.

use super::command::{DIR, Step, plot, relative, strings};
use super::config::Config;
use crate::calibrate::{GainMode, StartFrom};
use crate::cli::sections::{Section, words};
use crate::deconvolve::CleanOptions;
use std::path::Path;

const SECTION: &str = "Errors and self-calibration";

/// The steps that corrupt the data, self-calibrate them, image each set, and compare each image with the scene.
///
/// `image` holds the words of every image, `clean` the deconvolution of the error-free data, `truth` the path of the image of the scene.
pub(super) fn steps(config: &Config, folder: &Path, image: &[String], clean: &Section<CleanOptions>, truth: Option<&str>) -> Vec<Step> {
    let mut all = Vec::new();
    let mut set = "vis.uvh5";
    // All three pictures have the colours of the first.
    let picture = |name: &str, caption: &str| {
        let mut step = plot(SECTION, &format!("{name}-image.fits"), &format!("{name}-like.png"), &[], caption);
        step.words.extend([format!("--like={DIR}/clean-image.fits"), format!("--title={}", caption.trim_end_matches('.'))]);
        step
    };
    let compare = |name: &str, shift: bool| {
        let truth = truth?;
        let mut w = vec!["compare".to_owned(), format!("{DIR}/{name}-image.fits"), truth.to_owned(), "--convolve".into()];
        w.extend(shift.then(|| "--shift".to_owned()));
        Some(Step::new(SECTION, format!("compare {name}"), format!("compare.{name}"), w))
    };
    all.push(picture("clean", "Image of the data without errors."));
    if let Some(section) = &config.corrupt {
        let mut w = strings(&["corrupt", "{dir}/vis.uvh5", "-o", "{dir}/corrupted.uvh5", "--gains", "{dir}/truth.calh5"]);
        w.extend(words(&section.keys));
        w.extend(section.options.seed.is_none().then(|| format!("--seed={}", config.seed)));
        all.push(Step::new(SECTION, "corrupt", "corrupt", w));
        set = "corrupted.uvh5";
        let mut w = strings(&["clean", "{dir}/corrupted.uvh5", "--startmod=never"]);
        w.extend(image.iter().cloned().chain(words(&clean.keys)));
        w.extend(["-o".into(), format!("{DIR}/corrupted")]);
        all.push(Step::new(SECTION, "clean the corrupted data", "clean.corrupted", w));
        all.push(picture("corrupted", "Image of the corrupted data."));
        all.extend(compare("corrupted", false));
    }
    if let Some(section) = &config.selfcal {
        let mut w = vec!["selfcal".to_owned(), format!("{DIR}/{set}")];
        let mut keys = section.keys.clone();
        for (key, value) in deconvolver(&section.keys, &config.clean, clean) {
            keys.entry(key).or_insert(value);
        }
        for file in ["model", "prior", "mask"] {
            if let Some(toml::Value::String(path)) = keys.get_mut(file) {
                *path = relative(path, folder);
            }
        }
        w.extend(image.iter().cloned().chain(words(&keys)));
        w.extend(["-o".into(), format!("{DIR}/selfcal")]);
        all.push(Step::new(SECTION, "self-calibrate", "selfcal", w));
        all.push(picture("selfcal", "Image after self-calibration."));
        all.extend(compare("selfcal", true));
        if config.corrupt.is_some() {
            // A model that is made from the data does not fix the position of the sky, and with amplitudes it does not fix the flux.
            let mut w = strings(&["compare", "{dir}/selfcal.calh5", "{dir}/truth.calh5"]);
            let of = &section.options;
            let free = of.rounds.model.is_none() && of.rounds.start != StartFrom::Point;
            w.extend(free.then(|| "--gradient".to_owned()));
            w.extend((of.solve.mode == GainMode::AmpPhase).then(|| "--flux-scale".to_owned()));
            all.push(Step::new(SECTION, "compare gains", "compare.gains", w));
        }
        all.push(plot(SECTION, "selfcal.calh5", "selfcal-gains.png", &[], "Phases of the gains that self-calibration found."));
    }
    if config.corrupt.is_some() {
        all.push(plot(SECTION, "truth.calh5", "true-gains.png", &[], "Phases of the gains that were put in."));
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
