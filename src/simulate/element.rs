//! The kind of the power pattern of each element, as options name it.

use crate::values::by_text;
use std::fmt;
use std::str::FromStr;

/// Kind of the power pattern of each element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Element {
    /// The pattern that the layout states, or none.
    Layout,
    /// 1 everywhere in front of the array.
    None,
    /// A uniformly lit circular aperture.
    Airy,
    /// A Gaussian.
    Gaussian,
    /// cos(theta) to this power.
    CosPower(f64),
}
by_text!(Element, "string", "layout, none, airy, gaussian, or cos^N such as \"cos^2\".");

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Layout => f.write_str("layout"),
            Self::None => f.write_str("none"),
            Self::Airy => f.write_str("airy"),
            Self::Gaussian => f.write_str("gaussian"),
            Self::CosPower(n) => write!(f, "cos^{n}"),
        }
    }
}

impl FromStr for Element {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "layout" => Ok(Self::Layout),
            "none" => Ok(Self::None),
            "airy" => Ok(Self::Airy),
            "gaussian" => Ok(Self::Gaussian),
            _ => match text.strip_prefix("cos^").and_then(|n| n.parse().ok()) {
                Some(n) => Ok(Self::CosPower(n)),
                None => Err(format!("{text:?} is not an element: use layout, none, airy, gaussian or cos^N such as cos^2")),
            },
        }
    }
}
