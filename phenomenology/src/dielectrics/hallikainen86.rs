//! Wet snow to 37 GHz: the modified Debye-like model of Hallikainen, Ulaby and Abdelrazik.

use super::model::{Bands, Model, Range, SAME_FORMULA, permittivity_of};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "hallikainen86",
    describes: "wet snow at 0 C, empirical",
    reference: "Hallikainen, Ulaby & Abdelrazik 1986, IEEE Trans. Antennas Propag. 34, 1329 \
                (coefficients as in Ulaby & Long 2014)",
    bands: Bands::fixed(3.0, 37.0),
    ranges: &[
        // The published range is 1-12 %. The fit approaches its dry limit smoothly, so 0.5 % is accepted.
        Range::new(Parameter::Moisture, 0.005, 0.12),
        Range::new(Parameter::Density, 90.0, 380.0),
    ],
    extension: SAME_FORMULA,
    formula: |q| Ok(wet_snow_permittivity_hallikainen86(q.freq_ghz(), q.state.density_kg_m3, q.state.moisture)),
};

/// Effective relaxation frequency of the water in snow, GHz.
const RELAXATION_GHZ: f64 = 9.07;

/// Permittivity of wet snow: frequency in GHz, dry density in kg/m3, water volume fraction.
///
/// # Reference
/// Hallikainen et al. 1986; 3-37 GHz, water 1-12 %, dry density 0.09-0.38 g/cm3.
#[must_use]
pub fn wet_snow_permittivity_hallikainen86(freq_ghz: f64, dry_density_kg_m3: f64, moisture: f64) -> Complex64 {
    let f = freq_ghz;
    let rho = dry_density_kg_m3 * 1e-3;
    let mv = 100.0 * moisture;
    let a1 = 0.78 + 0.03 * f - 5.8e-4 * f * f;
    let a2 = 0.97 - 3.9e-3 * f + 3.9e-4 * f * f;
    let b1 = 0.31 - 0.05 * f + 8.7e-4 * f * f;
    let ratio = f / RELAXATION_GHZ;
    let y = mv.powf(1.31) / (1.0 + ratio * ratio);
    permittivity_of(a1 * (1.0 + 1.83 * rho + 0.02 * mv.powf(1.015)) + b1 + 0.073 * a1 * y, 0.073 * a2 * y * ratio)
}
