//! Titles of pictures, from what the files say about themselves: the command that made an image, its scene, its array and its frequency.

use cittert_arrays::{Image, SpectralWindow, VisibilityHeader};
use std::path::Path;

/// Letters in a line of a history in FITS.
const FITS_LINE: usize = 72;

/// The last command of this program in a history. FITS cuts long lines into pieces and drops the spaces at their ends, so all lines are
/// filled up and read as one.
fn last_command(history: &[String]) -> Vec<String> {
    let all: String = history.iter().map(|line| format!("{line:<FITS_LINE$}")).collect();
    let words = |rest: &str| rest.split(' ').filter(|w| !w.is_empty()).map(str::to_owned).collect();
    all.rsplit_once(": cittert ").map(|(_, rest)| words(rest)).unwrap_or_default()
}

/// The value of an option in the words of a command.
fn option<'a>(words: &'a [String], name: &str) -> Option<&'a str> {
    let long = format!("--{name}");
    let at = words.iter().position(|w| *w == long || w.strip_prefix(&long).is_some_and(|rest| rest.starts_with('=')))?;
    words[at].split_once('=').map(|(_, value)| value).or_else(|| words.get(at + 1).map(String::as_str))
}

/// What an image is, such as "Dirty image", by the command that made it and the ending of its name.
fn kind(words: &[String], path: &Path) -> Option<String> {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = stem.rsplit_once('-').map(|(_, end)| end.to_owned()).unwrap_or_default();
    let clean = match option(words, "algorithm").or_else(|| option(words, "deconvolver")) {
        Some("clark") => "Clark CLEAN",
        Some("multiscale") => "Multiscale CLEAN",
        Some("mem") => "Maximum entropy",
        _ => "H\u{f6}gbom CLEAN",
    };
    let command = words.first()?.as_str();
    Some(match (command, ending.as_str()) {
        ("scene", _) => "Scene".into(),
        ("dirty", _) | ("clean" | "mem" | "selfcal", "dirty") => "Dirty image".into(),
        ("beam", _) | ("clean" | "mem" | "selfcal", "psf") => "Dirty beam".into(),
        ("clean", "model") => format!("Model of {clean}"),
        ("clean", "residual") => format!("Residual of {clean}"),
        ("clean", _) => format!("{clean} image"),
        ("mem", "residual") => "Residual of maximum entropy".into(),
        ("mem", "uncertainty") => "Uncertainty of the maximum-entropy image".into(),
        ("mem", "image") => "Maximum-entropy image at the resolution of the beam,".into(),
        ("mem", _) => "Maximum-entropy image".into(),
        ("selfcal", "model") => "Model after self-calibration".into(),
        ("selfcal", "residual") => "Residual after self-calibration".into(),
        ("selfcal", _) => match round(&stem) {
            Some(0) => "Image before self-calibration".into(),
            Some(round) => format!("Image after round {round} of self-calibration"),
            None => "Image after self-calibration".into(),
        },
        _ => return None,
    })
}

/// The round of self-calibration in the name of the image of a round.
fn round(stem: &str) -> Option<usize> {
    stem.strip_suffix("-image")?.rsplit_once("-round")?.1.parse().ok()
}

/// How the visibilities were weighted, in the words of this field.
fn weighting(words: &[String]) -> Option<String> {
    if !["dirty", "beam", "clean", "selfcal"].contains(&words.first()?.as_str()) {
        return None;
    }
    Some(match option(words, "weighting").unwrap_or("uniform") {
        "briggs" => format!("Briggs {}", option(words, "robust").unwrap_or("0")),
        other => format!("{other} weights"),
    })
}

/// A frequency with three digits after those that the unit needs.
pub(super) fn frequency(hz: f64) -> String {
    let (unit, name) = [(1e12, "THz"), (1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz")].into_iter().find(|u| hz >= u.0).unwrap_or((1.0, "Hz"));
    let value = hz / unit;
    let digits = if value >= 100.0 { 1 } else { 2 };
    format!("{value:.digits$} {name}")
}

fn band(spectrum: &SpectralWindow) -> String {
    frequency(spectrum.mean_hz())
}

/// The title of an image and, as a second line, how it was observed.
pub(super) fn of_image(image: &Image, path: &Path) -> String {
    let words = last_command(&image.history);
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let object = image.object.trim();
    let first = match (kind(&words, path), object) {
        (Some(kind), "") => kind.trim_end_matches(',').to_owned(),
        (Some(kind), object) if kind == "Scene" => format!("Scene {object}"),
        (Some(kind), object) if kind == "Dirty beam" || object == image.telescope => kind.trim_end_matches(',').to_owned(),
        (Some(kind), object) => format!("{} of {object}", kind.trim_end_matches(',')),
        (None, "") => stem,
        (None, object) => format!("{object} ({stem})"),
    };
    let mut second: Vec<String> = Vec::new();
    if !image.telescope.trim().is_empty() {
        second.push(image.telescope.trim().to_owned());
    }
    second.push(band(&image.spectrum));
    second.extend(weighting(&words));
    format!("{first}\n{}", second.join(", "))
}

/// The title of a picture of visibilities, and their array and band as a second line.
pub(super) fn of_visibilities(what: &str, header: &VisibilityHeader) -> String {
    let target = header.phase_centers.first().map(|c| c.name.trim().to_owned()).unwrap_or_default();
    let first = if target.is_empty() { what.to_owned() } else { format!("{what} of {target}") };
    format!("{first}\n{}, {}", header.layout.name, channels(header))
}

/// The title of a picture of the u-v coverage: it belongs to the array, whatever was observed.
pub(super) fn of_coverage(header: &VisibilityHeader) -> String {
    format!("u-v coverage of {}\n{}", header.layout.name, channels(header))
}

fn channels(header: &VisibilityHeader) -> String {
    let (n, width) = (header.spectrum.n_chan(), frequency(header.spectrum.extent_hz()));
    let channels = if n > 1 { format!("{n} channels over {width}") } else { format!("one channel of {width}") };
    format!("{}, {channels}", band(&header.spectrum))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        last_command(&["x".into(), format!("cittert 0.1.0: cittert {text}")])
    }

    #[test]
    fn the_command_and_the_name_say_what_an_image_is() {
        let told = |command: &str, file: &str| kind(&words(command), Path::new(file)).unwrap();
        assert_eq!(told("dirty vis.uvh5 -o d.fits", "d.fits"), "Dirty image");
        assert_eq!(told("clean vis.uvh5 --algorithm=clark -o c", "c-residual.fits"), "Residual of Clark CLEAN");
        assert_eq!(told("clean vis.uvh5 -o c", "c-psf.fits"), "Dirty beam");
        assert_eq!(told("mem vis.uvh5 -o m", "m-model.fits"), "Maximum-entropy image");
        assert_eq!(told("selfcal vis.uvh5 -o s", "s-image.fits"), "Image after self-calibration");
        assert_eq!(told("selfcal vis.uvh5 -o s", "s-round0-image.fits"), "Image before self-calibration");
        assert_eq!(
            told("selfcal vis.uvh5 -o a-round-table", "a-round-table-round12-image.fits"),
            "Image after round 12 of self-calibration"
        );
        assert!(kind(&words("frobnicate"), Path::new("x.fits")).is_none());
    }

    #[test]
    fn weights_and_frequencies_are_told_as_people_say_them() {
        assert_eq!(weighting(&words("dirty v --weighting briggs --robust 0 -o d")).unwrap(), "Briggs 0");
        assert_eq!(weighting(&words("clean v --weighting=natural -o d")).unwrap(), "natural weights");
        assert!(weighting(&words("scene render x")).is_none());
        assert_eq!(frequency(8.4e9), "8.40 GHz");
        assert_eq!(frequency(230.1e9), "230.1 GHz");
    }

    #[test]
    fn a_command_that_fits_cut_into_pieces_is_read_as_one() {
        // The cut is in the middle of a word, after a space, which is lost, or before a space.
        for name in ["name.uvh5", "v.uvh5", "vv.uvh5"] {
            let command = format!("cittert 0.1.0: cittert clean {name} --size 256 --cell 1mrad --weighting briggs --robust 0.5 -o c");
            let (first, rest) = command.split_at(72);
            let words = last_command(&["cittert 0.1.0: cittert simulate -o v".into(), first.trim_end().into(), rest.into()]);
            assert_eq!((option(&words, "weighting"), option(&words, "robust")), (Some("briggs"), Some("0.5")), "{words:?}");
        }
    }
}
