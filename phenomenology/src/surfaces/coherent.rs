//! Stacks of smooth layers with interference between the layers.
//!
//! Media are numbered 0 (air), 1..N (the layers); interface `n` lies between `n` and `n+1`.

use super::fresnel::{Reflection, interface, medium, normal_wavenumber};
use super::layer::Layer;
use num_complex::Complex64;

const J: Complex64 = Complex64::new(0.0, 1.0);

/// Round-trip phase and attenuation of a layer, `exp(-2 j k0 q d)`.
fn round_trip(q: Complex64, layer: &Layer, k0: f64) -> Complex64 {
    (-2.0 * J * q * (k0 * layer.thickness_m)).exp()
}

/// Reflection of the stack, bottom up.
///
/// # Reference
/// The recursion `r <- (r01 + r x)/(1 + r01 r x)`, `x = exp(-2 j k0 q d)`; the same as the
/// product of 2 x 2 transfer matrices (Born & Wolf, section 1.6).
pub(super) fn coherent_reflection(layers: &[Layer], k0: f64, cos_theta: f64) -> Reflection {
    let [r_h, r_v] = generalised(layers, k0, cos_theta, |_, _| ());
    Reflection::from_amplitudes(r_h, r_v)
}

/// Runs the recursion. `visit` receives every interface with its amplitudes, from the last interface up.
fn generalised(layers: &[Layer], k0: f64, cos_theta: f64, mut visit: impl FnMut(usize, [Complex64; 2])) -> [Complex64; 2] {
    let last = layers.len() - 1;
    let (mut eps2, mut q2) = medium(layers, last + 1, cos_theta);
    let mut r = [Complex64::new(0.0, 0.0); 2];
    for n in (0..=last).rev() {
        let (eps1, q1) = medium(layers, n, cos_theta);
        let step = interface(eps1, q1, eps2, q2);
        if n == last {
            r = step;
        } else {
            let x = round_trip(q2, &layers[n], k0);
            for p in 0..2 {
                r[p] = (step[p] + r[p] * x) / (1.0 + step[p] * r[p] * x);
            }
        }
        visit(n, r);
        (eps2, q2) = (eps1, q1);
    }
    r
}

/// Fraction of the power absorbed in each layer, `[h, v]` for every layer from the top.
///
/// By reciprocity this is also the weight of the temperature of the layer in the emission. The sum of the weights and the reflectivity
/// is 1.
pub(super) fn coherent_absorption(layers: &[Layer], k0: f64, cos_theta: f64) -> Vec<[f64; 2]> {
    let count = layers.len();
    let sin2 = 1.0 - cos_theta * cos_theta;
    let mut gamma = vec![[Complex64::new(0.0, 0.0); 2]; count];
    let top = generalised(layers, k0, cos_theta, |n, r| gamma[n] = r);
    let mut absorbed = vec![[0.0; 2]; count];
    for p in 0..2 {
        // Downward flux through the upper border of each layer, of unit incident flux.
        let mut flux_in = 1.0 - top[p].norm_sqr();
        // Tangential field (E for h, H for v) there.
        let mut field = 1.0 + top[p];
        for n in 0..count {
            if n + 1 == count {
                absorbed[n][p] = flux_in;
                break;
            }
            let layer = &layers[n];
            let q = normal_wavenumber(layer.eps, sin2);
            let x = gamma[n + 1][p] * round_trip(q, layer, k0);
            let down = field / (1.0 + x) * (-J * q * (k0 * layer.thickness_m)).exp();
            let g = gamma[n + 1][p];
            let flux = if p == 0 { ((1.0 + g) * (q * (1.0 - g)).conj()).re } else { ((q / layer.eps) * (1.0 - g) * (1.0 + g).conj()).re };
            let flux_out = down.norm_sqr() * flux / cos_theta;
            absorbed[n][p] = flux_in - flux_out;
            flux_in = flux_out;
            field = down * (1.0 + g);
        }
    }
    absorbed
}
