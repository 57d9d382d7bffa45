//! Holds the modules of `src/` apart: who may use whom is checked by reading the `use` lines.

use std::fs;
use std::path::{Path, PathBuf};

/// A rule: files below `module` (or everything, for `""`) may not name `word`, except below the `allowed` folders.
struct Rule {
    word: &'static str,
    allowed: &'static [&'static str],
    text: &'static str,
}

const RULES: &[Rule] = &[
    Rule { word: "rustfft", allowed: &["src/fourier"], text: "rustfft and ndrustfft have one owner: src/fourier" },
    Rule { word: "ndrustfft", allowed: &["src/fourier"], text: "rustfft and ndrustfft have one owner: src/fourier" },
    Rule { word: "argmin", allowed: &["src/mem", "src/design"], text: "argmin has one owner: src/mem (and src/design where it optimises)" },
    Rule { word: "clap", allowed: &["src/cli", "src/main.rs"], text: "clap has one owner: src/cli" },
    Rule {
        word: "cittert_formats",
        allowed: &["src/cli", "src/plot/report.rs"],
        text: "the chain does not know the formats; only src/cli joins things",
    },
    Rule {
        word: "cittert_phenomenology",
        allowed: &["src/cli", "src/plot/report.rs"],
        text: "the chain does not know the scene simulator; only src/cli joins things",
    },
    Rule { word: "crate::cli", allowed: &["src/cli", "src/main.rs"], text: "nothing below may look up at src/cli" },
    Rule {
        word: "hdf5",
        allowed: &["formats/src/h5", "formats/src/uvh5", "formats/src/calh5"],
        text: "hdf5 has one owner: the small modules of formats",
    },
    Rule { word: "indicatif", allowed: &["src/cli"], text: "progress bars belong to src/cli; algorithms report to an Observer" },
];

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

fn uses(line: &str, word: &str) -> bool {
    let line = line.trim_start();
    // Options derive their arguments where the command line is built in; clap appears in no other way below it.
    if line.starts_with("//") || line.starts_with("#[cfg_attr(feature = \"cli\"") {
        return false;
    }
    line.match_indices(word).any(|(i, _)| {
        let before = line[..i].chars().next_back();
        let after = &line[i + word.len()..];
        let starts_a_path = before.is_none_or(|c| !(c.is_alphanumeric() || c == '_' || c == '"'));
        starts_a_path && (after.starts_with("::") || (line.contains("use ") && after.starts_with([';', ' '])))
    })
}

#[test]
fn modules_use_only_what_they_may() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["src", "arrays/src", "formats/src", "phenomenology/src"] {
        sources(&root.join(folder), &mut files);
    }
    assert!(files.len() > 20, "found only {} source files", files.len());
    let mut broken = Vec::new();
    for file in &files {
        let name = file.strip_prefix(root).unwrap().to_string_lossy().into_owned();
        for (number, line) in fs::read_to_string(file).unwrap().lines().enumerate() {
            for rule in RULES {
                if uses(line, rule.word) && !rule.allowed.iter().any(|a| name.starts_with(a)) {
                    broken.push(format!("{name}:{}: {} ({})", number + 1, line.trim(), rule.text));
                }
            }
        }
    }
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

#[test]
fn source_files_hold_one_idea() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["src", "arrays/src", "formats/src", "phenomenology/src"] {
        sources(&root.join(folder), &mut files);
    }
    let long: Vec<String> = files
        .iter()
        .map(|f| (f, fs::read_to_string(f).unwrap().lines().count()))
        .filter(|(_, n)| *n > 500)
        .map(|(f, n)| format!("{} has {n} lines", f.strip_prefix(root).unwrap().display()))
        .collect();
    assert!(long.is_empty(), "split these, one idea a file:\n{}", long.join("\n"));
}

#[test]
fn the_rules_see_what_they_must() {
    assert!(uses("use rustfft::FftPlanner;", "rustfft"));
    assert!(uses("    let p = rustfft::FftPlanner::new();", "rustfft"));
    assert!(!uses("// rustfft::x", "rustfft"));
    assert!(!uses("use ndrustfft::x;", "rustfft"));
}
