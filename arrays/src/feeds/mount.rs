//! Kinds of mounts.

use crate::as_text::as_text;
use crate::{ArrayError, Result};
use std::fmt;
use std::str::FromStr;

/// How an antenna is mounted, and therefore how its feeds turn on the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// Azimuth and elevation: the feeds turn with the parallactic angle.
    AltAz,
    /// Azimuth and elevation with the receivers at the right Nasmyth focus: parallactic angle plus elevation.
    NasmythRight,
    /// Azimuth and elevation with the receivers at the left Nasmyth focus: parallactic angle minus elevation.
    NasmythLeft,
    /// Polar axis: the feeds keep their angle on the sky.
    Equatorial,
    /// Elements that do not move. Above the ground the X feed points north at the zenith and is carried along great circles to other directions.
    Fixed,
}

/// Each kind with its name in files.
const TABLE: [(Mount, &str); 5] = [
    (Mount::AltAz, "alt-az"),
    (Mount::NasmythRight, "alt-az+nasmyth-r"),
    (Mount::NasmythLeft, "alt-az+nasmyth-l"),
    (Mount::Equatorial, "equatorial"),
    (Mount::Fixed, "fixed"),
];

impl Mount {
    /// Its name, as in `mount_type` of UVH5.
    #[must_use]
    pub fn name(self) -> &'static str {
        TABLE[self as usize].1
    }

    /// The kind of that name, in letters of any case.
    ///
    /// # Errors
    /// Another name.
    pub fn named(name: &str) -> Result<Self> {
        let known = TABLE.iter().find(|t| t.1.eq_ignore_ascii_case(name.trim()));
        known
            .map(|t| t.0)
            .ok_or_else(|| ArrayError::bad_value("mount", name, "alt-az, alt-az+nasmyth-r, alt-az+nasmyth-l, equatorial or fixed"))
    }

    /// True where the feeds turn on the sky.
    #[must_use]
    pub fn turns(self) -> bool {
        self != Self::Equatorial
    }
}

impl fmt::Display for Mount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Mount {
    type Err = ArrayError;

    fn from_str(text: &str) -> Result<Self> {
        Self::named(text)
    }
}

as_text!(Mount, "Mount of the antennas, with which their feeds turn.".into(), TABLE.map(|t| t.1));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_both_ways() {
        for (mount, name) in TABLE {
            assert_eq!((Mount::named(&name.to_uppercase()).unwrap(), mount.name()), (mount, name));
        }
        assert!(Mount::named("orbiting").unwrap_err().to_string().contains("equatorial"));
    }
}
