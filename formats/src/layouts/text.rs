//! Helpers of the column formats: lines of fields, `# key = value` comments, numbers.

use super::error::{LayoutError, ReadContext, Result};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Site};
use std::fmt::Write;

/// A line that is not empty, split into fields.
pub(super) struct Line<'a> {
    /// From 1.
    pub number: usize,
    pub fields: Vec<&'a str>,
}

/// Lines with fields separated by blanks, tabs or commas; `#` begins a comment.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.lines().enumerate().filter_map(|(i, line)| {
        let line = line.split('#').next().unwrap_or("");
        let fields: Vec<&str> = line.split([' ', '\t', ',', '\r']).filter(|f| !f.is_empty()).collect();
        (!fields.is_empty()).then_some(Line { number: i + 1, fields })
    })
}

/// The value and line of the last comment `# key = value`, the key in upper or lower case.
pub(super) fn comment<'a>(text: &'a str, key: &str) -> Option<(usize, &'a str)> {
    let found = text.lines().enumerate().filter_map(|(i, line)| {
        let (k, value) = line.trim_start().strip_prefix('#')?.split_once('=')?;
        k.trim_matches(['#', ' ', '\t']).eq_ignore_ascii_case(key).then(|| (i + 1, value.trim_matches(['#', ' ', '\t', '\r'])))
    });
    found.last()
}

/// A finite number.
pub(super) fn number(line: usize, text: &str, what: &str) -> Result<f64> {
    let parsed = text.parse::<f64>().ok().filter(|v| v.is_finite());
    parsed.ok_or_else(|| LayoutError::Line { line, expected: format!("{what}, a finite number"), found: text.into() })
}

impl Line<'_> {
    /// Field `i` as a finite number.
    pub(super) fn number(&self, i: usize, what: &str) -> Result<f64> {
        number(self.number, self.fields.get(i).copied().unwrap_or("the end of the line"), what)
    }

    /// An error that quotes the whole line.
    pub(super) fn expected(&self, expected: &str) -> LayoutError {
        LayoutError::Line { line: self.number, expected: expected.into(), found: self.fields.join(" ") }
    }

    /// True where all fields are numbers.
    pub(super) fn is_numeric(&self) -> bool {
        self.fields.iter().all(|f| f.parse::<f64>().is_ok())
    }
}

/// The site in comments `latitude_deg`, `longitude_deg`, `altitude_m`, as cittert writes them; `None` without such comments.
pub(super) fn commented_site(text: &str) -> Result<Option<Site>> {
    let value = |key: &str| comment(text, key).map(|(line, v)| number(line, v, key)).transpose();
    match (value("latitude_deg")?, value("longitude_deg")?, value("altitude_m")?) {
        (None, None, None) => Ok(None),
        (Some(lat), Some(lon), altitude_m) => {
            Ok(Some(Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m: altitude_m.unwrap_or(0.0) }))
        }
        _ => Err(LayoutError::Missing(
            "expected both '# latitude_deg = ' and '# longitude_deg = ' where there is one, found only one of them".into(),
        )),
    }
}

/// A layout in east, north, up at a site from the caller or from comments, or in the boresight frame where a comment says so.
pub(super) fn local_layout(text: &str, context: &ReadContext, antennas: Vec<Antenna>) -> Result<ArrayLayout> {
    let site = match context.site {
        Some(site) => Some(site),
        None => commented_site(text)?,
    };
    let boresight = comment(text, "frame").is_some_and(|(_, v)| v.eq_ignore_ascii_case("boresight"));
    let frame = match site {
        Some(site) => LayoutFrame::EastNorthUp(site),
        None if boresight => LayoutFrame::Boresight,
        None => {
            return Err(LayoutError::Missing(
                "expected a site, found none in the file: give one, or write '# latitude_deg = ', '# longitude_deg = ' and '# altitude_m = ' lines into it \
                 (or '# frame = boresight')"
                    .into(),
            ));
        }
    };
    let name = comment(text, "name").map_or(context.name.as_str(), |(_, n)| n);
    Ok(ArrayLayout::new(name, frame, antennas)?)
}

/// Comments that [`local_layout`] reads back.
pub(super) fn local_header(layout: &ArrayLayout) -> String {
    let mut t = format!("# name = {}\n", one_line(&layout.name));
    // Writing to a String cannot fail.
    let _ = match layout.site() {
        Some(s) => writeln!(
            t,
            "# latitude_deg = {:?}\n# longitude_deg = {:?}\n# altitude_m = {:?}",
            s.latitude_rad.to_degrees(),
            s.longitude_rad.to_degrees(),
            s.altitude_m
        ),
        None => writeln!(t, "# frame = boresight"),
    };
    t
}

/// A text without characters that would end a comment line.
pub(super) fn one_line(text: &str) -> String {
    text.replace(['\n', '\r', '#', '='], " ")
}

/// A name as one field of a column format.
pub(super) fn one_field(name: &str) -> String {
    name.split(|c: char| c.is_whitespace() || c == ',' || c == '#').collect::<Vec<_>>().join("_")
}

/// The properties of a layout that a format cannot hold.
pub(super) fn lost(layout: &ArrayLayout, keeps: Keeps) -> Vec<String> {
    let antennas = layout.antennas();
    let mut lost = Vec::new();
    let mut say = |yes: bool, what: &str| {
        if yes {
            lost.push(what.to_owned());
        }
    };
    say(!keeps.names, "the antenna names");
    say(keeps.names && antennas.iter().any(|a| one_field(&a.name) != a.name), "blanks, commas and # in antenna names (they become _)");
    say(!keeps.numbers && antennas.iter().enumerate().any(|(i, a)| a.number as usize != i), "the antenna numbers");
    say(!keeps.diameters && antennas.iter().any(|a| a.diameter_m.is_some()), "the diameters");
    say(!keeps.sensitivities && antennas.iter().any(|a| a.sensitivity.is_some()), "SEFD or Tsys");
    say(!keeps.errors && antennas.iter().any(|a| a.position_error_m.is_some()), "the position errors");
    say(layout.source.is_some(), "the source of the positions");
    say(layout.aperture_m.is_some(), "the aperture of the design");
    say(!layout.pattern.is_none(), "the pattern of the elements");
    say(!keeps.exact_site && layout.site().is_some(), "the site as a reference point (positions become geocentric)");
    say(keeps.exact_site && layout.site().is_none(), "the boresight frame for other programs (they take x, y, z for east, north, up)");
    lost
}

/// The properties that a format can hold.
#[derive(Clone, Copy, Default)]
pub(super) struct Keeps {
    pub names: bool,
    pub numbers: bool,
    pub diameters: bool,
    pub sensitivities: bool,
    pub errors: bool,
    pub exact_site: bool,
}
