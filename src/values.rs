//! Values of options that are written as one text, such as `1mJy` or `15.7Ksr`, and the macro that reads and writes such a type in files.

use crate::{ChainError, Result};
use cittert_arrays::VisUnit;
use cittert_arrays::quantity::{FluxDensity, QuantityError, Temperature};
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

/// Gives a type with `Display` and `FromStr` the same text in files. Under the feature `cli` it also gets a JSON schema.
macro_rules! by_text {
    ($type:ident, $kind:expr, $description:literal) => {
        impl serde::Serialize for $type {
            fn serialize<S: serde::Serializer>(&self, s: S) -> std::result::Result<S::Ok, S::Error> {
                s.collect_str(self)
            }
        }

        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> std::result::Result<Self, D::Error> {
                d.deserialize_any($crate::values::TextVisitor(std::marker::PhantomData))
            }
        }

        #[cfg(feature = "cli")]
        impl schemars::JsonSchema for $type {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($type).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "type": $kind, "description": $description })
            }
        }
    };
}
pub(crate) use by_text;

/// Gives a type that is one of some words or a quantity its text on the command line, in files and in messages.
macro_rules! word_or_quantity {
    ($type:ident, $($word:literal => $variant:ident,)+ $other:ident($quantity:ty), $description:literal) => {
        $crate::values::by_text!($type, "string", $description);

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$variant => f.write_str($word),)+
                    Self::$other(quantity) => quantity.fmt(f),
                }
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(text: &str) -> std::result::Result<Self, String> {
                match text {
                    $($word => Ok(Self::$variant),)+
                    _ => text.parse::<$quantity>().map(Self::$other).map_err(|e| format!("{e}; or {}", [$($word),+].join(", or "))),
                }
            }
        }
    };
}
pub(crate) use word_or_quantity;

/// Reads a value from a text. A number in a file counts as the text that it is written with.
pub(crate) struct TextVisitor<T>(pub(crate) PhantomData<T>);

impl<T: FromStr<Err: fmt::Display>> serde::de::Visitor<'_> for TextVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text or a number")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> std::result::Result<T, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> std::result::Result<T, E> {
        self.visit_str(&number.to_string())
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> std::result::Result<T, E> {
        self.visit_str(&number.to_string())
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> std::result::Result<T, E> {
        self.visit_str(&number.to_string())
    }
}

/// An error of a field that is outside its range.
pub(crate) fn bad_value<T>(field: &'static str, value: impl fmt::Display, expected: impl Into<String>) -> Result<T> {
    Err(ChainError::bad_option(field, value, expected))
}

/// Refuse a value of a field that is not good.
pub(crate) fn need(field: &'static str, value: impl fmt::Display, good: bool, expected: impl Into<String>) -> Result<()> {
    if good { Ok(()) } else { bad_value(field, value, expected) }
}

/// A flux in the unit of visibilities: `2.5Jy`, or `15.7Ksr` for visibilities in K sr.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DataFlux {
    /// A flux density.
    Jy(FluxDensity),
    /// Brightness temperature times solid angle, K sr.
    KelvinSr(f64),
}
by_text!(DataFlux, "string", "A flux in the unit of the data, such as \"2.5Jy\" or \"15.7Ksr\".");

impl FromStr for DataFlux {
    type Err = QuantityError;

    fn from_str(text: &str) -> std::result::Result<Self, QuantityError> {
        let number = ["Ksr", "K sr", "K.sr", "K*sr", "K str"].iter().find_map(|u| text.trim().strip_suffix(u));
        match number.and_then(|n| n.trim().parse::<f64>().ok()).filter(|v| v.is_finite()) {
            Some(value) => Ok(Self::KelvinSr(value)),
            None => text.parse().map(Self::Jy),
        }
    }
}

impl fmt::Display for DataFlux {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Jy(flux) => flux.fmt(f),
            Self::KelvinSr(value) => write!(f, "{value}Ksr"),
        }
    }
}

impl DataFlux {
    /// The number in the unit of the data. Visibilities without a calibrated unit count as Jy.
    ///
    /// # Errors
    /// A flux in another unit than the data; the message names `field`.
    pub fn in_unit(self, field: &'static str, unit: VisUnit) -> Result<f64> {
        match (self, unit == VisUnit::KelvinSr) {
            (Self::Jy(flux), false) => Ok(flux.si()),
            (Self::KelvinSr(value), true) => Ok(value),
            (_, true) => bad_value(field, self, "a number with the unit of the data, such as 15.7Ksr"),
            (_, false) => bad_value(field, self, "a flux density such as 2.5Jy"),
        }
    }
}

/// A level of brightness in the unit of an image: `1mJy` (a beam), or `2K` for images in kelvin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    /// A flux density in a beam.
    Jy(FluxDensity),
    /// A brightness temperature.
    Kelvin(Temperature),
}
by_text!(Level, "string", "A flux density in a beam such as \"1mJy\", or a temperature such as \"2K\".");

impl FromStr for Level {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let temperature = || text.parse().map(Self::Kelvin);
        text.parse()
            .map(Self::Jy)
            .or_else(|_: QuantityError| temperature())
            .map_err(|_| format!("{text:?} is neither a flux density such as 1mJy nor a temperature such as 2K"))
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Jy(flux) => flux.fmt(f),
            Self::Kelvin(temperature) => temperature.fmt(f),
        }
    }
}

impl Level {
    /// A number in the unit of the images of data in `unit`.
    #[must_use]
    pub fn of(value: f64, unit: VisUnit) -> Self {
        if unit == VisUnit::KelvinSr { Self::Kelvin(Temperature(value)) } else { Self::Jy(FluxDensity(value)) }
    }

    /// The number in the unit of the images of data in `unit`.
    ///
    /// # Errors
    /// A level in another unit than the images; the message names `field`.
    pub fn in_unit(self, field: &'static str, unit: VisUnit) -> Result<f64> {
        match (self, unit == VisUnit::KelvinSr) {
            (Self::Jy(flux), false) => Ok(flux.si()),
            (Self::Kelvin(temperature), true) => Ok(temperature.si()),
            (_, true) => bad_value(field, self, "a temperature such as 2K, the unit of the images of this set"),
            (_, false) => bad_value(field, self, "a flux density such as 1mJy, the unit of the images of this set"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fluxes_are_read_in_the_unit_of_the_data() {
        let read = |text: &str, unit| text.parse::<DataFlux>().unwrap().in_unit("flux", unit);
        assert_eq!(read("15.7Ksr", VisUnit::KelvinSr).unwrap(), 15.7);
        assert_eq!(read("-1.5 K sr", VisUnit::KelvinSr).unwrap(), -1.5);
        assert!((read("250mJy", VisUnit::Jy).unwrap() - 0.25).abs() < 1e-12);
        assert!("15.7".parse::<DataFlux>().is_err());
        let e = read("15.7Ksr", VisUnit::Jy).unwrap_err().to_string();
        assert!(e.contains("flux is 15.7Ksr"), "{e}");
    }

    #[test]
    fn a_level_of_another_unit_is_refused() {
        assert_eq!("2K".parse::<Level>().unwrap().in_unit("threshold", VisUnit::KelvinSr).unwrap(), 2.0);
        assert!("2K".parse::<Level>().unwrap().in_unit("threshold", VisUnit::Jy).is_err());
        assert!("2".parse::<Level>().is_err());
    }
}
