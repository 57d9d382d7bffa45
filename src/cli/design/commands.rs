//! The same on the command line: the commands that make the images of a state, the files that they read, and the file of `run`.

use super::chain;
use super::scenes::Scenes;
use super::state::State;
use crate::cli::context::shell_word;
use crate::cli::failure::Result;
use crate::cli::sections::{words, words_of};
use serde::Serialize;
use serde_json::{Value, json};

/// The file of the layout, which the page can save.
pub(super) const LAYOUT: &str = "layout.toml";

/// A point, which a page without a scene observes.
const POINT: &str = "point.csv";
const POINT_TEXT: &str = "l_rad,m_rad,flux_jy\n0,0,1\n";
/// Ends the text of a file in the script.
const END: &str = "END_OF_FILE";

/// A command.
#[derive(Debug, Serialize)]
pub(super) struct Step {
    /// What it makes.
    what: &'static str,
    /// As it is typed.
    line: String,
    /// The file that it writes, or the beginning of the names of its files. Empty for one that prints.
    output: &'static str,
}

/// A file that the commands read.
#[derive(Debug, Serialize)]
pub(super) struct Need {
    name: String,
    /// What it holds, where this program has it as text.
    text: Option<String>,
}

/// The answer `commands`.
///
/// # Errors
/// None in practice: the state came as text.
pub(super) fn told(seq: u64, state: &State, layout: &str, scenes: &Scenes) -> Result<Value> {
    let (steps, needs) = (steps(state), needs(state, scenes));
    Ok(json!({
        "is": "commands", "seq": seq, "script": script(&steps, layout, &needs), "steps": steps, "needs": needs, "layout": layout, "run": run_file(state)?,
    }))
}

/// A shell script that makes all images of the page in an empty folder: it writes the files first.
fn script(steps: &[Step], layout: &str, needs: &[Need]) -> String {
    let mut out = "#!/bin/sh\nset -e\n".to_owned();
    let own = Need { name: LAYOUT.into(), text: Some(layout.to_owned()) };
    for need in [&own].into_iter().chain(needs) {
        let name = shell_word(&need.name);
        out += &match &need.text {
            Some(text) => format!("cat > {name} <<'{END}'\n{}\n{END}\n", text.trim_end_matches('\n')),
            None => format!("# Put {name} into this folder first.\n"),
        };
    }
    steps.iter().for_each(|step| out += &format!("{}\n", step.line));
    out
}

/// The commands in order.
pub(super) fn steps(state: &State) -> Vec<Step> {
    let mut all = Vec::new();
    // As the page has it, to the last digit.
    let band = state.simulate.keys.get("freq").and_then(toml::Value::as_str).unwrap_or_default();
    let line = format!("cittert layout show {LAYOUT} --freq={}", shell_word(band));
    all.push(Step { what: "figures of merit", line, output: "" });
    let mut add = |what, command: &str, keys: Vec<String>, output| {
        let words: Vec<String> = keys.iter().map(|w| shell_word(w)).collect();
        let line = ["cittert", command].into_iter().chain(words.iter().map(String::as_str)).chain(["-o", output]);
        all.push(Step { what, line: line.collect::<Vec<_>>().join(" "), output });
    };
    let mut simulate = vec![format!("--layout={LAYOUT}"), format!("--scene={}", scene(state))];
    simulate.extend(state.scene.as_ref().map(|s| words_of(&s.keys, |key| key != "file")).unwrap_or_default());
    simulate.extend(words(&state.simulate.keys));
    simulate.push(format!("--seed={}", state.seed));
    add("visibilities", "simulate", simulate, "vis.uvh5");
    let mut data = "vis.uvh5";
    let image = words(&state.image.keys);
    if chain::has_errors(state) {
        let errors = [words(&state.corrupt.keys), vec![format!("--seed={}", state.seed)]].concat();
        add("errors", "corrupt vis.uvh5", errors, "corrupted.uvh5");
        data = "corrupted.uvh5";
    }
    add("beam", &format!("beam {data}"), image.clone(), "psf.fits");
    if let Some(section) = &state.selfcal {
        add("self-calibration", &format!("selfcal {data}"), [image.clone(), words(&section.keys)].concat(), "selfcal");
        data = "selfcal.uvh5";
    }
    add("dirty image", &format!("dirty {data}"), image.clone(), "dirty.fits");
    if let Some(section) = &state.clean {
        add("CLEAN", &format!("clean {data} --startmod=never"), [image.clone(), words(&section.keys)].concat(), "clean");
    }
    if let Some(section) = &state.mem {
        add("maximum entropy", &format!("mem {data}"), [image, words(&section.keys)].concat(), "mem");
    }
    all
}

/// The files beside the layout that the commands read.
fn needs(state: &State, scenes: &Scenes) -> Vec<Need> {
    let name = scene(state);
    let text = if name == POINT { Some(POINT_TEXT.to_owned()) } else { scenes.text(&name) };
    vec![Need { name, text }]
}

/// The name of the scene on the command line.
fn scene(state: &State) -> String {
    let file = state.scene.as_ref().and_then(|s| s.options.file.as_ref());
    file.map_or_else(|| POINT.to_owned(), |f| f.display().to_string())
}

/// The whole chain as a file of `run`. It images the data without errors by CLEAN and maximum entropy, and those with errors by CLEAN.
///
/// # Errors
/// None in practice: the state came as text.
fn run_file(state: &State) -> Result<String> {
    let mut file = toml::Table::new();
    let mut put = |key: &str, value: toml::Value| drop(file.insert(key.to_owned(), value));
    put("title", "From the designer".into());
    put("seed", toml::Value::Integer(i64::try_from(state.seed)?));
    put("layout", toml::Table::from_iter([("name".to_owned(), LAYOUT.into())]).into());
    let mut observed = state.scene.as_ref().map(|s| s.keys.clone()).unwrap_or_default();
    observed.insert("file".into(), scene(state).into());
    put("scene", observed.into());
    put("simulate", state.simulate.keys.clone().into());
    put("image", state.image.keys.clone().into());
    if let Some(section) = &state.clean {
        put("clean", toml::Value::Array(vec![section.keys.clone().into()]));
    }
    for (key, keys) in [("mem", state.mem.as_ref().map(|s| &s.keys)), ("selfcal", state.selfcal.as_ref().map(|s| &s.keys))] {
        if let Some(keys) = keys {
            put(key, keys.clone().into());
        }
    }
    if chain::has_errors(state) {
        put("corrupt", state.corrupt.keys.clone().into());
    }
    Ok(toml::to_string(&file)?)
}
