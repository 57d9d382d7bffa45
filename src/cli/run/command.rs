//! One command of a run or of a comparison, and its results.

use crate::cli::context::shell_word;
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;

/// Placeholder for the output folder in the words of a step.
pub(in crate::cli) const DIR: &str = "{dir}";

/// One command of the run.
#[derive(Debug, Clone)]
pub(in crate::cli) struct Step {
    /// Heading in the report.
    pub title: String,
    /// Key of its numbers in `metrics.json`, empty for pictures. `a.b` is the entry `b` of the object `a`.
    pub key: String,
    /// Section of the report it belongs to.
    pub section: &'static str,
    /// Words after the program's name.
    pub words: Vec<String>,
    /// Picture that it makes, with its caption.
    pub picture: Option<(String, String)>,
}

impl Step {
    /// A command whose words are separated by single spaces.
    pub(in crate::cli) fn new(section: &'static str, title: impl Into<String>, key: impl Into<String>, command: &str) -> Self {
        let words = command.split(' ').map(str::to_owned).collect();
        Self { title: title.into(), key: key.into(), section, words, picture: None }
    }

    /// The step with more words, which may contain spaces.
    pub(in crate::cli) fn with(mut self, words: impl IntoIterator<Item = String>) -> Self {
        self.words.extend(words);
        self
    }

    /// The step with an output in the folder of the run.
    pub(in crate::cli) fn to(self, output: &str) -> Self {
        self.with(["-o".to_owned(), format!("{DIR}/{output}")])
    }

    /// The step with the picture that it makes.
    pub(in crate::cli) fn showing(mut self, png: &str, caption: impl Into<String>) -> Self {
        self.picture = Some((png.to_owned(), caption.into()));
        self
    }

    fn in_dir(&self, dir: &str) -> Vec<String> {
        self.words.iter().map(|w| w.replace(DIR, dir)).collect()
    }

    /// The command as it would be typed, with the output folder `dir`.
    pub(in crate::cli) fn shown(&self, dir: &str) -> String {
        let words = self.in_dir(dir).into_iter().map(|w| shell_word(&w));
        std::iter::once("cittert".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
    }

    /// Program name and words, with the output folder `dir`.
    pub(in crate::cli) fn argv(&self, dir: &str) -> Vec<OsString> {
        std::iter::once("cittert".into()).chain(self.in_dir(dir).into_iter().map(OsString::from)).collect()
    }
}

/// The step that draws a file of the run.
pub(in crate::cli) fn plot(section: &'static str, file: &str, png: &str, caption: impl Into<String>) -> Step {
    Step::new(section, format!("picture {png}"), "", &format!("plot {DIR}/{file}")).to(png).showing(png, caption)
}

/// The colours of pictures that are compared with each other: those of the scene, or of the first image where the scene has another unit.
pub(in crate::cli) fn alike(has_truth: bool, has_clean: bool) -> Vec<String> {
    let scene = has_truth.then(|| format!("--like={DIR}/scene.fits"));
    scene.into_iter().chain(has_clean.then(|| format!("--like={DIR}/clean-image.fits"))).collect()
}

/// The step that draws the data and a model against the length of the baseline.
pub(in crate::cli) fn fit(section: &'static str, (data, model): (&str, &str), png: &str, caption: impl Into<String>) -> Step {
    plot(section, data, png, caption).with(["--what=model".to_owned(), format!("--model={DIR}/{model}")])
}

/// A path relative to the configuration. The name of a built-in layout stays as it is.
pub(in crate::cli) fn relative(name: &str, folder: &Path) -> String {
    let path = folder.join(name);
    if path.exists() { path.display().to_string() } else { name.to_owned() }
}

/// The results of a step.
pub(in crate::cli) struct Done {
    /// The step.
    pub(in crate::cli) step: Step,
    /// Its command line.
    pub(in crate::cli) command: String,
    /// The object that `--json` prints.
    pub(in crate::cli) json: Value,
    /// Warnings on the way.
    pub(in crate::cli) warnings: Vec<String>,
    /// Wall-clock seconds.
    pub(in crate::cli) seconds: f64,
}
