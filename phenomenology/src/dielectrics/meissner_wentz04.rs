//! Sea water: the double Debye model of Meissner and Wentz, tied to satellite data.

use super::constants::ZERO_CELSIUS_K;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use super::stogryn95::{sea_water_conductivity_stogryn95, static_permittivity};
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "meissner-wentz04",
    describes: "fresh and sea water, two relaxations fitted with satellite data",
    reference: "Meissner & Wentz 2004, IEEE Trans. Geosci. Remote Sens. 42, 1836",
    bands: Bands::fixed(1.0, 90.0),
    ranges: &[
        Range::new(Parameter::Temperature, 253.15, 308.15),
        Range::new(Parameter::Salinity, 0.0, 40.0),
    ],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(sea_water_permittivity_meissner_wentz04(
            q.freq_ghz(),
            q.state.temperature_k,
            q.state.salinity_psu,
        ))
    },
};

/// `1/(2 pi eps0)` in GHz m/S.
const CONDUCTION_GHZ_M_S: f64 = 17.9751;

/// Permittivity of sea water, frequency in GHz, temperature in K, salinity in psu.
///
/// # Reference
/// Meissner & Wentz 2004, Tables III and VI; up to 90 GHz.
#[must_use]
pub fn sea_water_permittivity_meissner_wentz04(
    freq_ghz: f64,
    temperature_k: f64,
    salinity_psu: f64,
) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let e0 = static_permittivity(t)
        * (-3.564_17e-3 * s + 4.748_68e-6 * s * s + 1.155_74e-5 * t * s).exp();
    let n1 = (45.0 + t) / (5.0478 - 0.070_315 * t + 6.0059e-4 * t * t)
        * (1.0 + s * (2.393_57e-3 - 3.1353e-5 * t + 2.524_77e-7 * t * t));
    let e1 = (5.723 + 0.022_379 * t - 7.1237e-4 * t * t)
        * (-6.289_08e-3 * s + 1.760_32e-4 * s * s - 9.221_44e-5 * t * s).exp();
    let n2 = (45.0 + t) / (0.136_52 + 1.4825e-3 * t + 2.4166e-4 * t * t)
        * (1.0 + s * (-1.997_23e-2 + 1.811_76e-4 * t));
    let e2 = (3.6143 + 0.028_841 * t) * (1.0 + s * (-2.042_65e-3 + 1.578_83e-4 * t));
    let conduction = CONDUCTION_GHZ_M_S * sea_water_conductivity_stogryn95(t, s) / freq_ghz;
    e2 + (e0 - e1) / Complex64::new(1.0, freq_ghz / n1)
        + (e1 - e2) / Complex64::new(1.0, freq_ghz / n2)
        - Complex64::new(0.0, conduction)
}

#[cfg(test)]
mod tests {
    use super::super::stogryn95::sea_water_permittivity_stogryn95;
    use super::super::turner16::water_permittivity_turner16;
    use super::*;

    // Independent fits of the same liquids: they must agree to a few per cent where both were
    // fitted, which a wrong coefficient would not survive. Stogryn's fixed second relaxation
    // leaves it behind above 37 GHz, so there the check is on fresh water only.
    #[test]
    fn agrees_with_other_models_to_a_few_per_cent() {
        for t in [273.15, 283.15, 293.15, 303.15] {
            for f in [1.4, 6.8, 19.0, 37.0, 89.0] {
                let fresh = sea_water_permittivity_meissner_wentz04(f, t, 0.0);
                let turner = water_permittivity_turner16(f, t);
                let relative = (fresh - turner).norm() / turner.norm();
                // At 0 C the two part by up to 6.6 %, at 89 GHz.
                let allowed = if t < 280.0 { 0.07 } else { 0.03 };
                assert!(relative < allowed, "{f} GHz {t} K: {fresh} {turner}");
                for s in [20.0, 35.0] {
                    let a = sea_water_permittivity_meissner_wentz04(f, t, s);
                    let b = sea_water_permittivity_stogryn95(f, t, s);
                    let relative = (a - b).norm() / b.norm();
                    assert!(
                        f > 37.0 || relative < 0.04,
                        "{f} GHz {t} K {s} psu: {a} {b}"
                    );
                }
            }
        }
    }
}
