//! Array factors in single directions.

use std::f64::consts::TAU;

/// The phasors cos and sin of 2 pi x (k + 1/2) step for k in 0..count. Each one is the one before, turned; the rounding of all turns together
/// is below 1e-13 for a thousand.
pub(super) fn phasors(x: f64, step: f64, count: usize) -> impl Iterator<Item = (f64, f64)> {
    let ((turn_s, turn_c), (s, c)) = ((TAU * x * step).sin_cos(), (0.5 * TAU * x * step).sin_cos());
    std::iter::successors(Some((c, s)), move |(c, s)| Some((c * turn_c - s * turn_s, s * turn_c + c * turn_s))).take(count)
}

/// The sum of the phasors of antennas in a direction.
#[must_use]
pub fn array_factor(xy: &[[f64; 2]], [l, m]: [f64; 2]) -> (f64, f64) {
    xy.iter().fold((0.0, 0.0), |(re, im), p| {
        let (s, c) = (TAU * (p[0] * l + p[1] * m)).sin_cos();
        (re + c, im + s)
    })
}

/// The beam of naturally weighted baselines without autocorrelations, (|AF|^2 - N) / (N (N - 1)), 1 in its centre.
#[must_use]
pub fn beam(xy: &[[f64; 2]], direction: [f64; 2]) -> f64 {
    let (n, (re, im)) = (xy.len() as f64, array_factor(xy, direction));
    (re * re + im * im - n) / (n * (n - 1.0))
}

/// |AF|^2 in a direction, with its gradient by the positions written to `gradient`.
pub(super) fn power_gradient(xy: &[[f64; 2]], [l, m]: [f64; 2], gradient: &mut [[f64; 2]]) -> f64 {
    // First the phasors, then their products with the sum of all.
    for (p, g) in xy.iter().zip(gradient.iter_mut()) {
        let (s, c) = (TAU * (p[0] * l + p[1] * m)).sin_cos();
        *g = [c, s];
    }
    let (re, im) = gradient.iter().fold((0.0, 0.0), |(re, im), g| (re + g[0], im + g[1]));
    for g in gradient.iter_mut() {
        let common = -2.0 * TAU * (re * g[1] - im * g[0]);
        *g = [common * l, common * m];
    }
    re * re + im * im
}
