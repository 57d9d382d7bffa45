//! Reads the files of the project.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Source files by their path from the root of the project.
pub type Files = BTreeMap<String, String>;

/// The root files of the four libraries. The program `src/main.rs` uses the first library and has no modules of its own.
pub const CRATES: [&str; 4] = ["src/lib.rs", "arrays/src/lib.rs", "formats/src/lib.rs", "phenomenology/src/lib.rs"];

/// Folders that hold no files of the project.
const OUTSIDE: [&str; 4] = [".git", "target", "demo", "src/cli/design/page/node_modules"];

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Paths from the root of all files below a folder of the project, sorted. The root folder is "".
pub fn paths(folder: &str) -> Vec<String> {
    let mut out = Vec::new();
    let mut folders: Vec<PathBuf> = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
            if !path.is_dir() {
                out.push(name);
            } else if !OUTSIDE.contains(&name.as_str()) {
                folders.push(path);
            }
        }
    }
    out.sort();
    out
}

/// All Rust files of the four libraries, with their tests.
pub fn sources() -> Files {
    let all = CRATES.iter().flat_map(|lib| paths(Path::new(lib).parent().unwrap().to_str().unwrap()));
    let files: Files = all.filter(|p| p.ends_with(".rs")).map(|p| (p.clone(), fs::read_to_string(root().join(p)).unwrap())).collect();
    assert!(files.len() > 100, "found only {} source files", files.len());
    files
}

/// Files of a unit test.
#[cfg(test)]
pub fn planted(files: &[(&str, &str)]) -> Files {
    files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect()
}
