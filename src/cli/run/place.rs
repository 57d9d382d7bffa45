//! The hidden folder in which a run works, and its final name. Numbers and messages of a run name the final one.

use super::command::{DIR, Step};
use crate::cli::failure::{Failure, Result};
use cittert_formats::atomic::FileList;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The files that a run reads: its configuration, and all that the words of its steps name.
pub(super) fn inputs(config: &Path, steps: &[Step]) -> Vec<PathBuf> {
    let words = steps.iter().flat_map(|s| &s.words).filter(|w| !w.contains(DIR));
    let named = words.map(|w| PathBuf::from(w.split_once('=').map_or(w.as_str(), |(_, value)| value))).filter(|p| p.is_file());
    std::iter::once(config.to_path_buf()).chain(named).collect()
}

/// Refuse a folder in which somebody else has a file with the name of a file that the steps write, or of one of `own`. Files with other names
/// are kept.
///
/// # Errors
/// The first such file.
pub(in crate::cli) fn refuse_taken(folder: &Path, writer: &str, steps: &[Step], own: &[String]) -> Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    let inside = |w: &String| w.strip_prefix(DIR)?.strip_prefix('/').map(str::to_owned);
    let outputs: Vec<String> = steps.iter().flat_map(|s| s.words.iter().filter_map(inside)).collect();
    // A step whose output has no ending writes several files that begin with that name.
    let is_of = |name: &str, out: &String| {
        let rest = name.strip_prefix(out.as_str());
        name == out || !out.contains('.') && rest.is_some_and(|r| r.starts_with(['-', '.']))
    };
    for path in FileList::read(folder, writer)?.others(folder)? {
        let name = path.to_string_lossy();
        if own.iter().any(|file| *file == name) || outputs.iter().any(|out| is_of(&name, out)) {
            let file = folder.join(&path);
            let text = format!("{}: {writer} has not written this file, and would replace it: move it away", file.display());
            return Err(Failure::message(text));
        }
    }
    Ok(())
}

/// Put the final folder in the place of the hidden one in every text of a result.
pub(in crate::cli) fn renamed(value: Value, hidden: &str, last: &str) -> Value {
    match value {
        Value::String(text) => Value::String(text.replace(hidden, last)),
        Value::Array(all) => all.into_iter().map(|v| renamed(v, hidden, last)).collect(),
        Value::Object(map) => map.into_iter().map(|(key, v)| (key, renamed(v, hidden, last))).collect(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_text_names_the_final_folder() {
        let found = renamed(json!({ "a": [".x.partial/b", 1.5], "c": { "d": "see .x.partial/e" }, "f": null }), ".x.partial", "x");
        assert_eq!(found, json!({ "a": ["x/b", 1.5], "c": { "d": "see x/e" }, "f": null }));
    }
}
