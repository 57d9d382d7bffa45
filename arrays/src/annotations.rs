//! Properties of an observation that no step of the chain uses. They are carried from file to file.

use crate::as_text::as_text;
use crate::{ArrayError, Result};
use std::collections::BTreeMap;

/// The value of a keyword.
#[derive(Debug, Clone, PartialEq)]
pub enum Keyword {
    /// A text.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// Any other number.
    Real(f64),
    /// True or false.
    Logical(bool),
    /// A keyword without a value.
    Empty,
}

impl std::fmt::Display for Keyword {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Integer(number) => write!(f, "{number}"),
            Self::Real(number) => write!(f, "{number:?}"),
            Self::Logical(value) => f.write_str(if *value { "T" } else { "F" }),
            Self::Empty => Ok(()),
        }
    }
}

/// Direction on the sky of the X feeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum XOrientation {
    /// X is east-west, Y is north-south.
    East,
    /// X is north-south, Y is east-west.
    North,
}

impl XOrientation {
    /// Name as in UVH5.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::East => "east",
            Self::North => "north",
        }
    }

    /// The orientation with this name; old files have `e` and `n`, and names of other letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name.trim().to_ascii_lowercase().as_str() {
            "east" | "e" | "ew" | "east-west" => Some(Self::East),
            "north" | "n" | "ns" | "north-south" => Some(Self::North),
            _ => None,
        }
    }
}

impl std::fmt::Display for XOrientation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for XOrientation {
    type Err = ArrayError;

    fn from_str(text: &str) -> Result<Self> {
        Self::named(text).ok_or_else(|| ArrayError::bad_value("direction of the X feeds", text, "north or east"))
    }
}

as_text!(XOrientation, "Direction on the sky of the X feeds.".into(), ["north", "east"]);

/// What is known about an observation beside its visibilities.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Annotations {
    /// Keywords by their names, such as observer and project.
    pub keywords: BTreeMap<String, Keyword>,
    /// Direction of the X feeds, where it is known.
    pub x_orientation: Option<XOrientation>,
    /// Mount of each antenna, such as `alt-az` or `fixed`; empty where it is not known.
    pub mounts: Vec<String>,
    /// Name of the station (pad) of each antenna, where it is not the name of the antenna; otherwise empty.
    pub stations: Vec<String>,
}

impl Annotations {
    /// The text of a keyword, in letters of any case.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<&str> {
        self.keywords.iter().find_map(|(k, value)| match value {
            Keyword::Text(text) if k.eq_ignore_ascii_case(key) => Some(text.as_str()),
            _ => None,
        })
    }

    /// Add a text that a file states, unless it is blank or a keyword of that name is there.
    pub fn add_text(&mut self, key: &str, text: &str) {
        if !text.trim().is_empty() && !self.keywords.keys().any(|k| k.eq_ignore_ascii_case(key)) {
            self.keywords.insert(key.into(), Keyword::Text(text.trim_end().into()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_are_found_in_letters_of_any_case() {
        let mut a = Annotations::default();
        a.add_text("observer", "me ");
        a.add_text("OBSERVER", "you");
        a.add_text("project", " ");
        assert_eq!((a.text("Observer"), a.text("project"), a.keywords.len()), (Some("me"), None, 1));
    }

    #[test]
    fn values_are_shown_with_all_their_digits() {
        let shown = [Keyword::Real(2.0), Keyword::Integer(2), Keyword::Logical(true), Keyword::Text("a b".into()), Keyword::Empty];
        assert_eq!(shown.map(|k| k.to_string()), ["2.0", "2", "T", "a b", ""]);
        assert!([XOrientation::East, XOrientation::North].into_iter().all(|x| XOrientation::named(x.name()) == Some(x)));
        assert_eq!(XOrientation::named("NORTH"), Some(XOrientation::North));
    }
}
