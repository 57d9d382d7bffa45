//! Ice: pure ice, brine, and brine pockets in sea ice.

use super::error::DielectricError;
use super::mixing::{NEEDLE, SPHERE, maxwell_garnett04, polder_van_santen46};
use super::model::permittivity_of;
use crate::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Real part of the permittivity of pure ice.
///
/// # Reference
/// Maetzler & Wegmueller 1987, J. Phys. D 20, 1623.
fn ice_real_part(temperature_k: f64) -> f64 {
    3.1884 + 9.1e-4 * (temperature_k - ZERO_CELSIUS_K)
}

/// Permittivity of pure ice with the loss `alpha/f + beta f`. Both models have the same `alpha`.
fn ice_from_beta(freq_ghz: f64, temperature_k: f64, beta: f64) -> Complex64 {
    let excess = 300.0 / temperature_k - 1.0;
    let alpha = (0.005_04 + 0.0062 * excess) * (-22.1 * excess).exp();
    permittivity_of(ice_real_part(temperature_k), alpha / freq_ghz + beta * freq_ghz)
}

/// Permittivity of pure ice, frequency in GHz, temperature in K.
///
/// # Reference
/// Maetzler 2006; 0.01-1000 GHz, 200-273 K.
#[must_use]
pub fn ice_permittivity_maetzler06(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let b = (335.0 / temperature_k).exp();
    let beta = 0.0207 / temperature_k * b / ((b - 1.0) * (b - 1.0)) + 1.16e-11 * freq_ghz * freq_ghz + (-9.963 + 0.0372 * t).exp();
    ice_from_beta(freq_ghz, temperature_k, beta)
}

/// Permittivity of pure ice, frequency in GHz, temperature in K.
///
/// # Reference
/// Hufford 1991; 0.01-1000 GHz, 200-273 K.
#[must_use]
pub fn ice_permittivity_hufford91(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let theta = 300.0 / temperature_k;
    let excess = theta - 1.0;
    let resonance = theta / (excess + 0.0073);
    let beta = (0.502 - 0.131 * excess / theta) * 1e-4 + 0.542e-6 * resonance * resonance;
    ice_from_beta(freq_ghz, temperature_k, beta)
}

/// Permittivity of brine at its freezing point, frequency in GHz, temperature in K.
///
/// # Reference
/// Stogryn & Desargant 1985, eqs. 1-5. Their measurements span 7.5-40 GHz and -2.8 to -25 C.
#[must_use]
pub fn brine_permittivity_stogryn_desargant85(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let es = (939.66 - 19.068 * t) / (10.737 - t);
    let two_pi_tau_ns = 0.1099 + 1.3603e-3 * t + 2.0894e-4 * t * t + 2.8167e-6 * t * t * t;
    let e_inf = (82.79 + 8.19 * t * t) / (15.68 + t * t);
    let conductivity = if t >= -22.9 { -t * (0.5193 + 0.087_55 * t).exp() } else { -t * (1.0334 + 0.11 * t).exp() };
    e_inf + (es - e_inf) / Complex64::new(1.0, two_pi_tau_ns * freq_ghz)
        - Complex64::new(0.0, conductivity / (TAU * freq_ghz * 1e9 * VACUUM_PERMITTIVITY_F_M))
}

/// Coefficients of F and G for -30 to -22.9 C, where hydrohalite has crystallised out of the brine.
const COLDEST: ([f64; 4], [f64; 4]) = ([9899.0, 1309.0, 55.27, 0.7160], [8.547, 1.089, 0.045_18, 5.819e-4]);
/// Coefficients of F and G for -22.9 to -2 C.
const COLD: ([f64; 4], [f64; 4]) = ([-4.732, -22.45, -0.6397, -0.010_74], [0.089_03, -0.017_63, -5.33e-4, -8.801e-6]);
/// Coefficients of F and G above -2 C.
const WARM: ([f64; 4], [f64; 4]) = ([-0.041_221, -18.407, 0.584_02, 0.214_54], [0.090_312, -0.016_111, 1.2291e-4, 1.3603e-4]);

fn cubic(c: &[f64; 4], t: f64) -> f64 {
    c[0] + t * (c[1] + t * (c[2] + t * c[3]))
}

/// Volume fraction of brine in air-free sea ice, temperature in K, bulk salinity in psu.
///
/// Close to the melting point the formula exceeds 1 and then has a pole. All ice is liquid there, and the function returns 1.
///
/// # Reference
/// Cox & Weeks 1983, J. Glaciol. 29, 306 (-30 to -2 C); Lepparanta & Manninen 1988 above -2 C.
#[must_use]
pub fn brine_volume_cox_weeks83(temperature_k: f64, salinity_psu: f64) -> f64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let (a, b) = if t < -22.9 {
        &COLDEST
    } else if t < -2.0 {
        &COLD
    } else {
        &WARM
    };
    let (f, g) = (cubic(a, t), cubic(b, t));
    let ice = 0.9167 - 1.403e-4 * t;
    let bulk = ice * f / (f - ice * salinity_psu * g);
    let volume = bulk * salinity_psu / f;
    let possible = volume.is_nan() || (0.0..=1.0).contains(&volume);
    if salinity_psu > 0.0 && !possible { 1.0 } else { volume }
}

/// Shape and mixing of the brine pockets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BrinePockets {
    /// Spheres, Polder & van Santen.
    Spheres,
    /// Spheres, Maxwell Garnett.
    SpheresApart,
    /// Randomly oriented needles, Polder & van Santen.
    Needles,
}

/// Permittivity of sea ice, frequency in GHz, temperature in K, bulk salinity in psu.
///
/// Needles raise the loss above that of spheres: 1.1 to 2 times at 35 GHz and beyond, up to 8 times at 10 GHz, where the contrast between
/// brine and ice is largest.
///
/// # Errors
/// As [`polder_van_santen46`].
pub fn sea_ice_permittivity(
    freq_ghz: f64,
    temperature_k: f64,
    salinity_psu: f64,
    pockets: BrinePockets,
) -> Result<Complex64, DielectricError> {
    let host = ice_permittivity_maetzler06(freq_ghz, temperature_k);
    let brine = brine_permittivity_stogryn_desargant85(freq_ghz, temperature_k);
    let volume = brine_volume_cox_weeks83(temperature_k, salinity_psu);
    match pockets {
        BrinePockets::Spheres => polder_van_santen46(host, brine, volume, SPHERE),
        BrinePockets::SpheresApart => Ok(maxwell_garnett04(host, brine, volume)),
        BrinePockets::Needles => polder_van_santen46(host, brine, volume, NEEDLE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needles_are_lossier_than_spheres() {
        for f in [35.0, 94.0, 220.0] {
            for t in [253.15, 263.15] {
                let s = sea_ice_permittivity(f, t, 6.0, BrinePockets::Spheres).unwrap();
                let n = sea_ice_permittivity(f, t, 6.0, BrinePockets::Needles).unwrap();
                let m = sea_ice_permittivity(f, t, 6.0, BrinePockets::SpheresApart).unwrap();
                let ratio = n.im / s.im;
                assert!((1.1..2.2).contains(&ratio), "{f} GHz {t} K ratio {ratio}");
                assert!((m - s).norm() < 0.05 * s.norm());
            }
        }
    }

    #[test]
    fn ice_without_salt_is_fresh_ice() {
        let eps = sea_ice_permittivity(37.0, 260.0, 0.0, BrinePockets::Spheres).unwrap();
        assert!((eps - ice_permittivity_maetzler06(37.0, 260.0)).norm() < 1e-12);
    }
}
