//! The tables of the library, for the help.

use crate::sensor::{RADIOMETERS, SCANS, SHAPES, TAPERS};

/// All shapes, tapers, patterns and radiometers.
pub(super) fn help() -> String {
    let shapes = SHAPES.iter().map(|s| (format!("{}={}", s.name, s.sizes), s.about));
    let tapers = TAPERS.iter().map(|t| (if t.count == 0 { t.name.to_owned() } else { format!("{}={}", t.name, t.values) }, t.about));
    let scans = SCANS.iter().map(|s| (s.size.map_or(s.name.to_owned(), |size| format!("{}={size}", s.name)), s.about));
    let radiometers = RADIOMETERS.iter().map(|r| (r.name.to_owned(), r.about));
    let block = |title: &str, rows: Vec<(String, &str)>| {
        let lines: Vec<String> = rows.iter().map(|(syntax, about)| format!("  {syntax:24}  {about}")).collect();
        format!("{title}:\n{}", lines.join("\n"))
    };
    [
        block("Shapes", shapes.collect()),
        block("Tapers", tapers.collect()),
        block("Scan patterns", scans.collect()),
        block("Radiometers", radiometers.collect()),
    ]
    .join("\n\n")
}
