//! The pages of the subcommands in the book list all options.

use super::options::{keys, plain, resolved, schema};
use clap::{Arg, Command};
use serde_json::Value;
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

/// Run with CITTERT_BLESS=1 to write the tables anew.
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
            if std::env::var_os("CITTERT_BLESS").is_some() {
                std::fs::write(&path, wanted).unwrap();
            } else {
                stale.push(name.to_owned());
            }
        }
    }
    assert!(stale.is_empty(), "run CITTERT_BLESS=1 cargo test pages_list; stale pages: {stale:?}");
}

/// A row for each key of each section of a file.
fn sections(of: &str) -> String {
    let schema = schema(of);
    let mut out = String::from("| key | meaning | default |\n|---|---|---|\n");
    let mut row = |key: String, node: &Value| {
        let text = plain(node["description"].as_str().unwrap_or_default()).replace('|', "\\|");
        let default = match &node["default"] {
            Value::Null | Value::Bool(false) => String::new(),
            Value::Object(_) | Value::Array(_) => String::new(),
            Value::String(s) => s.clone(),
            other => other.to_string(),
        };
        writeln!(out, "| `{key}` | {text} | {default} |").unwrap();
    };
    for (section, node) in schema["properties"].as_object().unwrap() {
        let list = resolved(&schema, node)["type"] == "array";
        let inner = resolved(&schema, if list { &resolved(&schema, node)["items"] } else { node });
        if inner["properties"].is_null() {
            row(section.clone(), node);
            continue;
        }
        row(if list { format!("[[{section}]]") } else { format!("[{section}]") }, node);
        keys(&schema, section).into_iter().for_each(|(key, node)| row(format!("{section}.{key}"), node));
    }
    out
}

/// Run with CITTERT_BLESS=1 to write the tables and schemas anew.
#[test]
fn pages_and_schemas_list_the_keys_of_the_files() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut stale = Vec::new();
    for of in ["run", "study"] {
        let page = docs.join(format!("user/{of}.md"));
        let text = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = (format!("<!-- options: {of} -->\n"), format!("<!-- end of options: {of} -->"));
        let (before, rest) = text.split_once(&begin).unwrap();
        let (_, after) = rest.split_once(&end).unwrap();
        let file = docs.join(format!("examples/{of}.schema.json"));
        let printed = serde_json::to_string_pretty(&schema(of)).unwrap() + "\n";
        for (path, wanted) in [(page.clone(), format!("{before}{begin}{}{end}{after}", sections(of))), (file, printed)] {
            if std::fs::read_to_string(&path).is_ok_and(|t| t == wanted) {
                continue;
            }
            if std::env::var_os("CITTERT_BLESS").is_some() {
                std::fs::write(&path, wanted).unwrap();
            } else {
                stale.push(path);
            }
        }
    }
    assert!(stale.is_empty(), "run CITTERT_BLESS=1 cargo test pages_; stale: {stale:?}");
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
