//! MPM93. The water continuum is the wing of a pseudo-line at 1780 GHz, so there is no separate continuum.
//!
//! In moist air the sky temperature in the windows is 5-25 K higher than with MPM89 and with recent models.
//!
//! # Reference
//! Liebe, Hufford & Cotton 1993, AGARD CP-542, paper 3.

use super::liebe::Recipe;

pub(super) const MPM93: Recipe = Recipe {
    name: "mpm93",
    water: ("mpm93_h2o", include_str!("../../../tables/lines/mpm93_h2o.csv")),
    oxygen: ("mpm93_o2", include_str!("../../../tables/lines/mpm93_o2.csv")),
    // Row: f0, b1, b2, b3, b4 (ratio of vapour), b5 (exponent of dry air), b6 (exponent of vapour).
    width: [5, 4, 6],
    unit_hpa: 1.0,
    vapour_mixes: true,
    continuum: |_, _, _| 0.0,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::gas::liebe::LiebeModel;

    #[test]
    fn catalogue_has_the_published_number_of_lines() {
        let model = LiebeModel::new(&MPM93).unwrap();
        assert_eq!((model.water.len(), model.oxygen.len()), (35, 44));
    }
}
