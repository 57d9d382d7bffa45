//! Properties of an observation that are only carried: cards of the primary header, the direction of the feeds, and mounts.

use crate::fits::{Header, HeaderWriter, Value, table::Table};
use cittert_arrays::{Annotations, Keyword, VisibilityHeader, XOrientation};

/// Mounts by their code in MNTSTA; the last one is a code of pyuvdata.
const MOUNTS: [&str; 8] = ["alt-az", "equatorial", "orbiting", "x-y", "alt-az+nasmyth-r", "alt-az+nasmyth-l", "phased", "fixed"];
/// Beginnings of the keywords that describe the file or that other parts of the header hold.
const STRUCTURE: [&str; 24] = [
    "SIMPLE", "BITPIX", "NAXIS", "EXTEND", "GROUPS", "PCOUNT", "GCOUNT", "BSCALE", "BZERO", "BLOCKED", "PTYPE", "PSCAL", "PZERO", "CTYPE",
    "CRVAL", "CRPIX", "CDELT", "CROTA", "CUNIT", "COMMENT", "HISTORY", "RADESYS", "CHECKSUM", "DATASUM",
];
/// Further keywords with a place of their own in memory.
const READ: [&str; 24] = [
    "BUNIT", "OBJECT", "TELESCOP", "INSTRUME", "DATE-OBS", "EPOCH", "PHSFRAME", "OBSRA", "OBSDEC", "LAT", "LON", "ALT", "POLCONV",
    "XORIENT", "BLTORDER", "CITPEDST", "CITSCPED", "CITSCWID", "CITPATT", "CITTANT", "CITRANGE", "CITFOCL", "CITFOCM", "CITFOCR",
];
/// Who wrote the file. Every writer puts its own name there.
const ORIGIN: &str = "ORIGIN";
/// Longest text of a card.
const LONGEST: usize = 68;

fn has_its_own_place(key: &str) -> bool {
    STRUCTURE.iter().any(|start| key.starts_with(start)) || READ.contains(&key) || key == ORIGIN || key == "END" || key.is_empty()
}

/// The cards and mounts of a file.
pub(super) fn read(primary: &Header, an: &Table) -> Annotations {
    let mut found = Annotations::default();
    for (key, value) in primary.all().filter(|(key, _)| !has_its_own_place(key)) {
        let value = match value {
            Value::Logical(v) => Keyword::Logical(*v),
            Value::Integer(v) => Keyword::Integer(*v),
            Value::Real(v) => Keyword::Real(*v),
            Value::Text(v) => Keyword::Text(v.trim_end().into()),
            Value::None => Keyword::Empty,
        };
        found.keywords.entry(key.into()).or_insert(value);
    }
    found.x_orientation = primary.text("XORIENT").and_then(XOrientation::named);
    let mount = |row: usize| an.real(row, "MNTSTA").and_then(|code| MOUNTS.get(code as usize)).map(ToString::to_string);
    found.mounts = (0..an.rows()).map(mount).collect::<Option<Vec<_>>>().unwrap_or_default();
    found
}

/// The code of the mount of an antenna; 0 where it is not known.
pub(super) fn mount_code(header: &VisibilityHeader, antenna: usize) -> f64 {
    let mount = header.annotations.mounts.get(antenna).filter(|_| !header.is_boresight());
    mount.and_then(|name| MOUNTS.iter().position(|m| m.eq_ignore_ascii_case(name))).unwrap_or(0) as f64
}

/// Write the keywords that fit into cards.
pub(super) fn write(h: &mut HeaderWriter, annotations: &Annotations) {
    if let Some(orientation) = annotations.x_orientation {
        h.text("XORIENT", orientation.name(), "direction of the X feeds");
    }
    for (key, value) in annotations.keywords.iter().filter(|(key, value)| why_not(key, value).is_none()) {
        let key = key.to_ascii_uppercase();
        match value {
            Keyword::Text(text) => h.text(&key, text, ""),
            Keyword::Integer(number) => h.integer(&key, *number, ""),
            Keyword::Real(number) => h.real(&key, *number, ""),
            Keyword::Logical(value) => h.logical(&key, *value, ""),
            Keyword::Empty => {}
        }
    }
}

/// Why a keyword cannot be a card.
fn why_not(key: &str, value: &Keyword) -> Option<&'static str> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    let unfit = |text: &str| !text.chars().all(|c| (' '..='~').contains(&c));
    match value {
        _ if key.is_empty() || key.chars().count() > 8 || !key.chars().all(plain) => {
            Some("a FITS keyword has at most 8 letters, digits, hyphens and underscores")
        }
        _ if has_its_own_place(&key.to_ascii_uppercase()) => Some("this keyword has a meaning of its own in UVFITS"),
        Keyword::Text(text) if text.len() + text.matches('\'').count() > LONGEST => Some("a FITS card holds 68 characters"),
        Keyword::Text(text) if unfit(text) => Some("a FITS card holds ASCII alone"),
        Keyword::Real(number) if !number.is_finite() => Some("a FITS card holds finite numbers alone"),
        Keyword::Empty => Some("a FITS card needs a value"),
        _ => None,
    }
}

/// Keywords that cannot be cards, with the reason. They become lines of the history.
pub(super) fn lost_keywords(annotations: &Annotations) -> Vec<(String, String)> {
    let lost = |(key, value): (&String, &Keyword)| {
        why_not(key, value).map(|why| {
            (
                format!("keyword {key} ({why}: kept as a line of the history)"),
                format!("keyword {key} = {}", value.to_string().replace('\n', " ")),
            )
        })
    };
    annotations.keywords.iter().filter_map(lost).collect()
}

/// Mounts without a code, one of each.
pub(super) fn lost_mounts(header: &VisibilityHeader) -> Vec<String> {
    let mut names: Vec<&str> = header.annotations.mounts.iter().map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    names.retain(|name| !MOUNTS.iter().any(|m| m.eq_ignore_ascii_case(name)) && !header.is_boresight());
    names.into_iter().map(str::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_that_do_not_fit_are_named_with_the_reason() {
        let mut a = Annotations::default();
        for (key, value) in [
            ("foo", Keyword::Integer(3)),
            ("much_too_long", Keyword::Real(0.5)),
            ("object", Keyword::Text("x".into())),
            ("long", Keyword::Text("x".repeat(69))),
            ("nothing", Keyword::Empty),
        ] {
            a.keywords.insert(key.into(), value);
        }
        let lost = lost_keywords(&a);
        let names: Vec<&str> = lost.iter().map(|l| l.0.split(' ').nth(1).unwrap_or("")).collect();
        assert_eq!(names, ["long", "much_too_long", "nothing", "object"]);
        assert_eq!(lost[1].1, "keyword much_too_long = 0.5");
        let mut h = HeaderWriter::default();
        write(&mut h, &a);
        assert_eq!(String::from_utf8(h.cards()).unwrap().trim_end(), "FOO     =                    3");
    }
}
