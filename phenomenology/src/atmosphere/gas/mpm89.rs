//! MPM89, the default. In the atmospheric windows it is close to the models of today.
//!
//! # Reference
//! Liebe 1989, Int. J. Infrared and Millimeter Waves 10, 631.

use super::liebe::Recipe;

pub(super) const MPM89: Recipe = Recipe {
    name: "mpm89",
    water: ("mpm89_h2o", include_str!("../../../tables/lines/mpm89_h2o.csv")),
    oxygen: ("mpm89_o2", include_str!("../../../tables/lines/mpm89_o2.csv")),
    // Row: f0, b1, b2, b3, b4 (exponent of dry air), b5 (ratio of vapour), b6 (exponent of vapour).
    width: [4, 5, 6],
    unit_hpa: 10.0,
    vapour_mixes: false,
    continuum: |p_d, e, theta| e * theta.powi(3) * 1e-5 * (0.113 * p_d + 3.57 * e * theta.powf(7.5)),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::air::AirState;
    use crate::atmosphere::gas::GasModel;
    use crate::atmosphere::gas::liebe::LiebeModel;

    #[test]
    fn catalogue_has_the_published_number_of_lines() {
        let model = LiebeModel::new(&MPM89).unwrap();
        assert_eq!((model.water.len(), model.oxygen.len()), (30, 44));
    }

    #[test]
    fn dry_air_has_no_water_absorption() {
        let air = AirState::new(1013.0, 288.0, 0.0).unwrap();
        let absorption = LiebeModel::new(&MPM89).unwrap().spectrum(&air).absorption(183.31);
        assert_eq!(absorption.water_db_per_km, 0.0);
        assert!(absorption.oxygen_db_per_km > 0.0);
    }
}
