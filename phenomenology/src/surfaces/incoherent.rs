//! Stacks of layers that are too thick or uneven for interference. Powers are added.

use super::fresnel::{Reflection, interface, medium};
use super::layer::Layer;
use num_complex::Complex64;

/// One interface and the layer below it.
struct Step {
    /// Amplitudes of the interface, `[h, v]`.
    r: [Complex64; 2],
    /// One-way power transmission of the layer below; 0 for the last.
    transmission: f64,
}

fn step(layers: &[Layer], n: usize, k0: f64, cos_theta: f64) -> Step {
    let (eps1, q1) = medium(layers, n, cos_theta);
    let (_, q2) = medium(layers, n + 1, cos_theta);
    let below = &layers[n];
    let transmission = if n + 1 == layers.len() { 0.0 } else { (2.0 * k0 * q2.im * below.thickness_m).exp() };
    Step { r: interface(eps1, q1, below.eps, q2), transmission }
}

/// Reflection of the stack. All orders of multiple reflections are summed in closed form.
///
/// The amplitudes have the phase of the top interface and the power of the whole stack. The cross term is the same sum as the powers.
///
/// # Reference
/// `R <- G + (1-G)^2 R L^2/(1 - G R L^2)` bottom up (Ulaby, Moore & Fung 1981, section 4-14).
/// `1-G` as transmission is exact above lossless layers only.
pub(super) fn incoherent_reflection(layers: &[Layer], k0: f64, cos_theta: f64) -> Reflection {
    let mut power = [0.0; 2];
    let mut cross = Complex64::new(0.0, 0.0);
    let mut top = [Complex64::new(0.0, 0.0); 2];
    for n in (0..layers.len()).rev() {
        let Step { r, transmission } = step(layers, n, k0, cos_theta);
        let two_way = transmission * transmission;
        for p in 0..2 {
            let g = r[p].norm_sqr();
            let x = power[p] * two_way;
            let rest = 1.0 - g * x;
            power[p] = if rest > 0.0 { g + (1.0 - g) * (1.0 - g) * x / rest } else { 1.0 };
        }
        let c = r[1] * r[0].conj();
        let x = cross * two_way;
        let through = (1.0 - r[1] * r[1]) * (1.0 - r[0] * r[0]).conj();
        cross = c + through * x / (1.0 - c * x);
        top = r;
    }
    let phase = |r: Complex64| {
        let size = r.norm();
        if size > 0.0 { r / size } else { Complex64::new(1.0, 0.0) }
    };
    let largest = (power[0] * power[1]).sqrt();
    if cross.norm() > largest || cross.is_nan() {
        cross = phase(top[1] * top[0].conj()) * largest;
    }
    Reflection { r_h: phase(top[0]) * power[0].sqrt(), r_v: phase(top[1]) * power[1].sqrt(), power_h: power[0], power_v: power[1], cross }
}

/// Weight of the temperature of each layer in the emission, `[h, v]` from the top.
///
/// The power that leaves a layer upward is the emission of the layer upward, its emission downward after reflection below, and the power
/// transmitted from below. It passes the interface above after any number of reflections.
pub(super) fn incoherent_absorption(layers: &[Layer], k0: f64, cos_theta: f64) -> Vec<[f64; 2]> {
    let count = layers.len();
    let mut weights = vec![[0.0; 2]; count];
    let mut below = [0.0; 2];
    for n in (0..count).rev() {
        let Step { r, transmission: l } = step(layers, n, k0, cos_theta);
        for p in 0..2 {
            let g = r[p].norm_sqr();
            let x = below[p] * l * l;
            let rest = 1.0 - g * x;
            let out = if rest > 0.0 { (1.0 - g) / rest } else { 0.0 };
            weights[n][p] = (1.0 - l) * (1.0 + l * below[p]) * out;
            for w in &mut weights[n + 1..] {
                w[p] *= l * out;
            }
            below[p] = if rest > 0.0 { g + (1.0 - g) * (1.0 - g) * x / rest } else { 1.0 };
        }
    }
    weights
}
