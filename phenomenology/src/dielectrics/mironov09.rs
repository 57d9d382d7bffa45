//! Soil, 0.3-26 GHz: the generalised refractive mixture of Mironov, by clay content.

use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use crate::constants::VACUUM_PERMITTIVITY_F_M;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "mironov09",
    describes: "moist soil by clay content, bound and free water",
    reference: "Mironov, Kosolapova & Fomin 2009, IEEE Trans. Geosci. Remote Sens. 47, 2059",
    bands: Bands::fixed(0.3, 26.0),
    // The fit was made at room temperature and has no temperature in it.
    ranges: &[Range::new(Parameter::Temperature, 283.15, 303.15), Range::new(Parameter::Clay, 0.0, 0.76)],
    extension: SAME_FORMULA,
    formula: |q| Ok(soil_permittivity_mironov09(q.freq_ghz(), q.state.moisture, q.state.clay)),
};

/// High-frequency permittivity of soil water.
const E_INF: f64 = 4.9;

/// Refractive index `n - j k` of one kind of soil water.
fn water_index(freq_ghz: f64, eps0: f64, tau_s: f64, conductivity: f64) -> Complex64 {
    let w = TAU * freq_ghz * 1e9;
    let eps = E_INF + (eps0 - E_INF) / Complex64::new(1.0, w * tau_s) - Complex64::new(0.0, conductivity / (w * VACUUM_PERMITTIVITY_F_M));
    eps.sqrt()
}

/// Permittivity of moist soil: frequency in GHz, water volume fraction, clay mass fraction.
///
/// # Reference
/// Mironov et al. 2009, eqs. 1-8, coefficients in per cent of clay.
#[must_use]
pub fn soil_permittivity_mironov09(freq_ghz: f64, moisture: f64, clay: f64) -> Complex64 {
    let c = 100.0 * clay;
    let dry = Complex64::new(1.634 - 5.39e-3 * c + 2.748e-5 * c * c, -(0.039_52 - 4.038e-4 * c));
    let bound_limit = 0.028_63 + 3.0673e-3 * c;
    let bound = water_index(freq_ghz, 79.8 - 0.854 * c + 3.27e-3 * c * c, 1.062e-11 + 3.45e-14 * c, 0.3112 + 4.67e-3 * c);
    let free = water_index(freq_ghz, 100.0, 8.5e-12, 0.3631 + 0.012_17 * c);
    let index = dry + (bound - 1.0) * moisture.min(bound_limit) + (free - 1.0) * (moisture - bound_limit).max(0.0);
    index * index
}

#[cfg(test)]
mod tests {
    use super::*;

    // Dobson's model is an independent model of the same soils. The two models differ by no more than measured soils do.
    #[test]
    fn is_of_the_size_of_dobson() {
        let soil = super::super::Material::by_name("soil").unwrap();
        let mut state = soil.state();
        soil.set_texture(&mut state, "loam").unwrap();
        for f in [1.4, 5.0, 10.0, 18.0] {
            for mv in [0.05, 0.15, 0.3] {
                state.moisture = mv;
                let ours = soil_permittivity_mironov09(f, mv, state.clay);
                let dobson = super::super::dobson85::soil_permittivity_dobson85(f, &state);
                let ratio = ours.re / dobson.re;
                assert!((0.7..1.3).contains(&ratio), "{f} GHz {mv}: {ours} {dobson}");
                assert!(ours.im < 0.0);
            }
        }
    }

    #[test]
    fn is_continuous_where_free_water_begins() {
        let limit = 0.028_63 + 3.0673e-3 * 20.0;
        let below = soil_permittivity_mironov09(10.0, limit - 1e-9, 0.2);
        let above = soil_permittivity_mironov09(10.0, limit + 1e-9, 0.2);
        assert!((below - above).norm() < 1e-6);
    }
}
