//! Centres of known arrays, for Measurement Sets that do not state the centre. The definition has no place for it.

use crate::builtin;
use std::sync::LazyLock;

/// Name, and geocentric coordinates in m.
static OBSERVATORIES: LazyLock<Vec<(String, [f64; 3])>> = LazyLock::new(|| builtin::rows(include_str!("observatories.csv")));

/// Geocentric coordinates of an array by its name, m.
pub(super) fn center_m(telescope: &str) -> Option<[f64; 3]> {
    OBSERVATORIES.iter().find(|o| o.0.eq_ignore_ascii_case(telescope.trim())).map(|o| o.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::Site;

    #[test]
    fn every_array_stands_on_the_ground() {
        assert_eq!(OBSERVATORIES.len(), 18);
        for (name, xyz) in OBSERVATORIES.iter() {
            let altitude = Site::from_ecef_m(*xyz).altitude_m;
            assert!((0.0..5200.0).contains(&altitude), "{name} {altitude}");
        }
        assert!(center_m("mwa").is_some() && center_m("SPIRAL").is_none());
    }
}
