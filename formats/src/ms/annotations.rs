//! Properties of an observation that are only carried: extra keywords, as pyuvdata stores them, and the direction of the feeds.

use super::keywords::Place;
use super::parts;
use super::table::{Kind, Table};
use crate::Result;
use cittert_arrays::{Annotations, Keyword, XOrientation};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Record of the extra keywords.
pub(super) const KEYWORDS: &str = "pyuvdata_extra";
/// Keyword of the direction of the X feeds.
pub(super) const ORIENTATION: &str = "pyuvdata_xorient";
/// Keyword of FEED, true where pyuvdata knew the feeds.
const HAS_FEED: &str = "pyuvdata_has_feed";
/// Columns of OBSERVATION and the keywords for them.
pub(super) const OF_OBSERVATION: [(&str, &str); 2] = [("OBSERVER", "observer"), ("PROJECT", "project")];
/// Largest difference of the angle of a feed, rad.
const FEED_TOLERANCE_RAD: f64 = 1e-6;

/// Keywords and direction of the feeds of a set.
pub(super) fn read(ms: &Path, main: &Table) -> Result<Annotations> {
    let mut found = Annotations::default();
    for (letter, key) in main.keyword_names(Some(KEYWORDS))? {
        let place = Place::record(KEYWORDS, &key);
        let number = main.keyword_number(place, 0)?.unwrap_or(0.0);
        let value = match letter {
            'b' => Keyword::Logical(number != 0.0),
            'i' => Keyword::Integer(number as i64),
            'f' => Keyword::Real(number),
            's' => Keyword::Text(main.keyword_text(place, 0)?.unwrap_or_default()),
            _ => continue,
        };
        found.keywords.insert(key, value);
    }
    let (observation, rows) = parts::open(ms, "OBSERVATION")?;
    for (column, key) in OF_OBSERVATION {
        if rows > 0 && observation.column_ndim(column, Kind::String)? == Some(-1) {
            found.add_text(key, &observation.get_text(column, 0, 0)?);
        }
    }
    let stated = main.keyword_text(Place::table(ORIENTATION), 0)?.and_then(|name| XOrientation::named(&name));
    found.x_orientation = if stated.is_some() { stated } else { of_feeds(ms)? };
    Ok(found)
}

/// The direction of the X feeds in FEED, if the writer knew it and it is the same for all rows. CASA fills FEED also where nothing is known.
fn of_feeds(ms: &Path) -> Result<Option<XOrientation>> {
    if !ms.join("FEED/table.dat").is_file() {
        return Ok(None);
    }
    let (feed, rows) = parts::open(ms, "FEED")?;
    if rows == 0 || feed.keyword_number(Place::table(HAS_FEED), 0)?.is_none_or(|known| known == 0.0) {
        return Ok(None);
    }
    let mut all = None;
    for row in 0..rows {
        let (_, angles) = feed.array::<f64>("RECEPTOR_ANGLE", row)?;
        let mut found = None;
        for (k, angle) in angles.iter().enumerate() {
            let name = feed.get_text("POLARIZATION_TYPE", row, k)?;
            let is = |wanted: f64| (angle - wanted).abs() < FEED_TOLERANCE_RAD;
            let this = match name.to_ascii_uppercase().as_str() {
                "X" if is(FRAC_PI_2) => XOrientation::East,
                "Y" if is(0.0) => XOrientation::East,
                "X" if is(0.0) => XOrientation::North,
                "Y" if is(FRAC_PI_2) => XOrientation::North,
                _ => return Ok(None),
            };
            if found.is_some_and(|f| f != this) {
                return Ok(None);
            }
            found = Some(this);
        }
        if all.is_some() && all != found {
            return Ok(None);
        }
        all = found;
    }
    Ok(all)
}

/// Write the keywords and the direction of the feeds.
pub(super) fn write(main: &mut Table, annotations: &Annotations) -> Result<()> {
    for (key, value) in annotations.keywords.iter().filter(|(key, _)| !in_observation(key)) {
        let place = Place::record(KEYWORDS, key);
        match value {
            Keyword::Text(text) => main.put_keyword_text(place, &[&text.replace('\0', "")], true)?,
            Keyword::Integer(number) => match i32::try_from(*number) {
                Ok(number) => main.put_keyword_value(place, number)?,
                Err(_) => main.put_keyword_value(place, *number as f64)?,
            },
            Keyword::Real(number) => main.put_keyword_value(place, *number)?,
            Keyword::Logical(value) => main.put_keyword_value(place, *value)?,
            Keyword::Empty => {}
        }
    }
    match annotations.x_orientation {
        Some(orientation) => main.put_keyword_text(Place::table(ORIENTATION), &[orientation.name()], true),
        None => Ok(()),
    }
}

/// Whether a keyword of the main table is one of those that pyuvdata has for what is read here.
pub(super) fn is_own(key: &str) -> bool {
    [KEYWORDS, ORIENTATION, "pyuvdata_polconv", "pyuvdata_flip_conj"].contains(&key)
}

/// What cannot be written of these.
pub(super) fn lost(annotations: &Annotations) -> Vec<String> {
    let empty = annotations.keywords.iter().filter(|(key, value)| !in_observation(key) && **value == Keyword::Empty);
    empty.map(|(key, _)| format!("keyword {key} (a keyword of casacore needs a value)")).collect()
}

/// Whether OBSERVATION has a column for a keyword.
fn in_observation(key: &str) -> bool {
    OF_OBSERVATION.iter().any(|(column, _)| key.eq_ignore_ascii_case(column))
}
