//! Water: fresh, supercooled and salt.

use super::model::permittivity_of;
use crate::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Permittivity of fresh water, frequency in GHz, temperature in K.
///
/// # Reference
/// Liebe, Hufford & Manabe 1991; 1-1000 GHz, 0-30 C.
#[must_use]
pub fn water_permittivity_liebe91(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let q = 1.0 - 300.0 / temperature_k;
    let e0 = 77.66 - 103.3 * q;
    let e1 = 0.0671 * e0;
    let e2 = 3.52 + 7.52 * q;
    let f1 = 20.2 + 146.4 * q + 316.0 * q * q;
    let f2 = 39.8 * f1;
    e2 + (e1 - e2) / Complex64::new(1.0, freq_ghz / f2) + (e0 - e1) / Complex64::new(1.0, freq_ghz / f1)
}

/// `a` (amplitude), `b` (1/K), `c` (s), `d` (K) of the two relaxations.
const RELAXATIONS: [[f64; 4]; 2] = [[81.11, 4.434e-3, 1.302e-13, 662.7], [2.025, 1.073e-2, 1.012e-14, 608.9]];
/// Critical temperature of the relaxation times, K below zero Celsius.
const CRITICAL_K: f64 = 134.2;

/// Permittivity of fresh water, frequency in GHz, temperature in K.
///
/// # Reference
/// Turner, Kneifel & Cadeddu 2016; to 500 GHz.
#[must_use]
pub fn water_permittivity_turner16(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let w = TAU * freq_ghz * 1e9;
    let mut real = 87.9144 - 0.404_399 * t + 9.587_26e-4 * t * t - 1.328_02e-6 * t * t * t;
    let mut loss = 0.0;
    for [a, b, c, d] in RELAXATIONS {
        let amplitude = a * (-b * t).exp();
        let tau = c * (d / (t + CRITICAL_K)).exp();
        let wt = w * tau;
        real -= wt * wt * amplitude / (1.0 + wt * wt);
        loss += wt * amplitude / (1.0 + wt * wt);
    }
    permittivity_of(real, loss)
}

/// `1/(2 pi eps0)` in GHz m/S, as the paper rounds it.
const CONDUCTION_GHZ_M_S: f64 = 17.9751;

/// Static permittivity of pure water at `t` degrees Celsius.
///
/// # Reference
/// Stogryn et al. 1995; used again by Meissner & Wentz 2004.
fn pure_water_stogryn95(t: f64) -> f64 {
    (37_088.6 - 82.168 * t) / (421.854 + t)
}

/// Ionic conductivity of sea water, S/m, at `t` degrees Celsius and `s` psu.
///
/// # Reference
/// Stogryn et al. 1995; 4.2914 S/m at 15 C and 35 psu.
#[must_use]
pub fn sea_water_conductivity_stogryn95(t: f64, s: f64) -> f64 {
    let s35 = 2.903_602 + 8.607e-2 * t + 4.738_817e-4 * t.powi(2) - 2.991e-6 * t.powi(3) + 4.3047e-9 * t.powi(4);
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
pub fn sea_water_permittivity_stogryn95(freq_ghz: f64, temperature_k: f64, salinity_psu: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let t1 = (255.04 + 0.7246 * t) / ((49.25 + t) * (45.0 + t));
    let t2 = 0.00628;
    let e_inf = 4.05 + 0.0186 * t;
    let a = 1.0 - s * (3.838e-2 + 2.18e-3 * s) * (79.88 + t) / ((12.01 + s) * (52.53 + t));
    let b = 1.0 - s * ((3.409e-2 + 2.817e-3 * s) / (7.69 + s) - t * (2.46e-3 + 1.41e-3 * t) / (188.0 - 7.57 * t + t * t));
    let es = a * pure_water_stogryn95(t);
    let e1 = 0.0787 * es;
    let conduction = CONDUCTION_GHZ_M_S * sea_water_conductivity_stogryn95(t, s) / freq_ghz;
    e_inf + (es - e1) / Complex64::new(1.0, t1 * b * freq_ghz) + (e1 - e_inf) / Complex64::new(1.0, t2 * freq_ghz)
        - Complex64::new(0.0, conduction)
}

/// Permittivity of water at high frequencies.
pub(super) const E_INF: f64 = 4.9;

/// Static permittivity of pure water at `t` degrees Celsius.
pub(super) fn pure_water_klein_swift77(t: f64) -> f64 {
    87.134 - 0.1949 * t - 1.276e-2 * t * t + 2.491e-4 * t * t * t
}

/// Permittivity of sea water, frequency in GHz, temperature in K, salinity in psu.
///
/// # Reference
/// Klein & Swift 1977; up to 10 GHz.
#[must_use]
pub fn sea_water_permittivity_klein_swift77(freq_ghz: f64, temperature_k: f64, salinity_psu: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let w = TAU * freq_ghz * 1e9;
    let es = pure_water_klein_swift77(t) * (1.0 + 1.613e-5 * s * t - 3.656e-3 * s + 3.21e-5 * s * s - 4.232e-7 * s * s * s);
    let tau = (1.768e-11 - 6.086e-13 * t + 1.104e-14 * t * t - 8.111e-17 * t * t * t)
        * (1.0 + 2.282e-5 * s * t - 7.638e-4 * s - 7.76e-6 * s * s + 1.105e-8 * s * s * s);
    let d = 25.0 - t;
    let exponent = d * (2.0333e-2 + 1.266e-4 * d + 2.464e-6 * d * d - s * (1.849e-5 - 2.551e-7 * d + 2.551e-8 * d * d));
    let conductivity = s * (0.182_521 - 1.461_92e-3 * s + 2.093_24e-5 * s * s - 1.282_05e-7 * s * s * s) * (-exponent).exp();
    E_INF + (es - E_INF) / Complex64::new(1.0, w * tau) - Complex64::new(0.0, conductivity / (w * VACUUM_PERMITTIVITY_F_M))
}

/// Permittivity of sea water, frequency in GHz, temperature in K, salinity in psu.
///
/// # Reference
/// Meissner & Wentz 2004, Tables III and VI; up to 90 GHz.
#[must_use]
pub fn sea_water_permittivity_meissner_wentz04(freq_ghz: f64, temperature_k: f64, salinity_psu: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let e0 = pure_water_stogryn95(t) * (-3.564_17e-3 * s + 4.748_68e-6 * s * s + 1.155_74e-5 * t * s).exp();
    let n1 = (45.0 + t) / (5.0478 - 0.070_315 * t + 6.0059e-4 * t * t) * (1.0 + s * (2.393_57e-3 - 3.1353e-5 * t + 2.524_77e-7 * t * t));
    let e1 = (5.723 + 0.022_379 * t - 7.1237e-4 * t * t) * (-6.289_08e-3 * s + 1.760_32e-4 * s * s - 9.221_44e-5 * t * s).exp();
    let n2 = (45.0 + t) / (0.136_52 + 1.4825e-3 * t + 2.4166e-4 * t * t) * (1.0 + s * (-1.997_23e-2 + 1.811_76e-4 * t));
    let e2 = (3.6143 + 0.028_841 * t) * (1.0 + s * (-2.042_65e-3 + 1.578_83e-4 * t));
    let conduction = CONDUCTION_GHZ_M_S * sea_water_conductivity_stogryn95(t, s) / freq_ghz;
    e2 + (e0 - e1) / Complex64::new(1.0, freq_ghz / n1) + (e1 - e2) / Complex64::new(1.0, freq_ghz / n2) - Complex64::new(0.0, conduction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conductivity_of_standard_sea_water() {
        assert!((sea_water_conductivity_stogryn95(15.0, 35.0) - 4.2914).abs() < 2e-4);
    }

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
                    assert!(f > 37.0 || relative < 0.04, "{f} GHz {t} K {s} psu: {a} {b}");
                }
            }
        }
    }
}
