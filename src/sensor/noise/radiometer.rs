//! Kinds of radiometers: how much more noise they have than a perfect one.

use crate::values::by_text;
use std::fmt;
use std::str::FromStr;

/// One row of the table of radiometers.
#[derive(Debug, Clone, Copy)]
pub struct RadiometerKind {
    /// Its name.
    pub name: &'static str,
    /// Noise over that of a total-power radiometer.
    pub factor: f64,
    /// What it is.
    pub about: &'static str,
}

/// All kinds.
pub const RADIOMETERS: &[RadiometerKind] = &[
    RadiometerKind { name: "total-power", factor: 1.0, about: "looks at the scene all the time" },
    RadiometerKind { name: "dicke", factor: 2.0, about: "looks at a load for half of the time and takes the difference" },
    RadiometerKind {
        name: "correlation",
        factor: std::f64::consts::SQRT_2,
        about: "correlates two receivers, or receives scene and load in both",
    },
];

/// A kind of radiometer by its name.
#[derive(Debug, Clone, Copy)]
pub struct Radiometer(&'static RadiometerKind);
by_text!(Radiometer, "string", "A kind of radiometer, such as \"dicke\".");

impl Radiometer {
    /// Noise over that of a total-power radiometer.
    #[must_use]
    pub fn factor(self) -> f64 {
        self.0.factor
    }
}

impl Default for Radiometer {
    fn default() -> Self {
        Self(&RADIOMETERS[0])
    }
}

impl PartialEq for Radiometer {
    fn eq(&self, other: &Self) -> bool {
        self.0.name == other.0.name
    }
}

impl fmt::Display for Radiometer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}

impl FromStr for Radiometer {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let kind = RADIOMETERS.iter().find(|kind| kind.name == text.trim());
        let known = || RADIOMETERS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
        kind.map(Self).ok_or_else(|| format!("there is no radiometer {text:?}; the kinds are {}", known()))
    }
}
