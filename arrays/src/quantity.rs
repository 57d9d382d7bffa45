//! Numbers with units, as people type them: `94GHz`, `1.2m`, `30arcsec`, `290K`, `10s`.
//!
//! Each dimension is a table of unit names and their factors to SI. A number without a unit is refused; the error lists the accepted
//! units. A quantity is kept in SI units. It prints as a text that reads back as exactly the same value, and serde uses that text.

use crate::as_text::as_text;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Error of a text that is not a quantity of the expected dimension.
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
    /// The number is larger or smaller than any that this program can use.
    #[error("{text:?} is out of range: no {dimension} of that size can be used")]
    OutOfRange {
        /// The text.
        text: String,
        /// What was expected.
        dimension: &'static str,
    },
    /// There is no number before the unit.
    #[error("{text:?} does not start with a finite number (expected a {dimension} such as {example})")]
    NoNumber {
        /// The text.
        text: String,
        /// What was expected.
        dimension: &'static str,
        /// A valid example.
        example: &'static str,
    },
}

/// Largest number in SI units. Its square, and a thousand times its product with any number of this size, is finite in double precision, and it
/// fits into single precision, in which visibilities are kept.
const LARGEST: f64 = 1e30;
/// Smallest number in SI units that is not 0: the same holds for its square and for its inverse.
const SMALLEST: f64 = 1e-30;

/// Unit names with their factors to SI. The first is the SI unit, with the factor 1.
type Units = &'static [(&'static str, f64)];

fn names(units: Units) -> String {
    units.iter().map(|u| u.0).collect::<Vec<_>>().join(", ")
}

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
    let value = f64::from_str(&text[..end]).ok().filter(|v| v.is_finite()).ok_or_else(|| QuantityError::NoNumber {
        text: text.into(),
        dimension,
        example,
    })?;
    let unit = text[end..].trim();
    if unit.is_empty() {
        return Err(QuantityError::NoUnit { text: text.into(), dimension, units: names(units) });
    }
    match units.iter().find(|u| u.0 == unit) {
        Some((_, factor)) if value == 0.0 || (SMALLEST..=LARGEST).contains(&(value * factor).abs()) => Ok(value * factor),
        Some(_) => Err(QuantityError::OutOfRange { text: text.into(), dimension }),
        None => Err(QuantityError::BadUnit { text: text.into(), unit: unit.into(), dimension, units: names(units) }),
    }
}

/// Print a value, in SI, in the largest unit of which it is at least one.
///
/// Without a precision the text reads back as exactly `value`: it has up to nine decimals where these are enough, all digits where they
/// are not, and the SI unit where the factor of the other unit cannot give the value. With a precision (`{:.3}`) the number is rounded to
/// at most that many decimals, for reports.
fn print(value: f64, units: Units, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    // A value that rounding has left just below a whole unit still counts as one.
    let reached = units.iter().filter(|u| value.abs() >= u.1 * 0.999_999_999);
    let &(name, factor) = reached.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(&units[0]);
    let number = value / factor;
    let rounded = |decimals: usize| {
        let scale = 10_f64.powi(decimals.min(15) as i32);
        // A number too large to be scaled has no decimals.
        if (number * scale).is_finite() { (number * scale).round() / scale } else { number }
    };
    if let Some(decimals) = f.precision() {
        return write!(f, "{}{name}", rounded(decimals));
    }
    match [rounded(9), number].into_iter().find(|n| n * factor == value) {
        Some(exact) => write!(f, "{exact}{name}"),
        None => write!(f, "{value}{}", units[0].0),
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $dimension:literal, $example:literal, $units:expr) => {
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
                print(self.0, Self::UNITS, f)
            }
        }

        as_text!($name, format!("A {} with its unit, such as {}. Units: {}.", $dimension, $example, names(Self::UNITS)), [$example]);
    };
}

quantity!(
    /// A frequency in Hz.
    Frequency, "frequency", "94GHz", &[("Hz", 1.0), ("kHz", 1e3), ("MHz", 1e6), ("GHz", 1e9), ("THz", 1e12)]
);
quantity!(
    /// A length in metres.
    Length, "length", "1.2m", &[("m", 1.0), ("km", 1e3), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)]
);
quantity!(
    /// A plane angle in radians.
    Angle, "angle", "30arcsec",
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
    Temperature, "temperature", "290K", &[("K", 1.0), ("mK", 1e-3)]
);
quantity!(
    /// A time span in seconds.
    Duration, "time", "10s", &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("ps", 1e-12), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)]
);
quantity!(
    /// A speed in m/s.
    Speed, "speed", "10m/s", &[("m/s", 1.0), ("km/s", 1e3), ("km/h", 1.0 / 3.6)]
);
quantity!(
    /// A flux density in Jy.
    FluxDensity, "flux density", "1Jy", &[("Jy", 1.0), ("mJy", 1e-3), ("uJy", 1e-6), ("kJy", 1e3)]
);
quantity!(
    /// A pressure in Pa.
    Pressure, "pressure", "1013hPa", &[("Pa", 1.0), ("hPa", 1e2), ("kPa", 1e3), ("mbar", 1e2), ("bar", 1e5)]
);
quantity!(
    /// A density in kg/m3, of a solid or of water in air.
    Density, "density", "7.5g/m3", &[("kg/m3", 1.0), ("g/m3", 1e-3), ("mg/m3", 1e-6), ("g/cm3", 1e3)]
);
quantity!(
    /// A rain rate in m/s: depth of water per time.
    RainRate, "rain rate", "5mm/h", &[("m/s", 1.0), ("mm/h", 1e-3 / 3600.0)]
);
quantity!(
    /// A fraction of a whole, in percent (the value of `50%` is 50).
    Percent, "fraction", "50%", &[("%", 1.0)]
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
        let e = "-1e300deg".parse::<Angle>().unwrap_err().to_string();
        assert!(e.contains("no angle of that size") && "1e-300s".parse::<Duration>().is_err() && "0s".parse::<Duration>().is_ok(), "{e}");
        assert_eq!("1e20Hz".parse::<Frequency>().unwrap().si(), 1e20);
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
        assert_eq!(Angle(1e-4).to_string(), "20.626480624709636arcsec");
        assert_eq!(format!("{:.3}", Angle(1e-4)), "20.626arcsec");
    }

    #[test]
    fn speed_reads_metres_and_kilometres() {
        assert_eq!("10m/s".parse::<Speed>().unwrap().si(), 10.0);
        assert!(("36km/h".parse::<Speed>().unwrap().si() - 10.0).abs() < 1e-14);
    }

    /// Every unit, with numbers of many sizes and digits, goes to text and back without a change.
    macro_rules! round_trips {
        ($($name:ident),*) => { $(
            for (unit, factor) in $name::UNITS {
                for number in [0.0, 1.0, -2.5, 30.0, 0.1, 1.0 / 3.0, 1e-7, 123_456.789, 7.3e11] {
                    let value = $name(number * factor);
                    assert_eq!(value.to_string().parse::<$name>().unwrap(), value, "{number} {unit}");
                    let text = toml::Value::try_from(value).unwrap();
                    assert_eq!(text.as_str().unwrap(), value.to_string());
                    assert_eq!(text.try_into::<$name>().unwrap(), value);
                }
                assert_eq!(format!("30{unit}").parse::<$name>().unwrap(), $name(30.0 * factor));
            }
            assert_eq!($name::UNITS[0].1, 1.0);
        )* };
    }

    #[test]
    fn text_reads_back_as_the_same_value() {
        round_trips!(Frequency, Length, Angle, Temperature, Duration, Speed, FluxDensity, Pressure, Density, RainRate, Percent);
    }

    proptest::proptest! {
        #[test]
        fn any_angle_reads_back_as_the_same_value(digits in proptest::num::f64::NORMAL, exponent in -29..30) {
            let mantissa = f64::from_bits(digits.to_bits() & !(0x7ff << 52) | 1023 << 52);
            let radians = mantissa / 2.0 * 10_f64.powi(exponent);
            proptest::prop_assert_eq!(Angle(radians).to_string().parse::<Angle>().unwrap(), Angle(radians));
        }
    }

    #[cfg(feature = "schema")]
    #[test]
    fn the_schema_names_the_units() {
        let schema = schemars::schema_for!(Frequency);
        assert_eq!(schema.get("type").unwrap(), "string");
        assert!(schema.get("description").unwrap().as_str().unwrap().contains("GHz"));
    }
}
