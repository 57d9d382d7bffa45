//! Polarisation products and their AIPS numbers.

use crate::as_text::as_text;
use crate::{ArrayError, Result};
use std::fmt;
use std::str::FromStr;

/// One polarisation product of a visibility, or a Stokes parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Polarization {
    /// Total intensity.
    I,
    /// Stokes Q.
    Q,
    /// Stokes U.
    U,
    /// Stokes V.
    V,
    /// Right with right circular.
    RR,
    /// Left with left circular.
    LL,
    /// Right with left circular.
    RL,
    /// Left with right circular.
    LR,
    /// X with X linear.
    XX,
    /// Y with Y linear.
    YY,
    /// X with Y linear.
    XY,
    /// Y with X linear.
    YX,
}

/// Product, AIPS number (AIPS Memo 117, table 1) and name, in the order of the enumeration.
const TABLE: [(Polarization, i32, &str); 12] = [
    (Polarization::I, 1, "I"),
    (Polarization::Q, 2, "Q"),
    (Polarization::U, 3, "U"),
    (Polarization::V, 4, "V"),
    (Polarization::RR, -1, "RR"),
    (Polarization::LL, -2, "LL"),
    (Polarization::RL, -3, "RL"),
    (Polarization::LR, -4, "LR"),
    (Polarization::XX, -5, "XX"),
    (Polarization::YY, -6, "YY"),
    (Polarization::XY, -7, "XY"),
    (Polarization::YX, -8, "YX"),
];

impl Polarization {
    /// The AIPS number: 1..4 for Stokes, -1..-8 for correlations.
    #[must_use]
    pub fn aips(self) -> i32 {
        TABLE[self as usize].1
    }

    /// From the AIPS number.
    ///
    /// # Errors
    /// A number that is not in -8..-1 or 1..4.
    pub fn from_aips(number: i32) -> Result<Self> {
        TABLE
            .iter()
            .find(|t| t.1 == number)
            .map(|t| t.0)
            .ok_or_else(|| ArrayError::bad_value("polarisation number", number, "1..4 (I Q U V) or -1..-8 (RR LL RL LR XX YY XY YX)"))
    }

    /// The name, such as `RR`.
    #[must_use]
    pub fn name(self) -> &'static str {
        TABLE[self as usize].2
    }

    /// True for the products RR, LL, XX and YY. For an unpolarised source their expected value is Stokes I.
    #[must_use]
    pub fn is_parallel_hand(self) -> bool {
        matches!(self, Self::RR | Self::LL | Self::XX | Self::YY)
    }

    /// Name of a gain that is common to all products of a list: `R+L`, `X+Y`, or `I` for Stokes parameters.
    #[must_use]
    pub fn shared_feed(products: &[Self]) -> &'static str {
        match products.iter().find(|p| p.feeds().is_some()).map(|p| p.name().as_bytes()[0]) {
            Some(b'R' | b'L') => "R+L",
            Some(_) => "X+Y",
            None => "I",
        }
    }

    /// Index of the feed (0 or 1) on the first and second antenna; `None` for Stokes parameters.
    #[must_use]
    pub fn feeds(self) -> Option<(usize, usize)> {
        match self {
            Self::RR | Self::XX => Some((0, 0)),
            Self::LL | Self::YY => Some((1, 1)),
            Self::RL | Self::XY => Some((0, 1)),
            Self::LR | Self::YX => Some((1, 0)),
            _ => None,
        }
    }
}

impl fmt::Display for Polarization {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Polarization {
    type Err = ArrayError;
    fn from_str(text: &str) -> Result<Self> {
        TABLE
            .iter()
            .find(|t| t.2.eq_ignore_ascii_case(text))
            .map(|t| t.0)
            .ok_or_else(|| ArrayError::bad_value("polarisation", text, "one of I, Q, U, V, RR, LL, RL, LR, XX, YY, XY, YX"))
    }
}

as_text!(Polarization, "A Stokes parameter or a product of two feeds.".into(), TABLE.map(|t| t.2));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serde_takes_the_name() {
        let text = toml::Value::try_from(Polarization::RR).unwrap();
        assert_eq!(text.as_str(), Some("RR"));
        assert_eq!(text.try_into::<Polarization>().unwrap(), Polarization::RR);
        assert!(toml::Value::from("ZZ").try_into::<Polarization>().is_err());
    }

    #[test]
    fn numbers_and_names_go_both_ways() {
        for (p, n, name) in TABLE {
            assert_eq!(Polarization::from_aips(n).unwrap(), p);
            assert_eq!(name.parse::<Polarization>().unwrap(), p);
            assert_eq!(p.aips(), n);
        }
        assert!(Polarization::from_aips(0).is_err());
        assert!("ZZ".parse::<Polarization>().is_err());
    }
}
