//! The book's page of formats against the table, and its list of pages against the folders.

use cittert_formats::FORMATS;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const BEGIN: &str = "<!-- table of formats -->\n";
const END: &str = "<!-- end of table -->";
/// The row of the format that is there only with the feature `ms`.
const OPTIONAL: &str = "| [Measurement Set]";

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// The page about a format.
fn page(name: &str) -> &'static str {
    match name {
        "UVH5" => "uvh5.md",
        "UVFITS" => "uvfits.md",
        "Measurement Set" => "measurement-set.md",
        "CalH5" => "calh5.md",
        "FITS image" => "fits.md",
        "source list" => "sources.md",
        _ => "layouts.md",
    }
}

fn table() -> String {
    let mut out = String::from("| format | holds | endings | what it is |\n|---|---|---|---|\n");
    let mut row = |name: &str, kind: &str, ends: &[&str], what: &str| {
        let ends: Vec<String> = ends.iter().map(|e| format!("`.{e}`")).collect();
        writeln!(out, "| [{name}]({}) | {kind} | {} | {what} |", page(name), ends.join(" ")).unwrap();
    };
    for f in FORMATS.iter() {
        row(f.name(), f.holds().name(), f.extensions(), f.label().description);
    }
    out
}

/// Without the row that only some builds have.
fn common(table: &str) -> String {
    table.lines().filter(|l| !l.starts_with(OPTIONAL)).collect::<Vec<_>>().join("\n")
}

/// Run with CITTERT_UPDATE_DOCS=1 and the feature `ms` to write the table anew.
#[test]
fn the_page_of_formats_shows_the_table() {
    let path = docs().join("formats/overview.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (shown, after) = rest.split_once(END).unwrap();
    let wanted = table();
    assert!(!cfg!(feature = "ms") || wanted.contains(OPTIONAL));
    if cfg!(feature = "ms") && std::env::var_os("CITTERT_UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{wanted}{END}{after}")).unwrap();
        return;
    }
    let same = if cfg!(feature = "ms") { shown == wanted } else { common(shown) == common(&wanted) };
    assert!(same, "stale: run CITTERT_UPDATE_DOCS=1 cargo test -p cittert-formats --features ms the_page_of_formats\n{wanted}");
    for f in FORMATS.iter() {
        assert!(docs().join("formats").join(page(f.name())).is_file());
    }
}

#[test]
fn the_summary_lists_every_page() {
    let docs = docs();
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    for folder in ["formats", "algorithms"] {
        for entry in std::fs::read_dir(docs.join(folder)).unwrap() {
            let name = entry.unwrap().file_name().to_string_lossy().into_owned();
            assert!(
                !name.ends_with(".md") || summary.contains(&format!("({folder}/{name})")),
                "docs/SUMMARY.md does not list {folder}/{name}"
            );
        }
    }
}
