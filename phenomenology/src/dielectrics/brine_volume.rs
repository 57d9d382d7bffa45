//! Volume fraction of brine in sea ice.

use crate::constants::ZERO_CELSIUS_K;

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
