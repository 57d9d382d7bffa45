//! The book's pages of the subcommands list the options that there are.

use clap::{Arg, Command};
use std::fmt::Write;
use std::path::Path;

const BEGIN: &str = "<!-- options -->\n";
const END: &str = "<!-- end of options -->";

fn shown(arg: &Arg) -> String {
    let values = arg.get_value_names().map(|v| v.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" ")).unwrap_or_default();
    let takes = arg.get_action().takes_values();
    match (arg.get_long(), arg.get_short()) {
        (Some(long), Some(short)) if takes => format!("`-{short}`, `--{long} {values}`"),
        (Some(long), Some(short)) => format!("`-{short}`, `--{long}`"),
        (Some(long), None) if takes => format!("`--{long} {values}`"),
        (Some(long), None) => format!("`--{long}`"),
        _ => format!("`{values}`"),
    }
}

fn table(command: &Command) -> String {
    let mut out = String::from("| option | meaning | default |\n|---|---|---|\n");
    for arg in
        command.get_arguments().filter(|a| !["help", "version"].contains(&a.get_id().as_str()) && !a.is_global_set() && !a.is_hide_set())
    {
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default().replace('|', "\\|");
        let default: Vec<String> = arg.get_default_values().iter().map(|d| d.to_string_lossy().into_owned()).collect();
        let default = if arg.get_action().takes_values() { default.join(",") } else { String::new() };
        writeln!(out, "| {} | {help} | {default} |", shown(arg).replace('|', "\\|")).unwrap();
    }
    out
}

fn section(command: &Command) -> String {
    if !command.has_subcommands() {
        return table(command);
    }
    let mut out = String::new();
    for sub in command.get_subcommands().filter(|s| s.get_name() != "help") {
        let about = sub.get_about().map(ToString::to_string).unwrap_or_default();
        writeln!(out, "### {} {}\n\n{about}\n\n{}", command.get_name(), sub.get_name(), table(sub)).unwrap();
    }
    out
}

/// Run with CITTERT_UPDATE_DOCS=1 to write the tables anew.
#[test]
fn pages_list_the_options_that_there_are() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/user");
    let summary = std::fs::read_to_string(folder.join("../SUMMARY.md")).unwrap();
    let mut stale = Vec::new();
    for command in cittert::cli::command().get_subcommands().filter(|c| c.get_name() != "help") {
        let name = command.get_name();
        assert!(summary.contains(&format!("(user/{name}.md)")), "docs/SUMMARY.md does not link user/{name}.md");
        let path = folder.join(format!("{name}.md"));
        let page = std::fs::read_to_string(&path).unwrap_or_else(|_| panic!("no page {}", path.display()));
        let (before, rest) = page.split_once(BEGIN).unwrap_or_else(|| panic!("{name}.md has no place for its options"));
        let (_, after) = rest.split_once(END).unwrap();
        let wanted = format!("{before}{BEGIN}{}{END}{after}", section(command));
        if wanted != page {
            if std::env::var_os("CITTERT_UPDATE_DOCS").is_some() {
                std::fs::write(&path, wanted).unwrap();
            } else {
                stale.push(name.to_owned());
            }
        }
    }
    assert!(stale.is_empty(), "run CITTERT_UPDATE_DOCS=1 cargo test pages_list; stale pages: {stale:?}");
}

/// Every relative link of the book leads somewhere.
#[test]
fn links_of_the_book_lead_somewhere() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut broken = Vec::new();
    let mut todo = vec![docs.clone(), docs.parent().unwrap().join("README.md")];
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            todo.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
            continue;
        }
        if path.extension().is_none_or(|e| e != "md") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for part in text.split("](").skip(1) {
            let target = part.split(')').next().unwrap().split('#').next().unwrap();
            if !target.is_empty() && !target.contains("://") && !path.parent().unwrap().join(target).exists() {
                broken.push(format!("{}: {target}", path.strip_prefix(docs.parent().unwrap()).unwrap().display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
