//! One command of a run, and its results.

use crate::cli::context::shell_word;
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;

/// Placeholder for the output folder in the words of a step.
pub(super) const DIR: &str = "{dir}";

/// One command of the run.
#[derive(Debug, Clone)]
pub(super) struct Step {
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
    pub(super) fn new(section: &'static str, title: impl Into<String>, key: impl Into<String>, words: Vec<String>) -> Self {
        Self { title: title.into(), key: key.into(), section, words, picture: None }
    }

    fn in_dir(&self, dir: &str) -> Vec<String> {
        self.words.iter().map(|w| w.replace(DIR, dir)).collect()
    }

    /// The command as it would be typed, with the output folder `dir`.
    pub(super) fn shown(&self, dir: &str) -> String {
        shown(&self.in_dir(dir))
    }

    /// Program name and words, with the output folder `dir`.
    pub(super) fn argv(&self, dir: &str) -> Vec<OsString> {
        std::iter::once("cittert".into()).chain(self.in_dir(dir).into_iter().map(OsString::from)).collect()
    }
}

pub(super) fn strings(list: &[&str]) -> Vec<String> {
    list.iter().map(|s| (*s).to_owned()).collect()
}

pub(super) fn plot(section: &'static str, file: &str, png: &str, options: &[&str], caption: impl Into<String>) -> Step {
    let mut w = vec!["plot".to_owned(), format!("{DIR}/{file}"), "-o".into(), format!("{DIR}/{png}")];
    w.extend(strings(options));
    let mut step = Step::new(section, format!("picture {png}"), "", w);
    step.picture = Some((png.to_owned(), caption.into()));
    step
}

/// A path relative to the configuration. The name of a built-in layout stays as it is.
pub(super) fn relative(name: &str, folder: &Path) -> String {
    let path = folder.join(name);
    if path.exists() { path.display().to_string() } else { name.to_owned() }
}

/// A command line as it would be typed.
fn shown(words: &[String]) -> String {
    std::iter::once("cittert".to_owned()).chain(words.iter().map(|w| shell_word(w))).collect::<Vec<_>>().join(" ")
}

/// The results of a step.
pub(super) struct Done {
    /// The step.
    pub(super) step: Step,
    /// Its command line.
    pub(super) command: String,
    /// The object that `--json` prints.
    pub(super) json: Value,
    /// Warnings on the way.
    pub(super) warnings: Vec<String>,
    /// Wall-clock seconds.
    pub(super) seconds: f64,
}
