//! Numbers with units, as people type them: `94GHz`, `1.2m`, `30arcsec`, `290K`, `10s`.
//!
//! Each dimension is a table of unit names and factors to SI. A bare number is refused where a unit is
//! due, with the list of the units accepted.

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Why a text is not the quantity that was asked for.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum QuantityError {
    /// The number has no unit.
    #[error("{text:?} has no unit: write a {dimension} with one of {units}")]
    NoUnit {
        /// The text.
        text: String,
        /// What was expected.
        dimension: &'static str,
        /// Accepted units.
        units: String,
    },
    /// The unit is not one of this dimension.
    #[error("{unit:?} in {text:?} is not a unit of {dimension}: use one of {units}")]
    BadUnit {
        /// The text.
        text: String,
        /// The unit found.
        unit: String,
        /// What was expected.
        dimension: &'static str,
        /// Accepted units.
        units: String,
    },
    /// There is no number before the unit.
    #[error("{text:?} does not start with a finite number (expected a {dimension} such as {example})")]
    NoNumber {
        /// The text.
        text: String,
        /// What was expected.
        dimension: &'static str,
        /// A good example.
        example: &'static str,
    },
}

/// Unit names with their factor to SI; the first is the one used in print.
type Units = &'static [(&'static str, f64)];

fn parse(text: &str, dimension: &'static str, units: Units, example: &'static str) -> Result<f64, QuantityError> {
    let text = text.trim();
    let bytes = text.as_bytes();
    // The number ends at the first character that cannot continue it; an `e` belongs to the number only before a digit or sign.
    let mut end = 0;
    while end < bytes.len() {
        let c = bytes[end];
        let exponent = (c == b'e' || c == b'E')
            && end > 0
            && bytes
                .get(end + 1)
                .is_some_and(|n| n.is_ascii_digit() || ((*n == b'-' || *n == b'+') && bytes.get(end + 2).is_some_and(u8::is_ascii_digit)));
        let sign = (c == b'+' || c == b'-') && (end == 0 || matches!(bytes[end - 1], b'e' | b'E'));
        if c.is_ascii_digit() || c == b'.' || exponent || sign {
            end += 1;
        } else {
            break;
        }
    }
    let names = || units.iter().map(|u| u.0).collect::<Vec<_>>().join(", ");
    let value = f64::from_str(&text[..end]).ok().filter(|v| v.is_finite()).ok_or_else(|| QuantityError::NoNumber {
        text: text.into(),
        dimension,
        example,
    })?;
    let unit = text[end..].trim();
    if unit.is_empty() {
        return Err(QuantityError::NoUnit { text: text.into(), dimension, units: names() });
    }
    match units.iter().find(|u| u.0 == unit) {
        Some((_, factor)) => Ok(value * factor),
        None => Err(QuantityError::BadUnit { text: text.into(), unit: unit.into(), dimension, units: names() }),
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $si:literal, $dimension:literal, $example:literal, $units:expr) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
        pub struct $name(pub f64);

        impl $name {
            const UNITS: Units = $units;

            /// The value in SI units.
            #[must_use]
            pub fn si(self) -> f64 {
                self.0
            }
        }

        impl FromStr for $name {
            type Err = QuantityError;
            fn from_str(text: &str) -> Result<Self, QuantityError> {
                parse(text, $dimension, Self::UNITS, $example).map(Self)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                // The unit that leaves the smallest number of at least 1 reads best.
                let best = Self::UNITS
                    .iter()
                    .filter(|u| self.0.abs() >= u.1 * 0.999_999_999)
                    .max_by(|a, b| a.1.total_cmp(&b.1))
                    .unwrap_or(&Self::UNITS[0]);
                let shown = self.0 / best.1;
                let rounded = (shown * 1e9).round() / 1e9;
                write!(f, "{rounded}{}", best.0)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                let text = String::deserialize(d)?;
                text.parse().map_err(serde::de::Error::custom)
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                s.collect_str(&format_args!("{}{}", self.0, $si))
            }
        }
    };
}

quantity!(
    /// A frequency in Hz.
    Frequency, "Hz", "frequency", "94GHz", &[("Hz", 1.0), ("kHz", 1e3), ("MHz", 1e6), ("GHz", 1e9), ("THz", 1e12)]
);
quantity!(
    /// A length in metres.
    Length, "m", "length", "1.2m", &[("m", 1.0), ("km", 1e3), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)]
);
quantity!(
    /// A plane angle in radians.
    Angle, "rad", "angle", "30arcsec",
    &[
        ("rad", 1.0),
        ("mrad", 1e-3),
        ("deg", std::f64::consts::PI / 180.0),
        ("arcmin", std::f64::consts::PI / 180.0 / 60.0),
        ("arcsec", std::f64::consts::PI / 180.0 / 3600.0),
        ("mas", std::f64::consts::PI / 180.0 / 3600e3),
        ("uas", std::f64::consts::PI / 180.0 / 3600e6),
    ]
);
quantity!(
    /// A temperature in kelvin.
    Temperature, "K", "temperature", "290K", &[("K", 1.0), ("mK", 1e-3)]
);
quantity!(
    /// A time span in seconds.
    Duration, "s", "time", "10s", &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("ps", 1e-12), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)]
);
quantity!(
    /// A flux density in Jy.
    FluxDensity, "Jy", "flux density", "1Jy", &[("Jy", 1.0), ("mJy", 1e-3), ("uJy", 1e-6), ("kJy", 1e3)]
);
quantity!(
    /// A pressure in Pa.
    Pressure, "Pa", "pressure", "1013hPa", &[("Pa", 1.0), ("hPa", 1e2), ("kPa", 1e3), ("mbar", 1e2), ("bar", 1e5)]
);
quantity!(
    /// A density in kg/m3, of a solid as of water in air.
    Density, "kg/m3", "density", "7.5g/m3", &[("kg/m3", 1.0), ("g/m3", 1e-3), ("mg/m3", 1e-6), ("g/cm3", 1e3)]
);
quantity!(
    /// A rain rate in m/s, as a depth of water in a time.
    RainRate, "m/s", "rain rate", "5mm/h", &[("m/s", 1.0), ("mm/h", 1e-3 / 3600.0)]
);
quantity!(
    /// A share of a whole, in percent.
    Percent, "%", "share", "50%", &[("%", 1.0)]
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_units_and_exponents() {
        assert_eq!("94GHz".parse::<Frequency>().unwrap().si(), 94e9);
        assert_eq!("1.5e2 MHz".parse::<Frequency>().unwrap().si(), 150e6);
        assert_eq!("-30arcsec".parse::<Angle>().unwrap().si(), -30.0 * std::f64::consts::PI / 648_000.0);
        assert_eq!("1e-3m".parse::<Length>().unwrap().si(), 1e-3);
    }

    #[test]
    fn a_bare_number_names_the_units() {
        let e = "94".parse::<Frequency>().unwrap_err().to_string();
        assert!(e.contains("GHz") && e.contains("no unit"), "{e}");
        assert!("GHz".parse::<Frequency>().is_err());
        assert!("94Gz".parse::<Frequency>().is_err());
        assert!("nanGHz".parse::<Frequency>().is_err());
        assert!("1e999Hz".parse::<Frequency>().is_err());
    }

    #[test]
    fn weather_has_its_units() {
        assert_eq!("1013hPa".parse::<Pressure>().unwrap().si(), 101_300.0);
        assert_eq!("101.3kPa".parse::<Pressure>().unwrap().si(), 101_300.0);
        assert_eq!("7.5g/m3".parse::<Density>().unwrap().si(), 7.5e-3);
        assert!((0.25 - "0.25g/cm3".parse::<Density>().unwrap().si() / 1e3).abs() < 1e-15);
        assert!(("5mm/h".parse::<RainRate>().unwrap().si() * 3.6e6 - 5.0).abs() < 1e-14);
        assert_eq!("46%".parse::<Percent>().unwrap().si(), 46.0);
        let e = "7.5".parse::<Density>().unwrap_err().to_string();
        assert!(e.contains("g/m3"), "{e}");
    }

    #[test]
    fn display_picks_a_readable_unit() {
        assert_eq!(Frequency(94e9).to_string(), "94GHz");
        assert_eq!(Duration(90.0).to_string(), "1.5min");
    }
}
