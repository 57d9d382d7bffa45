//! What a Measurement Set holds that comes neither with its rows nor with its header.

use super::parts;
use super::table::{Kind, Table};
use super::{annotations, own};
use crate::Result;
use std::path::Path;

/// Number of rows that are compared together.
const STEP: usize = 65_536;
/// Columns of the main table that are read.
const READ: [&str; 13] = [
    "ANTENNA1",
    "ANTENNA2",
    "FIELD_ID",
    "TIME",
    "EXPOSURE",
    "UVW",
    "DATA",
    "FLAG",
    "FLAG_ROW",
    "DATA_DESC_ID",
    "WEIGHT_SPECTRUM",
    "MODEL_DATA",
    "CORRECTED_DATA",
];
/// Numbers of rows of subtables, which say nothing where all rows have the same.
const INDICES: [&str; 7] = ["ARRAY_ID", "FEED1", "FEED2", "OBSERVATION_ID", "PROCESSOR_ID", "SCAN_NUMBER", "STATE_ID"];
/// Columns that mostly hold the same as another one.
const TWINS: [(&str, &str); 2] = [("TIME_CENTROID", "TIME"), ("INTERVAL", "EXPOSURE")];
/// Subtables with their columns that are read, or that follow from what is read.
const SUBTABLES: [(&str, &[&str]); 7] = [
    ("ANTENNA", &["NAME", "STATION", "POSITION", "DISH_DIAMETER", "MOUNT", "TYPE", "FLAG_ROW"]),
    ("DATA_DESCRIPTION", &["FLAG_ROW", "POLARIZATION_ID", "SPECTRAL_WINDOW_ID"]),
    ("FIELD", &["NAME", "PHASE_DIR", "SOURCE_ID", "NUM_POLY", "FLAG_ROW", "TIME", "PhaseDir_Ref"]),
    ("HISTORY", &["MESSAGE", "APPLICATION", "ORIGIN", "PRIORITY", "OBJECT_ID", "OBSERVATION_ID"]),
    ("OBSERVATION", &["TELESCOPE_NAME", "TELESCOPE_LOCATION", "OBSERVER", "PROJECT", "TIME_RANGE", "FLAG_ROW"]),
    ("POLARIZATION", &["CORR_TYPE", "CORR_PRODUCT", "NUM_CORR", "FLAG_ROW"]),
    ("SPECTRAL_WINDOW", &["CHAN_FREQ", "CHAN_WIDTH", "NUM_CHAN", "TOTAL_BANDWIDTH", "FLAG_ROW"]),
];

pub(super) fn lines(ms: &Path, main: &Table, has_spectrum: bool) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    for column in main.column_names()? {
        match column.as_str() {
            "WEIGHT" if has_spectrum => lines.push("column WEIGHT (the weights of WEIGHT_SPECTRUM are kept)".into()),
            "WEIGHT" => {}
            "SIGMA" | "SIGMA_SPECTRUM" => lines.push(format!("column {column} (the weights are kept)")),
            "FLAG_CATEGORY" if main.cell_shape("FLAG_CATEGORY", 0)?.is_none_or(|shape| shape.contains(&0)) => {}
            name if READ.contains(&name) => {}
            name if INDICES.contains(&name) && is_constant(main, name)? => {}
            name => match TWINS.iter().find(|(column, _)| *column == name) {
                Some((column, twin)) if is_same(main, column, twin)? => {}
                Some((column, twin)) => lines.push(format!("column {column} ({twin} is kept)")),
                None => lines.push(format!("column {name}")),
            },
        }
    }
    for (letter, key) in main.keyword_names(None)? {
        match letter {
            't' => subtable(ms, &key, &mut lines)?,
            _ if key == "MS_VERSION" || own::KEYWORDS.contains(&key.as_str()) || annotations::is_own(&key) => {}
            _ => lines.push(format!("keyword {key}")),
        }
    }
    for (letter, key) in main.keyword_names(Some(annotations::KEYWORDS))? {
        if !"bifs".contains(letter) {
            lines.push(format!("keyword {key} (it is not one number or text)"));
        }
    }
    Ok(lines)
}

fn subtable(ms: &Path, name: &str, lines: &mut Vec<String>) -> Result<()> {
    if !ms.join(name).join("table.dat").is_file() {
        lines.push(format!("subtable {name}"));
        return Ok(());
    }
    let (table, rows) = parts::open(ms, name)?;
    if rows == 0 {
        return Ok(());
    }
    let Some((_, read)) = SUBTABLES.iter().find(|(known, _)| *known == name) else {
        lines.push(match name {
            "FEED" => "subtable FEED (the names of the products are kept)".into(),
            "SOURCE" => "subtable SOURCE (the names and directions of FIELD are kept)".into(),
            _ => format!("subtable {name}"),
        });
        return Ok(());
    };
    let others: Vec<String> = table.column_names()?.into_iter().filter(|c| !read.contains(&c.as_str())).collect();
    if !others.is_empty() {
        let word = if others.len() == 1 { "column" } else { "columns" };
        lines.push(format!("{word} {} of {name}", others.join(", ")));
    }
    if name == "OBSERVATION" && rows > 1 {
        lines.push("rows of OBSERVATION after the first".into());
    }
    Ok(())
}

/// Whether all rows have the same number.
fn is_constant(main: &Table, column: &str) -> Result<bool> {
    if main.column_ndim(column, Kind::Int)? != Some(-1) {
        return Ok(false);
    }
    let rows = main.n_rows() as usize;
    let mut first = None;
    for start in (0..rows).step_by(STEP) {
        for value in main.scalars::<i32>(column, start, STEP.min(rows - start))? {
            if *first.get_or_insert(value) != value {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// Whether two columns of numbers are the same.
fn is_same(main: &Table, a: &str, b: &str) -> Result<bool> {
    let rows = main.n_rows() as usize;
    for start in (0..rows).step_by(STEP) {
        let n = STEP.min(rows - start);
        if main.scalars::<f64>(a, start, n)? != main.scalars::<f64>(b, start, n)? {
            return Ok(false);
        }
    }
    Ok(true)
}
