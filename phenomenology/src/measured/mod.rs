//! Published measurements beside what the models of this crate give.
//!
//! Each file holds one set: a table in `tables/measured` with its source, and how the models are set up for it. Where a measurement leaves a
//! quantity open, the doc comment of the set says what is assumed.
//!
//! ```
//! let sea_ice = cittert_phenomenology::measured::comparison("sea-ice")?;
//! assert!(sea_ice.rms() < 0.1);
//! # Ok::<(), cittert_phenomenology::measured::MeasuredError>(())
//! ```

mod comparison;
mod opacity;
mod sea;
mod sea_ice;
mod sky;
mod snow;
mod soil;
#[cfg(test)]
mod tests;

pub use comparison::{Comparison, MeasuredError, Point};

/// A set of measurements.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredSet {
    /// Its name.
    pub name: &'static str,
    /// What was measured.
    pub describes: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    compare: fn() -> Result<Vec<Point>, MeasuredError>,
}

/// Every set.
pub const MEASURED_SETS: &[MeasuredSet] = &[
    MeasuredSet { name: "sky", describes: "zenith emission of the clear sky, 1.4-90 GHz", unit: "K", compare: sky::compare },
    MeasuredSet { name: "opacity", describes: "zenith opacity at 350 and 677 GHz on Mauna Kea", unit: "Np", compare: opacity::compare },
    MeasuredSet { name: "soil", describes: "brightness of bare soil against moisture, 0.8-10.7 GHz", unit: "K", compare: soil::compare },
    MeasuredSet {
        name: "sea",
        describes: "rise of the brightness of the sea with wind, 19.35 GHz",
        unit: "K/(m/s)",
        compare: sea::compare,
    },
    MeasuredSet { name: "snow", describes: "emissivity spectra of snow, 4.9-150 GHz", unit: "1", compare: snow::compare },
    MeasuredSet {
        name: "sea-ice",
        describes: "emissivity of first-year and multi-year ice, 2.7 and 37 GHz",
        unit: "1",
        compare: sea_ice::compare,
    },
];

impl MeasuredSet {
    /// The measurements and the values of the models.
    ///
    /// # Errors
    /// A damaged table, or a model that cannot be computed.
    pub fn comparison(&self) -> Result<Comparison, MeasuredError> {
        Ok(Comparison { name: self.name, unit: self.unit, points: (self.compare)()? })
    }
}

/// The comparison of a set by its name.
///
/// # Errors
/// An unknown name, or as [`MeasuredSet::comparison`].
pub fn comparison(name: &str) -> Result<Comparison, MeasuredError> {
    let known = || MEASURED_SETS.iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
    let set = MEASURED_SETS.iter().find(|s| s.name == name);
    set.ok_or_else(|| MeasuredError::Refused(format!("no set of measurements `{name}`; known: {}", known())))?.comparison()
}
