//! One schema of options: the command line, the files of `run` and `study`, and their JSON schemas agree in names, help texts and defaults.

use crate::program::Scratch;
use clap::{Arg, Command};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A section of a file and the command whose options it holds.
struct Pair {
    section: &'static str,
    command: &'static str,
}

const RUN: [Pair; 7] = [
    Pair { section: "scene", command: "simulate" },
    Pair { section: "simulate", command: "simulate" },
    Pair { section: "image", command: "dirty" },
    Pair { section: "clean", command: "clean" },
    Pair { section: "mem", command: "mem" },
    Pair { section: "corrupt", command: "corrupt" },
    Pair { section: "selfcal", command: "selfcal" },
];
const STUDY: [Pair; 6] = [
    Pair { section: "scene", command: "simulate" },
    Pair { section: "simulate", command: "simulate" },
    Pair { section: "image", command: "dirty" },
    Pair { section: "clean", command: "clean" },
    Pair { section: "corrupt", command: "corrupt" },
    Pair { section: "selfcal", command: "selfcal" },
];

/// Keys of sections that are no options: files and points of a scene.
const NO_OPTIONS: [&str; 2] = ["file", "points"];

/// Options of commands that no section has: inputs and outputs, images beside those that are compared with the scene, and the seed, which belongs to
/// the whole file.
const OF_THE_CALL: [&str; 19] = [
    "layout",
    "scene",
    "output",
    "overwrite",
    "column",
    "log",
    "startmod",
    "gains",
    "config",
    "help",
    "version",
    "seed",
    "pbcor",
    "pbcor-limit",
    "slurm",
    "slurm-time",
    "slurm-memory",
    "slurm-cpus",
    "slurm-option",
];

fn command(name: &str) -> Command {
    let mut all = cittert::cli::command();
    all.build();
    all.find_subcommand(name).unwrap_or_else(|| panic!("no command {name}")).clone()
}

fn argument(command: &Command, key: &str) -> Option<Arg> {
    let named = |a: &&Arg| a.get_long() == Some(key);
    command.get_arguments().find(named).cloned()
}

/// A node of a schema with its references followed and the case of null left out.
pub(super) fn resolved<'a>(schema: &'a Value, node: &'a Value) -> &'a Value {
    if let Some(path) = node["$ref"].as_str() {
        return resolved(schema, schema.pointer(path.trim_start_matches('#')).unwrap());
    }
    match node["anyOf"].as_array() {
        Some(cases) => resolved(schema, cases.iter().find(|c| c["type"] != "null").unwrap()),
        None => node,
    }
}

/// Keys of a section with their nodes.
pub(super) fn keys<'a>(schema: &'a Value, section: &str) -> BTreeMap<&'a str, &'a Value> {
    let mut node = resolved(schema, &schema["properties"][section]);
    if node["type"] == "array" {
        node = resolved(schema, &node["items"]);
    }
    node["properties"].as_object().unwrap_or_else(|| panic!("{section}: {node}")).iter().map(|(k, v)| (k.as_str(), v)).collect()
}

pub(super) fn schema(of: &str) -> Value {
    serde_json::from_str(&Scratch::new().ok(&format!("{of} --schema")).out).unwrap()
}

/// A help text without line breaks and without its last full stop.
pub(super) fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}

/// The default of an argument as the schema would have it: null where there is none.
fn same_default(arg: &Arg, in_schema: &Value) -> bool {
    if !arg.get_action().takes_values() {
        return in_schema.is_null() || *in_schema == Value::Bool(false);
    }
    let on_line: Vec<String> = arg.get_default_values().iter().map(|v| v.to_string_lossy().into_owned()).collect();
    let number = |text: &str| text.parse::<f64>().ok();
    let equal = |value: &Value, text: &String| match value {
        Value::String(s) => s == text,
        Value::Number(n) => number(text).is_some_and(|x| Some(x) == n.as_f64()),
        _ => false,
    };
    match in_schema {
        Value::Null => on_line.is_empty(),
        Value::Array(list) => list.len() == on_line.len() && list.iter().zip(&on_line).all(|(v, t)| equal(v, t)),
        value => on_line.len() == 1 && equal(value, &on_line[0]),
    }
}

fn differences(of: &str, pairs: &[Pair]) -> String {
    let (schema, mut wrong) = (schema(of), String::new());
    for pair in pairs {
        let command = command(pair.command);
        for (key, node) in keys(&schema, pair.section).into_iter().filter(|(k, _)| !NO_OPTIONS.contains(k)) {
            let place = format!("{of} [{}] {key}", pair.section);
            let Some(arg) = argument(&command, key) else {
                writeln!(wrong, "{place}: `{}` has no --{key}", pair.command).unwrap();
                continue;
            };
            let help = plain(&arg.get_help().map(ToString::to_string).unwrap_or_default());
            let described = plain(node["description"].as_str().unwrap_or_default());
            if help != described {
                writeln!(wrong, "{place}: the help text is {help:?}, the schema says {described:?}").unwrap();
            }
            if !same_default(&arg, &node["default"]) {
                let default: Vec<_> = arg.get_default_values().iter().map(|v| v.to_string_lossy()).collect();
                writeln!(wrong, "{place}: the default is {default:?} on the command line and {} in the schema", node["default"]).unwrap();
            }
        }
        // Every option of the command is in a section of the file.
        for arg in command.get_arguments().filter(|a| !a.is_global_set() && !a.is_positional()) {
            let Some(long) = arg.get_long().filter(|l| !OF_THE_CALL.contains(l)) else { continue };
            let mut sections = pairs.iter().map(|p| keys(&schema, p.section));
            let closure = of == "run" && pair.command == "mem" && arg.get_help_heading() == Some("Closure quantities");
            // A study scores images and gains.
            let of_study =
                of == "study" && pair.command == "selfcal" && ["prior", "pointing", "pointing-interval", "solve"].contains(&long);
            if !closure && !of_study && !sections.any(|s| s.contains_key(long)) {
                writeln!(wrong, "{of}: no section has --{long} of `{}`", pair.command).unwrap();
            }
        }
    }
    wrong
}

#[test]
fn the_command_line_the_files_and_their_schemas_agree() {
    let wrong = differences("run", &RUN) + &differences("study", &STUDY);
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// A TOML value of a default; `None` for null.
fn toml(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::Array(list) => Some(format!("[{}]", list.iter().filter_map(toml).collect::<Vec<_>>().join(", "))),
        other => Some(other.to_string()),
    }
}

/// A file with every key of some sections at its default.
fn with_defaults(of: &str, start: &str, sections: &[&str]) -> String {
    let schema = schema(of);
    let mut text = start.to_owned();
    for section in sections {
        let list = resolved(&schema, &schema["properties"][*section])["type"] == "array";
        writeln!(text, "{}", if list { format!("[[{section}]]") } else { format!("[{section}]") }).unwrap();
        if *section == "simulate" {
            text += "freq = \"94GHz\"\nbandwidth = \"1GHz\"\n";
        }
        for (key, node) in keys(&schema, section) {
            if let Some(value) = toml(&node["default"]) {
                writeln!(text, "{key} = {value}").unwrap();
            }
        }
    }
    text
}

#[test]
fn files_take_every_default_that_their_schemas_name() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    let run = "title = \"t\"\nlayout = { name = \"mm-y\" }\nscene = { file = \"s.csv\" }\n";
    s.write("run.toml", with_defaults("run", run, &["simulate", "image", "clean", "mem", "corrupt", "selfcal"]));
    s.ok("run run.toml --check");
    let study = "title = \"t\"\nseeds = 1\nlayout = { name = \"mm-y\" }\nscene = { points = [{ flux = \"1Jy\" }] }\n";
    s.write("study.toml", with_defaults("study", study, &["simulate", "image", "clean", "corrupt", "selfcal"]));
    s.ok("study study.toml --check");
}

#[test]
fn a_wrong_key_or_value_is_refused_with_its_line_in_both_files() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    let band = "[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n";
    let run = format!("title = \"t\"\nlayout = {{ name = \"mm-y\" }}\nscene = {{ file = \"s.csv\" }}\n{band}[image]\nrobust = 0.5\n");
    let study = run.replace("title", "seeds = 1\ntitle").replace("file = \"s.csv\"", "points = [{ flux = \"1Jy\" }]");
    for (command, text, line) in [("run c.toml -o out", &run, 8), ("study c.toml -o out", &study, 9)] {
        for (to, word) in [("robustness = 0.5", "robustness"), ("weighting = \"best\"", "best"), ("cell = \"3\"", "no unit")] {
            s.write("c.toml", text.replace("robust = 0.5", to));
            s.fails(command, 1, &[&format!("line {line}"), word]);
        }
    }
}
