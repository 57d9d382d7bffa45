//! Sea water: the double Debye model of Stogryn, Bull, Rubayi and Iravanchy.

use super::constants::ZERO_CELSIUS_K;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "stogryn95",
    describes: "sea water, two relaxations and ionic conduction",
    reference: "Stogryn, Bull, Rubayi & Iravanchy 1995, GenCorp Aerojet report",
    bands: Bands::fixed(1.0, 1000.0),
    ranges: &[
        Range::new(Parameter::Temperature, 271.15, 308.15),
        Range::new(Parameter::Salinity, 0.0, 40.0),
    ],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(sea_water_permittivity_stogryn95(
            q.freq_ghz(),
            q.state.temperature_k,
            q.state.salinity_psu,
        ))
    },
};

/// `1/(2 pi eps0)` in GHz m/S, as the paper rounds it.
const CONDUCTION_GHZ_M_S: f64 = 17.9751;

/// Static permittivity of pure water at `t` degrees Celsius.
///
/// # Reference
/// Stogryn et al. 1995; used again by Meissner & Wentz 2004.
#[must_use]
pub(super) fn static_permittivity(t: f64) -> f64 {
    (37_088.6 - 82.168 * t) / (421.854 + t)
}

/// Ionic conductivity of sea water, S/m, at `t` degrees Celsius and `s` psu.
///
/// # Reference
/// Stogryn et al. 1995; 4.2914 S/m at 15 C and 35 psu.
#[must_use]
pub fn sea_water_conductivity_stogryn95(t: f64, s: f64) -> f64 {
    let s35 = 2.903_602 + 8.607e-2 * t + 4.738_817e-4 * t.powi(2) - 2.991e-6 * t.powi(3)
        + 4.3047e-9 * t.powi(4);
    let r15 = s * (37.5109 + 5.452_16 * s + 1.4409e-2 * s * s) / (1004.75 + 182.283 * s + s * s);
    let a0 = (6.9431 + 3.2841 * s - 9.9486e-2 * s * s) / (84.85 + 69.024 * s + s * s);
    let a1 = 49.843 - 0.2276 * s + 0.198e-2 * s * s;
    s35 * r15 * (1.0 + (t - 15.0) * a0 / (a1 + t))
}

/// Permittivity of sea water, frequency in GHz, temperature in K, salinity in psu.
///
/// # Reference
/// Stogryn et al. 1995; 1-1000 GHz, 0-40 psu.
#[must_use]
pub fn sea_water_permittivity_stogryn95(
    freq_ghz: f64,
    temperature_k: f64,
    salinity_psu: f64,
) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let t1 = (255.04 + 0.7246 * t) / ((49.25 + t) * (45.0 + t));
    let t2 = 0.00628;
    let e_inf = 4.05 + 0.0186 * t;
    let a = 1.0 - s * (3.838e-2 + 2.18e-3 * s) * (79.88 + t) / ((12.01 + s) * (52.53 + t));
    let b = 1.0
        - s * ((3.409e-2 + 2.817e-3 * s) / (7.69 + s)
            - t * (2.46e-3 + 1.41e-3 * t) / (188.0 - 7.57 * t + t * t));
    let es = a * static_permittivity(t);
    let e1 = 0.0787 * es;
    let conduction = CONDUCTION_GHZ_M_S * sea_water_conductivity_stogryn95(t, s) / freq_ghz;
    e_inf
        + (es - e1) / Complex64::new(1.0, t1 * b * freq_ghz)
        + (e1 - e_inf) / Complex64::new(1.0, t2 * freq_ghz)
        - Complex64::new(0.0, conduction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conductivity_of_standard_sea_water() {
        assert!((sea_water_conductivity_stogryn95(15.0, 35.0) - 4.2914).abs() < 2e-4);
    }
}
