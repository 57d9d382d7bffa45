//! Names and lengths of files, and paths outside of the project.

use crate::project::{paths, root, sources};
use std::collections::{BTreeMap, BTreeSet};

/// Files that may name the folder beside the project: the default of CITTERT_DATA, for `make interop` only.
const NAME_THE_DATA: [&str; 3] = [".ci/run", "Makefile", "tests/interop/run.sh"];

#[test]
fn source_files_hold_one_idea() {
    let counted: Vec<(String, usize)> = sources().iter().map(|(path, text)| (path.clone(), text.lines().count())).collect();
    let long: Vec<String> = counted.iter().filter(|(_, n)| *n > 500).map(|(path, n)| format!("{path} has {n} lines")).collect();
    assert!(long.is_empty(), "split these files, one idea a file:\n{}", long.join("\n"));
}

/// The names of modules in each folder, from its files and its folders.
fn modules(files: &[String]) -> BTreeMap<String, BTreeSet<String>> {
    let mut out: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in files {
        let mut path = path.trim_end_matches(".rs");
        while let Some((folder, name)) = path.rsplit_once('/') {
            if !["mod", "lib", "main"].contains(&name) {
                out.entry(folder.to_owned()).or_default().insert(name.to_owned());
            }
            path = folder;
        }
    }
    out
}

/// True where one letter is added, left out or changed. A digit may change, because years and numbers are read with care. So may a letter of
/// an abbreviation of three letters, such as `dft` and `fft`.
fn nearly_equal(a: &str, b: &str) -> bool {
    if a.len() <= 3 && b.len() <= 3 {
        return false;
    }
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let same = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    let (rest_a, rest_b) = (&a[same..], &b[same..]);
    let changed = match (rest_a, rest_b) {
        ([x, a @ ..], [y, b @ ..]) if a == b => [x, y],
        (a, [y, b @ ..]) if a == b => [y, y],
        ([x, a @ ..], b) if a == b => [x, x],
        _ => return false,
    };
    changed.iter().all(|c| c.is_alphabetic())
}

#[test]
fn module_names_in_a_folder_differ_by_more_than_a_letter() {
    let files: Vec<String> = sources().into_keys().collect();
    let mut found = Vec::new();
    for (folder, names) in modules(&files) {
        for a in &names {
            found.extend(names.iter().filter(|b| a < *b && nearly_equal(a, b)).map(|b| format!("{folder}: {a} and {b}")));
        }
    }
    assert!(found.is_empty(), "these names are easily confused:\n{}", found.join("\n"));
}

#[test]
fn a_folder_of_modules_has_a_mod_file() {
    let files: BTreeSet<String> = sources().into_keys().collect();
    let beside = |path: &&String| {
        let folder = format!("{}/", path.trim_end_matches(".rs"));
        files.range(folder.clone()..).next().is_some_and(|next| next.starts_with(&folder))
    };
    let found: Vec<&String> = files.iter().filter(beside).collect();
    assert!(found.is_empty(), "these files stand beside a folder of the same name and become its mod.rs: {found:?}");
}

#[test]
fn nothing_names_a_path_outside_of_the_project() {
    let words = [concat!("..", "/shared"), concat!("CITTERT", "_SHARED")];
    let mut found = Vec::new();
    for path in paths("").iter().filter(|p| !NAME_THE_DATA.contains(&p.as_str())) {
        // Binary files and files of the user's own that are not text cannot name a path.
        let Ok(text) = std::fs::read_to_string(root().join(path)) else { continue };
        let lines = text.lines().enumerate().filter(|(_, line)| words.iter().any(|w| line.contains(w)));
        found.extend(lines.map(|(n, line)| format!("{path}:{}: {}", n + 1, line.trim())));
    }
    assert!(found.is_empty(), "a clone of the project stands alone, but these lines name a folder beside it:\n{}", found.join("\n"));
}

#[test]
fn names_that_are_easily_confused_are_found() {
    for (a, b) in [("interval", "intervals"), ("joint", "joins"), ("cell", "cel")] {
        assert!(nearly_equal(a, b) && nearly_equal(b, a), "{a} {b}");
    }
    for (a, b) in [("maetzler96", "maetzler06"), ("uvh5", "calh5"), ("clean", "clean_maker"), ("fits", "uvfits"), ("dft", "fft")] {
        assert!(!nearly_equal(a, b) && !nearly_equal(b, a), "{a} {b}");
    }
    let names = modules(&["x/src/a/mod.rs".into(), "x/src/a/b.rs".into(), "x/src/ab.rs".into()]);
    assert_eq!(names["x/src"], BTreeSet::from(["a".to_owned(), "ab".to_owned()]));
    assert_eq!(names["x/src/a"], BTreeSet::from(["b".to_owned()]));
}
