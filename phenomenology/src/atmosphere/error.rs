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
    /// The zenith angle of a sky direction is not above the horizon.
    #[error(
        "zenith angle {zenith_deg} deg is outside the valid range 0 to below 90 deg; a sky temperature needs a direction above the horizon"
    )]
    ZenithAngle {
        /// The angle given, degrees.
        zenith_deg: f64,
    },
    /// The vapour pressure exceeds the total pressure.
    #[error("vapour pressure {vapour_pressure_hpa} hPa is outside the valid range 0 to {pressure_hpa} hPa (the total pressure)")]
    VapourAbovePressure {
        /// Vapour pressure given, hPa.
        vapour_pressure_hpa: f64,
        /// Total pressure given, hPa.
        pressure_hpa: f64,
    },
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
    /// Two neighbouring profile levels are in the wrong order.
    #[error("profile {profile}: {quantity} {value} {unit} at level {level} follows {previous} {unit}; {rule}")]
    ProfileOrder {
        /// Name of the profile.
        profile: String,
        /// The column at fault.
        quantity: &'static str,
        /// Index of the level, from 1.
        level: usize,
        /// Value at the level.
        value: f64,
        /// Value at the level before.
        previous: f64,
        /// Unit of both.
        unit: &'static str,
        /// The rule broken.
        rule: &'static str,
    },
    /// A text could not be read as a layer.
    #[error("layer '{text}': {problem}; expected KIND:BASE-TOP:AMOUNT such as cloud:0.5km-1.5km:0.2g/m3 or rain:0km-2km:5mm/h")]
    LayerText {
        /// The text given.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A layer has its top at or below its base, or lies outside the profile.
    #[error("layer {layer}: base and top must satisfy {min_km} km <= base < top <= {max_km} km")]
    LayerExtent {
        /// The layer in text form.
        layer: String,
        /// Lowest height accepted, km.
        min_km: f64,
        /// Highest height accepted, km.
        max_km: f64,
    },
    /// Two layers of the same phase occupy the same heights.
    #[error(
        "layers {first} and {second} overlap; layers of cloud, fog and haze (or two of ice, or two of rain) must not share heights, merge them into one"
    )]
    LayersOverlap {
        /// The lower layer.
        first: String,
        /// The layer that overlaps it.
        second: String,
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
    /// The length of a path is shorter than the height it spans.
    #[error("path length {length_km} km is shorter than the height difference {height_km} km between its ends")]
    PathTooShort {
        /// Length given, km.
        length_km: f64,
        /// Height difference of the ends, km.
        height_km: f64,
    },
    /// A horizontal direction was given for a path between different heights.
    #[error(
        "zenith angle {zenith_deg} deg cannot join heights {from_km} km and {to_km} km; give an angle below 90 deg, or the path length for a horizontal path"
    )]
    PathDirection {
        /// Zenith angle given, degrees.
        zenith_deg: f64,
        /// Height of the start, km.
        from_km: f64,
        /// Height of the end, km.
        to_km: f64,
    },
    /// A list that must hold at least one entry is empty.
    #[error("no {what} given; at least one is needed")]
    Empty {
        /// What is missing.
        what: &'static str,
    },
    /// An adaptive table did not reach its tolerance within its size limit.
    #[error(
        "the sky table needs more than {limit} zenith angles for a tolerance of {tolerance_k} K; ask for a larger tolerance or a narrower range"
    )]
    TableTooLarge {
        /// The limit of its nodes.
        limit: usize,
        /// The tolerance asked for, K.
        tolerance_k: f64,
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
