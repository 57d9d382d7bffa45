//! Stacks of layers that are too thick or uneven for interference. Powers are added.
//!
//! The phase of the passage through each layer is uniform and independent at each order of reflection. With `a` the amplitude of an
//! interface, `z` that of the wave which returns to it from below and `X = |z|^2`, the mean over the phase of `z` of the exact amplitude
//! `r = a + (1 - a^2) z/(1 + a z)` is
//!
//! `<|r|^2> = |a|^2 + |1 - a^2|^2 X/(1 - |a|^2 X)`, `<r> = a`, `<|1 + a z|^-2> = 1/(1 - |a|^2 X)`.
//!
//! `|1 - a^2|^2` is the passage down and up. It is `(1 - |a|^2)^2` only between lossless media. In a lossy medium the flux is not
//! the difference of the powers of the two waves, so the fluxes below carry the mean of the interference between them.

use super::fresnel::{Reflection, interface, medium};
use super::layer::Layer;
use num_complex::Complex64;

/// One interface with all that lies below it, of one polarisation.
#[derive(Debug, Clone, Copy, Default)]
struct Below {
    /// Mean power of the reflected wave, of unit incident power.
    power: f64,
    /// Mean flux downward through the interface, of a wave of unit tangential field.
    flux: f64,
    /// Power of the downward wave at the bottom of the next layer, of unit power above the interface.
    gain: f64,
}

/// The interface on top of `below`. `a` is its amplitude, `admittances` are those above and below it, `transmission` is the one-way power
/// of the layer below, 0 for the half-space.
fn add_interface(below: Below, a: Complex64, admittances: [Complex64; 2], transmission: f64) -> Below {
    let [y1, y2] = admittances;
    let g = a.norm_sqr();
    if transmission == 0.0 {
        return Below { power: g, flux: (1.0 + a).norm_sqr() * y2.re, gain: 0.0 };
    }
    let x = below.power * transmission * transmission;
    let rest = 1.0 - g * x;
    if rest <= 0.0 {
        return Below { power: 1.0, ..Below::default() };
    }
    let gain = (1.0 + a).norm_sqr() * transmission / rest;
    let power = g + (1.0 - a * a).norm_sqr() * x / rest;
    let flux = y1.re * (1.0 - power) + 2.0 * y1.im * a.im;
    if flux >= 0.0 || y1.re <= 0.0 {
        return Below { power, flux, gain };
    }
    // A film of high loss that is thinner than a wavelength has no free phase: the mean can reflect more than enters.
    Below { power: (power + flux / y1.re).max(0.0), flux: 0.0, gain }
}

/// Goes through the interfaces from the last up. `visit` receives the number of the layer below each with its amplitudes, its two-way
/// power and the sums `[h, v]`.
fn walk(layers: &[Layer], k0: f64, cos_theta: f64, mut visit: impl FnMut(usize, [Complex64; 2], f64, [Below; 2])) -> [Below; 2] {
    let mut below = [Below::default(); 2];
    for n in (0..layers.len()).rev() {
        let (eps1, q1) = medium(layers, n, cos_theta);
        let (eps2, q2) = medium(layers, n + 1, cos_theta);
        let a = interface(eps1, q1, eps2, q2);
        let transmission = if n + 1 == layers.len() { 0.0 } else { (2.0 * k0 * q2.im * layers[n].thickness_m).exp() };
        let admittances = [[q1, q2], [q1 / eps1, q2 / eps2]];
        for p in 0..2 {
            below[p] = add_interface(below[p], a[p], admittances[p], transmission);
        }
        visit(n, a, transmission * transmission, below);
    }
    below.map(|b| Below { power: b.power.clamp(0.0, 1.0), ..b })
}

/// Reflection of the stack. All orders of multiple reflections are summed in closed form.
///
/// The amplitudes have the phase of the top interface and the power of the whole stack. The cross term is the same sum as the powers.
///
/// # Reference
/// `R <- |a|^2 + |1-a^2|^2 R L^2/(1 - |a|^2 R L^2)` bottom up: Ulaby, Moore & Fung 1981, section 4-14, with the passage of Byrnes 2016,
/// arXiv:1603.02720, section 9, which holds for lossy layers.
pub(super) fn incoherent_reflection(layers: &[Layer], k0: f64, cos_theta: f64) -> Reflection {
    let mut cross = Complex64::new(0.0, 0.0);
    let mut top = [Complex64::new(0.0, 0.0); 2];
    let power = walk(layers, k0, cos_theta, |_, a, two_way, _| {
        let c = a[1] * a[0].conj();
        let x = cross * two_way;
        let through = (1.0 - a[1] * a[1]) * (1.0 - a[0] * a[0]).conj();
        cross = c + through * x / (1.0 - c * x);
        top = a;
    })
    .map(|b| b.power);
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

/// Fraction of the power absorbed in each layer, `[h, v]` from the top. By reciprocity it is the weight of the temperature of the layer.
///
/// It is the difference of the mean fluxes through the two borders of the layer. The sum of the fractions and the reflectivity is 1.
/// A film without free phase, where the difference can be negative, absorbs nothing, and what lies below it the rest.
pub(super) fn incoherent_absorption(layers: &[Layer], k0: f64, cos_theta: f64) -> Vec<[f64; 2]> {
    let mut sums = vec![[Below::default(); 2]; layers.len()];
    let top = walk(layers, k0, cos_theta, |n, _, _, below| sums[n] = below);
    let mut absorbed = vec![[0.0; 2]; layers.len()];
    for p in 0..2 {
        let mut flux_in = 1.0 - top[p].power;
        // Power of the downward wave just above the interface below the layer.
        let mut down = 1.0 / cos_theta;
        for n in 0..layers.len() {
            down *= sums[n][p].gain;
            let flux_out = sums.get(n + 1).map_or(0.0, |s| (down * s[p].flux).clamp(0.0, flux_in));
            absorbed[n][p] = flux_in - flux_out;
            flux_in = flux_out;
        }
    }
    absorbed
}
