//! Where a scattering medium sends radiation: the phase matrix, averaged over azimuth.
//!
//! A scatterer without preferred direction is given by two amplitudes against the scattering angle: `S1` across the plane of scattering and
//! `S2` in it. `|S1|^2`, `|S2|^2` and `Re S1 S2*` are coefficients of power in 1/m. With `p_s`, `q_i` the unit vectors of polarisation of the
//! scattered and the incident ray, the phase matrix is
//!
//! `P_pq = <(S1 A + S2 B)^2>`, `A = (p_s.e)(q_i.e)`, `B = (p_s.e_s)(q_i.e_i)`,
//!
//! with `e` the normal of the plane of scattering and `e_s`, `e_i` the directions across the rays in it. The equation of transfer has
//! `1/(4 pi) int P I dOmega`.

use super::matrix::Matrix;
use super::streams::MediumStreams;
use std::f64::consts::PI;

/// Steps of azimuth over half a turn. The rule is exact for phase matrices of harmonics up to twice this number.
const AZIMUTHS: usize = 24;

/// `|S1|^2`, `|S2|^2` and `Re S1 S2*` at a scattering angle, 1/m.
pub(super) type Powers = [f64; 3];

/// Coupling of streams: from the stream of a column to that of a row, in the same and in the opposite sense of direction, 1/m. Each value
/// has the weight of the column. Streams are counted as `2 i + p`, with `p` 0 for h and 1 for v. // [stream pol, stream pol]
#[derive(Debug)]
pub(super) struct Coupling {
    pub forward: Matrix,
    pub backward: Matrix,
}

/// The coupling of streams by a scatterer whose powers are given against the cosine of the scattering angle.
pub(super) fn coupling(streams: &MediumStreams, powers: impl Fn(f64) -> Powers) -> Coupling {
    let n = streams.mu.len();
    let mut forward = Matrix::zeros(2 * n, 2 * n);
    let mut backward = Matrix::zeros(2 * n, 2 * n);
    for i in 0..n {
        for j in 0..n {
            for (sense, out) in [(1.0, &mut forward), (-1.0, &mut backward)] {
                // The matrix is symmetric, so half of it is computed.
                let mean = if j <= i { azimuth_mean(sense * streams.mu[i], streams.mu[j], &powers) } else { [[0.0; 2]; 2] };
                for p in 0..2 {
                    for q in 0..2 {
                        if j <= i {
                            out[(2 * i + p, 2 * j + q)] = mean[p][q];
                            out[(2 * j + q, 2 * i + p)] = mean[p][q];
                        }
                    }
                }
            }
        }
    }
    let weights: Vec<f64> = streams.weight.iter().flat_map(|w| [0.5 * w; 2]).collect();
    Coupling { forward: forward.scale_columns(&weights), backward: backward.scale_columns(&weights) }
}

/// Mean of the phase matrix over azimuth, `[scattered][incident]`, each h and v.
fn azimuth_mean(mu_s: f64, mu_i: f64, powers: &impl Fn(f64) -> Powers) -> [[f64; 2]; 2] {
    let mut sum = [[0.0; 2]; 2];
    for k in 0..=AZIMUTHS {
        let weight = if k == 0 || k == AZIMUTHS { 0.5 } else { 1.0 } / AZIMUTHS as f64;
        let matrix = phase_matrix(mu_s, mu_i, PI * k as f64 / AZIMUTHS as f64, powers);
        for p in 0..2 {
            for q in 0..2 {
                sum[p][q] += weight * matrix[p][q];
            }
        }
    }
    sum
}

/// The phase matrix from direction cosine `mu_i` to `mu_s` at an angle between their azimuths.
fn phase_matrix(mu_s: f64, mu_i: f64, azimuth: f64, powers: &impl Fn(f64) -> Powers) -> [[f64; 2]; 2] {
    let (sin_s, sin_i) = ((1.0 - mu_s * mu_s).max(0.0).sqrt(), (1.0 - mu_i * mu_i).max(0.0).sqrt());
    let (sin_a, cos_a) = azimuth.sin_cos();
    let (ray_s, ray_i) = ([sin_s * cos_a, sin_s * sin_a, mu_s], [sin_i, 0.0, mu_i]);
    // h lies across the vertical, v = h x k.
    let (h_s, h_i) = ([-sin_a, cos_a, 0.0], [0.0, 1.0, 0.0]);
    let (v_s, v_i) = (cross(h_s, ray_s), cross(h_i, ray_i));
    let normal = cross(ray_i, ray_s);
    let size = dot(normal, normal).sqrt();
    // Straight on and straight back there is no plane of scattering, and any will do.
    let normal = if size > 1e-9 { normal.map(|x| x / size) } else { h_i };
    let (across_s, across_i) = (cross(normal, ray_s), cross(normal, ray_i));
    let [s1, s2, s12] = powers(dot(ray_s, ray_i).clamp(-1.0, 1.0));
    let mut out = [[0.0; 2]; 2];
    for (p, pol_s) in [h_s, v_s].into_iter().enumerate() {
        for (q, pol_i) in [h_i, v_i].into_iter().enumerate() {
            let a = dot(pol_s, normal) * dot(pol_i, normal);
            let b = dot(pol_s, across_s) * dot(pol_i, across_i);
            out[p][q] = s1 * a * a + s2 * b * b + 2.0 * s12 * a * b;
        }
    }
    out
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::super::streams::{StreamOptions, Streams};
    use super::*;

    /// The azimuth mean of the Rayleigh phase matrix for unit dipoles (Chandrasekhar 1960, section 16; Tsang, Kong & Shin 1985, p. 157).
    #[test]
    fn dipoles_have_the_matrix_of_rayleigh() {
        let dipole = |cos: f64| [1.0, cos * cos, cos];
        for (mu_s, mu_i) in [(0.3, 0.8), (-0.6, 0.2), (1.0, 1.0), (-1.0, 1.0), (0.7, 1e-6)] {
            let mean = azimuth_mean(mu_s, mu_i, &dipole);
            let (s2, i2): (f64, f64) = (mu_s * mu_s, mu_i * mu_i);
            let expected = [[0.5, 0.5 * i2], [0.5 * s2, 0.5 * s2 * i2 + (1.0 - s2) * (1.0 - i2)]];
            for p in 0..2 {
                for q in 0..2 {
                    assert!((mean[p][q] - expected[p][q]).abs() < 1e-12, "{mu_s} {mu_i} {p}{q}: {} {}", mean[p][q], expected[p][q]);
                }
            }
        }
    }

    #[test]
    fn streams_lose_what_the_dipoles_scatter() {
        let streams = Streams::new(&[1.3], StreamOptions::default()).of(1.3);
        let c = coupling(&streams, |cos| [1.0, cos * cos, cos]);
        // 1/(4 pi) of the integral of 1 + cos^2, half for each polarisation.
        for (f, b) in c.forward.row_sums().iter().zip(c.backward.row_sums()) {
            assert!((f + b - 2.0 / 3.0).abs() < 1e-9, "{}", f + b);
        }
    }
}
