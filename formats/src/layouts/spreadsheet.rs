//! Tables from spreadsheets: a head line that names the columns with their units, such as `name,x_mm,y_mm`, then a line for each antenna.
//!
//! The columns are `x`, `y` and, where there are any, `name`, `number`, `z`, `diameter`, `tsys_k`, `sefd_jy` in any order. Lengths end in `_m`, `_cm` or `_mm`; metres
//! where nothing is said. Without a site in comments the frame is that of the boresight, in which x points to the right and y up.

use super::error::{LayoutError, ReadContext, Result};
use super::text::{self, Keeps};
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Sensitivity};
use std::fmt::Write;

pub(crate) struct Spreadsheet;

/// The columns, and whether they are lengths.
const COLUMNS: [(&str, bool); 8] =
    [("name", false), ("number", false), ("x", true), ("y", true), ("z", true), ("diameter", true), ("tsys_k", false), ("sefd_jy", false)];
const NAME: usize = 0;
const NUMBER: usize = 1;
const X: usize = 2;
const Y: usize = 3;
const Z: usize = 4;
const DIAMETER: usize = 5;
const TSYS: usize = 6;
const SEFD: usize = 7;
/// Units of length, and how many metres they are.
const UNITS: [(&str, f64); 4] = [("_mm", 1e-3), ("_cm", 1e-2), ("_m", 1.0), ("", 1.0)];

/// A column: its place in [`COLUMNS`] and its unit.
fn column(title: &str) -> Option<(usize, f64)> {
    let title = title.to_ascii_lowercase();
    COLUMNS.iter().enumerate().find_map(|(k, (name, is_length))| {
        let rest = title.strip_prefix(name)?;
        let unit = if *is_length { UNITS.iter().find(|(ending, _)| *ending == rest)?.1 } else { 1.0 };
        (*is_length || rest.is_empty()).then_some((k, unit))
    })
}

/// The lines that are no comments, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.trim_start_matches('\u{feff}');
    text.lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
}

/// The fields of a line that is separated as the head line is.
fn fields<'a>(line: &'a str, head: &str) -> Vec<&'a str> {
    let separator = ['\t', ';', ','].into_iter().find(|c| head.contains(*c));
    let clean = |f: &'a str| f.trim().trim_matches('"').trim();
    match separator {
        Some(c) => line.split(c).map(clean).collect(),
        None => line.split_whitespace().map(clean).collect(),
    }
}

/// Columns for x and y, but not those of a station table of eht-imaging, whose `SEFD` has no unit and whose places are geocentric.
fn is_head(line: &str) -> bool {
    let titles = fields(line, line);
    let has = |c: usize| titles.iter().any(|t| column(t).is_some_and(|(k, _)| k == c));
    has(X) && has(Y) && !titles.iter().any(|t| ["sefd", "sefdr"].contains(&t.to_ascii_lowercase().as_str()))
}

impl LayoutFormat for Spreadsheet {
    fn label(&self) -> Label {
        Label {
            name: "spreadsheet",
            extensions: &["tsv", "csv"],
            description: "columns named in a head line: name, x_m, y_m, z_m, diameter_m, tsys_k, sefd_jy",
        }
    }

    fn sniff(&self, text: &str, _: &str) -> bool {
        lines(text).next().is_some_and(|(_, line)| is_head(line))
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let mut lines = lines(text);
        let Some((at, head)) = lines.next() else {
            return Err(LayoutError::Missing("there is no head line, such as name,x_m,y_m".into()));
        };
        let mut place: [Option<(usize, f64)>; COLUMNS.len()] = [None; COLUMNS.len()];
        for (k, title) in fields(head, head).into_iter().enumerate() {
            let bad = |expected: &str| LayoutError::Line { line: at, expected: expected.into(), found: title.into() };
            let Some((c, unit)) = column(title) else {
                return Err(bad("names of columns out of name, number, x, y, z and diameter (with _m, _cm or _mm), tsys_k, sefd_jy"));
            };
            if place[c].replace((k, unit)).is_some() {
                return Err(bad("each column once"));
            }
        }
        if place[X].is_none() || place[Y].is_none() {
            return Err(LayoutError::Line { line: at, expected: "columns x_m and y_m".into(), found: head.into() });
        }
        let mut antennas = Vec::new();
        for (number, line) in lines {
            antennas.push(antenna(&place, number, &fields(line, head), antennas.len())?);
        }
        let on_the_ground = context.site.is_some() || text::commented_site(text)?.is_some();
        if on_the_ground {
            return text::local_layout(text, context, antennas);
        }
        let name = text::comment(text, "name").map_or(context.name.as_str(), |(_, n)| n);
        Ok(ArrayLayout::new(name, LayoutFrame::Boresight, antennas)?)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let mut t = text::local_header(layout);
        t.push_str("name\tnumber\tx_m\ty_m\tz_m\tdiameter_m\ttsys_k\tsefd_jy\n");
        let shown = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:?}"));
        for a in layout.antennas() {
            let [x, y, z] = a.position_m;
            let (tsys, sefd) = match a.sensitivity {
                Some(Sensitivity::TsysK(t)) => (Some(t), None),
                Some(Sensitivity::SefdJy(s)) => (None, Some(s)),
                None => (None, None),
            };
            let rest = [shown(a.diameter_m), shown(tsys), shown(sefd)].join("\t");
            // Writing to a String cannot fail.
            let _ = writeln!(t, "{}\t{}\t{x:?}\t{y:?}\t{z:?}\t{rest}", text::one_field(&a.name), a.number);
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        let keeps = Keeps { names: true, numbers: true, diameters: true, sensitivities: true, exact_site: true, ..Keeps::default() };
        let mut lost = text::lost(layout, keeps);
        // No other program reads these tables.
        lost.retain(|what| !what.starts_with("the boresight frame"));
        lost
    }
}

/// The antenna of one line, the `index`-th from 0.
fn antenna(place: &[Option<(usize, f64)>; COLUMNS.len()], line: usize, fields: &[&str], index: usize) -> Result<Antenna> {
    let text = |c: usize| place[c].and_then(|(k, _)| fields.get(k).copied()).filter(|f| !f.is_empty());
    let value = |c: usize| {
        let unit = place[c].map_or(1.0, |(_, unit)| unit);
        text(c).map(|f| text::number(line, f, COLUMNS[c].0).map(|v| v * unit)).transpose()
    };
    let bad = |expected: &str| LayoutError::Line { line, expected: expected.into(), found: fields.join(" ") };
    let needed = |c: usize| value(c)?.ok_or_else(|| bad(&format!("a number in the column {}", COLUMNS[c].0)));
    let positive = |c: usize| match value(c)? {
        Some(v) if v <= 0.0 => Err(bad(&format!("a positive {}, or nothing", COLUMNS[c].0))),
        v => Ok(v),
    };
    let number = match text(NUMBER) {
        Some(f) => f.parse::<u32>().map_err(|_| bad("an antenna number from 0 on in the column number"))?,
        None => index as u32,
    };
    let sensitivity = match (positive(TSYS)?, positive(SEFD)?) {
        (Some(_), Some(_)) => return Err(bad("tsys_k or sefd_jy, not both")),
        (Some(t), None) => Some(Sensitivity::TsysK(t)),
        (None, s) => s.map(Sensitivity::SefdJy),
    };
    let position_m = [needed(X)?, needed(Y)?, value(Z)?.unwrap_or(0.0)];
    let name = text(NAME).map_or_else(|| format!("A{:02}", index + 1), String::from);
    Ok(Antenna { diameter_m: positive(DIAMETER)?, sensitivity, ..Antenna::new(name, number, position_m) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ArrayLayout> {
        Spreadsheet.read(text, &ReadContext { name: "sheet".into(), ..ReadContext::default() })
    }

    #[test]
    fn columns_units_and_separators_are_those_of_the_head_line() {
        let layout = read("\u{feff}\"Name\",Y_mm,x_mm,diameter_cm,tsys_k\nleft one,0,-12.5,1,500\n\nright,250,12.5,,\n").unwrap();
        let [a, b] = layout.antennas() else { panic!("{layout:?}") };
        assert_eq!((layout.frame, layout.name.as_str(), a.name.as_str()), (LayoutFrame::Boresight, "sheet", "left one"));
        assert!((a.position_m[0] + 0.0125).abs() < 1e-15 && (b.position_m[1] - 0.25).abs() < 1e-15 && b.position_m[2] == 0.0);
        assert_eq!((a.diameter_m, a.sensitivity), (Some(0.01), Some(Sensitivity::TsysK(500.0))));
        assert_eq!((b.diameter_m, b.sensitivity), (None, None));
        let same = read("x y\n0 1\n2 3\n").unwrap();
        assert_eq!(same.antennas()[1].position_m, [2.0, 3.0, 0.0]);
        assert_eq!(same.antennas()[1].name, "A02");
        assert_eq!(read("x;y\n0;1\n2;3\n").unwrap().antennas()[1].position_m, [2.0, 3.0, 0.0]);
    }

    #[test]
    fn bad_tables_name_their_line() {
        for (text, words) in [
            ("x_m,y_m,color\n0,0,red\n", "line 1"),
            ("x_m,x_mm,y_m\n0,0,0\n", "each column once"),
            ("x_ft,y_ft\n0,0\n", "line 1"),
            ("x,y\n0,0\n1,\n", "line 3"),
            ("x,y\n0,0\n1,NaN\n", "line 3"),
            ("x,y,diameter\n0,0,-1\n1,1,1\n", "line 2"),
            ("x,y,tsys_k,sefd_jy\n0,0,1,1\n", "not both"),
            ("x,y,number\n0,0,-3\n", "line 2"),
            ("x,y\n0,0\n0,0\n", "same place"),
        ] {
            let said = read(text).unwrap_err().to_string();
            assert!(said.contains(words), "{text:?}: {said}");
        }
    }
}
