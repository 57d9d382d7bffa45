//! A permittivity model: one row of the table `materials.toml`.

use super::state::Range;
use num_complex::Complex64;
use serde::Deserialize;

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
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
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

/// One permittivity model: a published formula and its range. Its formula is in `formulas.rs`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Name, author and year.
    pub name: &'static str,
    /// What it describes.
    pub describes: &'static str,
    /// Publication of the formula.
    pub reference: &'static str,
    /// Frequencies it covers; none where they depend on the material.
    #[serde(default)]
    pub bands: Vec<Band>,
    /// Ranges of its other parameters.
    #[serde(default)]
    pub ranges: Vec<Range>,
    /// The extension outside the range.
    #[serde(default = "same_formula")]
    pub extension: &'static str,
    /// Relative standard uncertainty of the permittivity outside the range. It scales real part and loss together.
    #[serde(default = "usual_uncertainty")]
    pub uncertainty: f64,
}

/// The uncertainty of most models outside of their range. Where the ranges of two models of one matter meet, they differ by up to 0.16.
fn usual_uncertainty() -> f64 {
    0.2
}

/// The extension of most models.
fn same_formula() -> &'static str {
    "the same formula is continued"
}

/// Permittivity from its real part and its (positive) loss.
#[must_use]
pub fn permittivity_of(real: f64, loss: f64) -> Complex64 {
    Complex64::new(real, -loss)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dielectrics::Material;

    // Two models of one matter at the frequency where one ends and the other goes on.
    #[test]
    fn models_that_meet_differ_by_less_than_the_uncertainty_of_an_extension() {
        let meetings = [
            ("soil", "dobson85", "ulaby86", 18.0),
            ("soil", "ulaby86", "ulaby86-liebe91", 37.0),
            ("wet-snow", "hallikainen86", "polder-van-santen46", 37.0),
            ("vegetation", "ulaby-el-rayes87", "maetzler94", 20.0),
        ];
        let mut squares = 0.0;
        for (name, low, high, freq_ghz) in meetings {
            let material = Material::by_name(name).unwrap();
            let eps = |model: &str| {
                let model = material.model(model).unwrap();
                material.evaluate(Some(model), &material.state(), freq_ghz * 1e9, Extrapolation::Documented).unwrap().eps
            };
            let apart = (eps(low) - eps(high)).norm() / eps(high).norm();
            println!("{name} at {freq_ghz} GHz: {low} {:.2}, {high} {:.2}, {apart:.3} apart", eps(low), eps(high));
            squares += apart * apart / meetings.len() as f64;
        }
        assert!(squares.sqrt() < usual_uncertainty(), "{}", squares.sqrt());
    }
}
