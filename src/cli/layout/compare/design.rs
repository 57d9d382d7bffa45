//! The layouts of a comparison, with names that differ and their figures of merit.

use super::args::CompareArgs;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::layout::figures;
use crate::cli::options::load_layout;
use cittert_arrays::quantity::Length;
use cittert_arrays::{Antenna, ArrayLayout, FigureOptions, LayoutExtent, LayoutFigures, LayoutFrame};
use serde_json::Value;
use std::path::Path;

/// One layout of a comparison.
#[derive(Debug)]
pub(super) struct Design {
    /// Its name in the comparison and the name of its folder: no two layouts have the same.
    pub(super) name: String,
    /// The name or file that was given.
    pub(super) given: String,
    /// The layout as it looks to the zenith or along its boresight, so that all layouts observe alike.
    pub(super) layout: ArrayLayout,
    pub(super) extent: LayoutExtent,
    pub(super) figures: LayoutFigures,
    /// Extent and figures as `layout show` gives them.
    pub(super) json: Value,
}

/// Read all layouts and compute their figures.
///
/// # Errors
/// A text that is no layout, a layout whose figures cannot be computed; the message names it.
pub(super) fn load(args: &CompareArgs) -> Result<Vec<Design>> {
    let layouts: Vec<ArrayLayout> = args.layouts.iter().map(|given| load_layout(given)).collect::<Result<_>>()?;
    let options = FigureOptions { uv_cell: args.figures.uv_cell.or_else(|| common_cell(&layouts, args)), ..args.figures.clone() };
    let named = names(&args.layouts).into_iter().zip(&args.layouts);
    named.zip(layouts).map(|((name, given), layout)| design(name, given, &layout, args, &options)).collect()
}

/// The cell of the u-v fill of all layouts. Alone, each layout has a cell of the size of its smallest element, or of its shortest baseline
/// where it has no diameters. The widest of these serves all, because fills of different cells cannot be compared.
fn common_cell(layouts: &[ArrayLayout], args: &CompareArgs) -> Option<Length> {
    let own = |layout: &ArrayLayout| {
        let diameters = layout.antennas().iter().filter_map(|a| args.figures.diameter.map(Length::si).or(a.diameter_m));
        let smallest = diameters.fold(f64::INFINITY, f64::min);
        if smallest.is_finite() { smallest } else { layout.extent().shortest_m }
    };
    let widest = layouts.iter().map(own).fold(0.0, f64::max);
    (widest > 0.0).then_some(Length(widest))
}

fn design(name: String, given: &str, layout: &ArrayLayout, args: &CompareArgs, options: &FigureOptions) -> Result<Design> {
    let found = layout.figures_with(args.freq.si(), options).map_err(|e| Failure::call(e.into())).context(given)?;
    let mut json = figures::extent_json(layout);
    if let (Value::Object(all), Value::Object(more)) = (&mut json, figures::json(&found, args.freq)) {
        all.extend(more);
    }
    let diameter_m = args.figures.diameter.map(Length::si);
    let antennas = layout.antennas().iter().map(|a| Antenna { diameter_m: diameter_m.or(a.diameter_m), ..a.clone() }).collect();
    let mut seen = ArrayLayout::from_data(name.clone(), LayoutFrame::Boresight, antennas).context(given)?;
    (seen.aperture_m, seen.pattern) = (layout.aperture_m, layout.pattern.clone());
    Ok(Design { name, given: given.to_owned(), extent: layout.extent(), layout: seen, figures: found, json })
}

/// Names of layouts by their files. Where two files have the same name, that of their folder is put before it, and then a number after it.
fn names(given: &[String]) -> Vec<String> {
    let short: Vec<String> = given.iter().map(|text| plain(stem(Path::new(text)))).collect();
    let twins = |all: &[String], name: &str| all.iter().filter(|other| *other == name).count() > 1;
    let long: Vec<String> = given
        .iter()
        .zip(&short)
        .map(|(text, name)| {
            let folder = Path::new(text).parent().and_then(Path::file_name);
            match folder.filter(|_| twins(&short, name)) {
                Some(folder) => format!("{}-{name}", plain(folder.to_string_lossy().into_owned())),
                None => name.clone(),
            }
        })
        .collect();
    let mut taken: Vec<String> = Vec::new();
    for name in &long {
        let numbered = (2..).map(|k| format!("{name}-{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|n| !taken.contains(n) && (n == name || !long.contains(n)));
        taken.extend(free);
    }
    taken
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The text as the name of a folder, which no command reads as an option or a path.
fn plain(text: String) -> String {
    let kept = |c: char| if c.is_alphanumeric() || "-_+".contains(c) { c } else { '_' };
    let name: String = text.trim_start_matches('-').chars().map(kept).collect();
    if name.is_empty() { "layout".into() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(given: &[&str]) -> Vec<String> {
        names(&given.iter().map(|g| (*g).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn names_are_those_of_the_files() {
        assert_eq!(of(&["vla-a", "x/ring 64.toml", "alma.cycle8.1.cfg"]), ["vla-a", "ring_64", "alma_cycle8_1"]);
        assert_eq!(of(&["..", "-o.toml"]), ["__", "o"]);
    }

    #[test]
    fn no_two_layouts_have_the_same_name() {
        assert_eq!(of(&["a/y.toml", "b/y.toml", "z"]), ["a-y", "b-y", "z"]);
        assert_eq!(of(&["y.toml", "y.cfg", "y-2.toml"]), ["y", "y-3", "y-2"]);
        assert_eq!(of(&["1/a/y.toml", "2/a/y.toml"]), ["a-y", "a-y-2"]);
    }
}
