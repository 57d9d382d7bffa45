//! Errors of the radiometric physics, each with the value at fault.

/// An input or a table that the models cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PhysicsError {
    /// A quantity lies outside the range where the model holds (or is not a number).
    #[error("{quantity} {value} {unit} is outside the valid range {min} to {max} {unit}")]
    OutOfRange {
        /// What was given.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value accepted.
        min: f64,
        /// Largest value accepted.
        max: f64,
        /// Unit of the value and of both limits.
        unit: &'static str,
    },
    /// An input that breaks a rule of the models. The message has the value and the rule.
    #[error("{0}")]
    Refused(String),
    /// A name is not in a table of models.
    #[error("unknown {kind} '{name}'; known: {known}")]
    UnknownName {
        /// What kind of thing was asked for.
        kind: &'static str,
        /// The name given.
        name: String,
        /// Every name accepted, separated by commas.
        known: String,
    },
    /// A CSV table could not be read.
    #[error("table {table}, line {line}: {problem}")]
    Table {
        /// Name of the table or profile.
        table: String,
        /// Line number, from 1 (0 when the whole table is meant).
        line: u64,
        /// What is wrong and what is expected.
        problem: String,
    },
    /// The refractive index falls so fast with height that a ray is trapped.
    #[error(
        "the ray at zenith angle {zenith_deg} deg is trapped by a refractive duct near {height_km} km; use a larger elevation or a profile with less vapour gradient"
    )]
    Ducting {
        /// Height where the ray turns back, km.
        height_km: f64,
        /// Zenith angle at the observer, degrees.
        zenith_deg: f64,
    },
    /// A list that must hold at least one entry is empty.
    #[error("no {what} given; at least one is needed")]
    Empty {
        /// What is missing.
        what: &'static str,
    },
}

/// The row of a table with this name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub(super) fn find_by_name<'a, T>(
    kind: &'static str,
    name: &str,
    rows: &'a [T],
    name_of: impl Fn(&T) -> &'static str,
) -> Result<&'a T, PhysicsError> {
    rows.iter().find(|row| name_of(row) == name).ok_or_else(|| PhysicsError::UnknownName {
        kind,
        name: name.to_owned(),
        known: rows.iter().map(&name_of).collect::<Vec<_>>().join(", "),
    })
}

/// Checks `min <= value <= max`. NaN is an error.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] with the value and the range.
pub fn check_range(quantity: &'static str, value: f64, unit: &'static str, min: f64, max: f64) -> Result<f64, PhysicsError> {
    if (min..=max).contains(&value) { Ok(value) } else { Err(PhysicsError::OutOfRange { quantity, value, min, max, unit }) }
}

/// Lowest frequency of the absorption models, GHz.
pub const MIN_FREQ_GHZ: f64 = 1.0;
/// Highest frequency of the absorption models, GHz.
pub const MAX_FREQ_GHZ: f64 = 1000.0;

/// Checks that a frequency lies in 1-1000 GHz.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] with the value and the range.
pub fn check_frequency(freq_ghz: f64) -> Result<f64, PhysicsError> {
    check_range("frequency", freq_ghz, "GHz", MIN_FREQ_GHZ, MAX_FREQ_GHZ)
}

/// Checks a list of frequencies: not empty, each in 1-1000 GHz.
pub(super) fn check_frequencies(freqs_ghz: &[f64]) -> Result<(), PhysicsError> {
    if freqs_ghz.is_empty() {
        return Err(PhysicsError::Empty { what: "frequency" });
    }
    freqs_ghz.iter().try_for_each(|f| check_frequency(*f).map(drop))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_has_value_and_range() {
        let message = check_frequency(0.5).unwrap_err().to_string();
        assert_eq!(message, "frequency 0.5 GHz is outside the valid range 1 to 1000 GHz");
    }

    #[test]
    fn nan_is_out_of_range() {
        assert!(check_frequency(f64::NAN).is_err());
        assert!(check_frequency(f64::INFINITY).is_err());
    }
}
