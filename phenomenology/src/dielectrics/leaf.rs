//! Leaves: the dual-dispersion model of Ulaby and El-Rayes, and the mixture of Maetzler, which reaches 100 GHz.

use super::water::sea_water_permittivity_stogryn95;
use num_complex::Complex64;

/// Ionic conductivity of the free water in leaves, S/m.
const CONDUCTIVITY_S_M: f64 = 1.27;

/// Permittivity of leaves: frequency in GHz, gravimetric moisture (kg water per kg fresh leaf).
///
/// # Reference
/// Ulaby & El-Rayes 1987, eqs. 17-21; to 20 GHz.
#[must_use]
pub fn leaf_permittivity_ulaby_el_rayes87(freq_ghz: f64, moisture: f64) -> Complex64 {
    let m = moisture;
    let residual = 1.7 - 0.74 * m + 6.16 * m * m;
    // Below 14 % moisture the fit leaves no free water.
    let free_fraction = (m * (0.55 * m - 0.076)).max(0.0);
    let bound_fraction = 4.64 * m * m / (1.0 + 7.36 * m * m);
    let free = 4.9 + 75.0 / Complex64::new(1.0, freq_ghz / 18.0) - Complex64::new(0.0, 18.0 * CONDUCTIVITY_S_M / freq_ghz);
    let bound = 2.9 + 55.0 / (1.0 + Complex64::new(0.0, freq_ghz / 0.18).sqrt());
    residual + free * free_fraction + bound * bound_fraction
}

/// Salinity of the water in leaves, psu.
const LEAF_SALINITY_PSU: f64 = 10.0;

/// Permittivity of leaves: frequency in GHz, temperature in K, gravimetric moisture (kg water per kg fresh leaf).
///
/// # Reference
/// Maetzler 1994: `0.522 (1 - 1.32 m_d) eps_sw + 0.51 + 3.84 m_d`, `m_d = 1 - M`, to 100 GHz; water of 1 % salinity by Stogryn et al. 1995.
#[must_use]
pub fn leaf_permittivity_maetzler94(freq_ghz: f64, temperature_k: f64, moisture: f64) -> Complex64 {
    let dry = 1.0 - moisture;
    let water = sea_water_permittivity_stogryn95(freq_ghz, temperature_k, LEAF_SALINITY_PSU);
    0.522 * (1.0 - 1.32 * dry) * water + 0.51 + 3.84 * dry
}

#[cfg(test)]
mod tests {
    use super::*;

    // Saline water of 20 C at 94 GHz is 8.0 - j13.5 by Stogryn; with 60 % of water 0.2464 of it is added to 2.046.
    #[test]
    fn leaves_at_94_gigahertz_by_hand_and_beside_the_older_model() {
        let water = sea_water_permittivity_stogryn95(94.0, 293.15, 10.0);
        assert!((water - Complex64::new(8.0, -13.5)).norm() < 1.0, "{water}");
        let eps = leaf_permittivity_maetzler94(94.0, 293.15, 0.6);
        assert!((eps - (2.046 + 0.246_384 * water)).norm() < 1e-12, "{eps}");
        // Where the older fit ends, the two differ by less than the uncertainty of an extended model.
        for moisture in [0.5, 0.6, 0.7] {
            let (old, new) = (leaf_permittivity_ulaby_el_rayes87(20.0, moisture), leaf_permittivity_maetzler94(20.0, 293.15, moisture));
            println!("20 GHz, moisture {moisture}: {old:.2}, {new:.2}");
            assert!((old - new).norm() < 0.2 * new.norm(), "{moisture}: {old} {new}");
        }
    }

    #[test]
    fn permittivity_rises_with_moisture_and_stays_below_water() {
        for f in [1.0, 5.0, 10.0, 20.0] {
            let water = super::super::water_permittivity_liebe91(f, 293.15);
            let mut last = leaf_permittivity_ulaby_el_rayes87(f, 0.1);
            for m in [0.2, 0.4, 0.6, 0.7] {
                let eps = leaf_permittivity_ulaby_el_rayes87(f, m);
                assert!(eps.re > last.re && eps.im < last.im, "{f} GHz {m}: {eps}");
                assert!(eps.re < water.re);
                last = eps;
            }
        }
    }

    // The free-water fraction at M = 0.6 is 0.1524, the bound one 0.4576: at 18 GHz, half the
    // relaxation of free water, the sum can be written down.
    #[test]
    fn eighteen_gigahertz_by_hand() {
        let bound = 2.9 + 55.0 / (1.0 + Complex64::new(0.0, 100.0).sqrt());
        let hand = 3.4736 + Complex64::new(4.9 + 37.5, -37.5 - 1.27) * 0.1524 + bound * (4.64 * 0.36 / 3.6496);
        let eps = leaf_permittivity_ulaby_el_rayes87(18.0, 0.6);
        assert!((eps - hand).norm() < 1e-10, "{eps} {hand}");
    }

    #[test]
    fn dry_leaf_is_nearly_lossless() {
        let eps = leaf_permittivity_ulaby_el_rayes87(10.0, 0.0);
        assert!((eps.re - 1.7).abs() < 1e-12 && eps.im == 0.0);
    }
}
