//! A permittivity model: one row of the table in `registry.rs`.

use super::error::DielectricError;
use super::spec::Constants;
use super::state::{MaterialState, Parameter};
use crate::constants::ZERO_CELSIUS_K;
use num_complex::Complex64;

/// Treatment of states and frequencies outside the range of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extrapolation {
    /// An error that names the range.
    #[default]
    Refuse,
    /// The extension that the model documents.
    Documented,
}

/// A frequency band, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Lower end, GHz.
    pub min_ghz: f64,
    /// Upper end, GHz.
    pub max_ghz: f64,
}

impl Band {
    /// Whether a frequency lies in the band.
    #[must_use]
    pub fn contains(&self, freq_ghz: f64) -> bool {
        // A frequency equal to a band edge may differ from it by rounding.
        let slack = 1.0 + 1e-9;
        freq_ghz * slack >= self.min_ghz && freq_ghz <= self.max_ghz * slack
    }

    /// Distance of a frequency from the band, as the logarithm of their ratio.
    #[must_use]
    pub fn distance(&self, freq_ghz: f64) -> f64 {
        if self.contains(freq_ghz) {
            0.0
        } else if freq_ghz < self.min_ghz {
            (self.min_ghz / freq_ghz).ln()
        } else {
            (freq_ghz / self.max_ghz).ln()
        }
    }
}

/// The frequencies a model covers.
#[derive(Debug, Clone, Copy)]
pub enum Bands {
    /// One band for every material.
    Fixed(Band),
    /// Bands that depend on the material.
    OfMaterial(fn(&'static str, Constants) -> Result<Vec<Band>, DielectricError>),
}

impl Bands {
    /// One band from `min_ghz` to `max_ghz`.
    #[must_use]
    pub const fn fixed(min_ghz: f64, max_ghz: f64) -> Self {
        Self::Fixed(Band { min_ghz, max_ghz })
    }
}

/// The range of one parameter of a model, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The parameter.
    pub parameter: Parameter,
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

impl Range {
    /// A range of one parameter.
    #[must_use]
    pub const fn new(parameter: Parameter, min: f64, max: f64) -> Self {
        Self { parameter, min, max }
    }
}

/// Input of a formula: a material, its state and a frequency, all checked.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// Name of the material.
    pub material: &'static str,
    /// The constants that the material gives to the model.
    pub constants: Constants,
    /// Its state.
    pub state: &'a MaterialState,
    /// Frequency, Hz.
    pub freq_hz: f64,
}

impl Query<'_> {
    /// Frequency, GHz.
    #[must_use]
    pub fn freq_ghz(&self) -> f64 {
        self.freq_hz * 1e-9
    }

    /// Temperature, degrees Celsius.
    #[must_use]
    pub fn celsius(&self) -> f64 {
        self.state.temperature_k - ZERO_CELSIUS_K
    }
}

/// A formula: checked inputs to permittivity `eps' - j eps''`.
pub type Formula = fn(&Query<'_>) -> Result<Complex64, DielectricError>;

/// One permittivity model.
#[derive(Debug, Clone, Copy)]
pub struct Model {
    /// Name, author and year.
    pub name: &'static str,
    /// What it describes.
    pub describes: &'static str,
    /// Publication of the formula.
    pub reference: &'static str,
    /// Frequencies it covers.
    pub bands: Bands,
    /// Ranges of its other parameters.
    pub ranges: &'static [Range],
    /// The extension outside the range.
    pub extension: &'static str,
    /// The formula.
    pub formula: Formula,
}

/// The extension of most models.
pub(super) const SAME_FORMULA: &str = "the same formula is continued";

impl Model {
    /// The frequency bands of the model for one material.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if a built-in table is damaged.
    pub fn bands_of(&self, material: &'static str, constants: Constants) -> Result<Vec<Band>, DielectricError> {
        match self.bands {
            Bands::Fixed(band) => Ok(vec![band]),
            Bands::OfMaterial(bands) => bands(material, constants),
        }
    }

    /// Checks that frequency and state lie in the range of the model.
    ///
    /// # Errors
    /// [`DielectricError::OutOfBand`] or [`DielectricError::OutOfRange`].
    pub fn check_range(&self, query: &Query<'_>) -> Result<(), DielectricError> {
        let bands = self.bands_of(query.material, query.constants)?;
        let freq_ghz = query.freq_ghz();
        if !bands.iter().any(|b| b.contains(freq_ghz)) {
            return Err(DielectricError::OutOfBand {
                model: self.name,
                material: query.material,
                freq_ghz,
                bands: bands.iter().map(|b| format!("{}-{}", b.min_ghz, b.max_ghz)).collect::<Vec<_>>().join(", "),
                extension: self.extension,
            });
        }
        for range in self.ranges {
            let value = query.state.get(range.parameter);
            let slack = 1e-9 * (1.0 + range.max.abs());
            if value < range.min - slack || value > range.max + slack {
                return Err(DielectricError::OutOfRange {
                    model: self.name,
                    parameter: range.parameter,
                    value,
                    unit: range.parameter.unit(),
                    min: range.min,
                    max: range.max,
                    extension: self.extension,
                });
            }
        }
        Ok(())
    }
}

/// The error for a material whose row lacks the constants that a model needs.
pub(super) fn no_constants(material: &str, model: &Model) -> DielectricError {
    DielectricError::Table { table: "materials", message: format!("`{material}` has no constants for model `{}`", model.name) }
}

/// Permittivity from its real part and its (positive) loss.
#[must_use]
pub fn permittivity_of(real: f64, loss: f64) -> Complex64 {
    Complex64::new(real, -loss)
}
