//! The same on the command line: the commands that make the images of a state, and the file of `run`.

use super::scenes::Scenes;
use super::state::State;
use crate::cli::context::shell_word;
use crate::cli::sections::words;
use serde_json::{Value, json};

/// The file of the layout, which the page can save.
const LAYOUT: &str = "layout.toml";

/// A point, which a page without a scene observes.
const POINT: &str = "point.csv";
const POINT_TEXT: &str = "l_rad,m_rad,flux_jy\n0,0,1\n";

/// The commands, each with what it makes, in order.
pub(super) fn steps(state: &State) -> Vec<Value> {
    let mut all = Vec::new();
    // As the page has it, to the last digit.
    let band = state.simulate.keys.get("freq").and_then(toml::Value::as_str).unwrap_or_default();
    all.push(
        json!({ "what": "figures of merit", "line": format!("cittert layout show {LAYOUT} --freq {}", shell_word(band)), "output": "" }),
    );
    let mut add = |what: &str, command: &str, keys: Vec<String>, output: &str| {
        let words: Vec<String> = keys.iter().map(|w| shell_word(w)).collect();
        let line =
            ["cittert", command].into_iter().chain(words.iter().map(String::as_str)).chain(["-o", output]).collect::<Vec<_>>().join(" ");
        all.push(json!({ "what": what, "line": line, "output": output }));
    };
    let mut simulate = vec![format!("--layout={LAYOUT}"), format!("--scene={}", scene(state))];
    let own = state.scene.as_ref().map(|s| words(&s.keys)).unwrap_or_default();
    simulate.extend(own.into_iter().filter(|w| !w.starts_with("--file=")));
    simulate.extend(words(&state.simulate.keys));
    simulate.push(format!("--seed={}", state.seed));
    add("visibilities", "simulate", simulate, "vis.uvh5");
    let mut data = "vis.uvh5";
    let image = words(&state.image.keys);
    if !state.corrupt.keys.is_empty() {
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

/// The files beside the layout that the commands read, with their text where this program has it.
pub(super) fn needs(state: &State, scenes: &Scenes) -> Vec<Value> {
    let name = scene(state);
    let text = if name == POINT { Some(POINT_TEXT) } else { scenes.text(&name) };
    vec![json!({ "name": name, "text": text })]
}

/// The name of the scene on the command line.
fn scene(state: &State) -> String {
    let file = state.scene.as_ref().and_then(|s| s.options.file.as_ref());
    file.map_or_else(|| POINT.to_owned(), |f| f.display().to_string())
}

/// The whole chain as a file of `run`.
pub(super) fn run_file(state: &State) -> String {
    let mut file = toml::Table::new();
    let mut put = |key: &str, value: toml::Value| drop(file.insert(key.to_owned(), value));
    put("title", "From the designer".into());
    put("seed", toml::Value::Integer(i64::try_from(state.seed).unwrap_or(1)));
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
    if !state.corrupt.keys.is_empty() {
        put("corrupt", state.corrupt.keys.clone().into());
    }
    toml::to_string(&file).unwrap_or_default()
}
