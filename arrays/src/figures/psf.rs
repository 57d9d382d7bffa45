//! The beam of an array by direct sums.
//!
//! With natural weights and no autocorrelations the beam of N antennas is (|AF|^2 - N) / (N (N - 1)), where AF is the sum of the antennas'
//! phasors, so each point of the beam costs N multiplications. With other weights it is the sum of the baselines' cosines. Over a band and a
//! track it is the mean over all baselines of the channels and integrations, each of which is a view: the antennas in wavelengths, as seen from
//! the source.

use super::plane::Plane;
use super::weights;
use crate::Weighting;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Baselines that are summed at once, so that their phasors stay in the cache.
const CHUNK: usize = 1024;

/// A beam with its peak of 1 at the centre.
pub(super) struct Psf {
    sum: Sum,
}

enum Sum {
    /// Antennas in wavelengths from their mean, in each view, and 1 over the number of their pairs in both orders.
    Antennas { views: Vec<Vec<[f64; 2]>>, norm: f64 },
    /// Baselines u, v in wavelengths of their channels, with weights whose sum is 1.
    Baselines { uv: Vec<[f64; 2]>, weights: Vec<f64> },
}

/// Value, gradient and second derivatives (ll, lm, mm) of the beam.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Curve {
    pub value: f64,
    pub gradient: [f64; 2],
    pub hessian: [f64; 3],
}

impl Psf {
    /// The beam at one frequency with natural weights.
    pub(super) fn natural(xy: &[[f64; 2]]) -> Self {
        Self::of_views(vec![xy.to_vec()])
    }

    /// The beam of all views with natural weights.
    fn of_views(views: Vec<Vec<[f64; 2]>>) -> Self {
        let pairs: f64 = views.iter().map(|v| v.len() as f64 * (v.len() as f64 - 1.0)).sum();
        Self { sum: Sum::Antennas { views, norm: 1.0 / pairs } }
    }

    /// The beam over channels at `scales` times the reference frequency. `cell` is the width of the cells of the weights in wavelengths.
    pub(super) fn weighted(plane: &Plane, scales: &[f64], weighting: Weighting, robust: f64, cell: f64) -> Self {
        if weighting == Weighting::Natural {
            let scaled = |s: &f64| plane.views.iter().map(|view| view.iter().map(|p| p.map(|v| v * s)).collect()).collect::<Vec<_>>();
            return Self::of_views(scales.iter().flat_map(scaled).collect());
        }
        let uv: Vec<[f64; 2]> = scales.iter().flat_map(|s| plane.pairs().map(move |p| p.map(|v| v * s))).collect();
        let weights = weights::of(&uv, weighting, robust, cell);
        Self { sum: Sum::Baselines { uv, weights } }
    }

    #[cfg(test)]
    pub(super) fn of_baselines(uv: Vec<[f64; 2]>, weights: Vec<f64>) -> Self {
        let total: f64 = weights.iter().sum();
        Self { sum: Sum::Baselines { uv, weights: weights.iter().map(|w| w / total).collect() } }
    }

    /// Number of phasors in the sum of one direction.
    pub(super) fn n_terms(&self) -> usize {
        match &self.sum {
            Sum::Antennas { views, .. } => views.iter().map(Vec::len).sum(),
            Sum::Baselines { uv, .. } => uv.len(),
        }
    }

    /// Mean of u u, u v, v v over the weighted baselines, wavelengths^2.
    pub(super) fn moments(&self) -> [f64; 3] {
        let product = |p: &[f64; 2]| [p[0] * p[0], p[0] * p[1], p[1] * p[1]];
        match &self.sum {
            Sum::Antennas { views, norm } => {
                // The baselines in both orders have 2 N times the moments of N antennas about their mean.
                let of = |xy: &Vec<[f64; 2]>, k: usize| 2.0 * xy.len() as f64 * xy.iter().map(|p| product(p)[k]).sum::<f64>();
                [0, 1, 2].map(|k| norm * views.iter().map(|xy| of(xy, k)).sum::<f64>())
            }
            Sum::Baselines { uv, weights } => [0, 1, 2].map(|k| uv.iter().zip(weights).map(|(p, w)| w * product(p)[k]).sum::<f64>()),
        }
    }

    /// The beam in the direction (l, m).
    pub(super) fn at(&self, l: f64, m: f64) -> f64 {
        match &self.sum {
            Sum::Antennas { views, norm } => {
                let one = |xy: &Vec<[f64; 2]>| {
                    let af: Complex64 = xy.iter().map(|p| Complex64::cis(TAU * (p[0] * l + p[1] * m))).sum();
                    af.norm_sqr() - xy.len() as f64
                };
                norm * views.iter().map(one).sum::<f64>()
            }
            Sum::Baselines { uv, weights } => uv.iter().zip(weights).map(|(p, w)| w * (TAU * (p[0] * l + p[1] * m)).cos()).sum(),
        }
    }

    /// The beam and its derivatives in the direction (l, m).
    pub(super) fn curve(&self, l: f64, m: f64) -> Curve {
        let mut out = Curve::default();
        match &self.sum {
            Sum::Antennas { views, norm } => {
                for xy in views {
                    // The sum of phasors, and its derivatives without their factors of i.
                    let (mut af, mut first, mut second) = (Complex64::ZERO, [Complex64::ZERO; 2], [Complex64::ZERO; 3]);
                    for p in xy {
                        let [x, y] = p.map(|v| TAU * v);
                        let z = Complex64::cis(x * l + y * m);
                        af += z;
                        first[0] += z * x;
                        first[1] += z * y;
                        second[0] += z * (x * x);
                        second[1] += z * (x * y);
                        second[2] += z * (y * y);
                    }
                    out.value += norm * (af.norm_sqr() - xy.len() as f64);
                    // d|AF|^2 = 2 Re(conj AF i F) = -2 Im(conj AF F).
                    out.gradient.iter_mut().zip(first).for_each(|(g, f)| *g -= norm * 2.0 * (af.conj() * f).im);
                    for (k, (a, b)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                        out.hessian[k] += norm * 2.0 * ((first[a].conj() * first[b]).re - (af.conj() * second[k]).re);
                    }
                }
            }
            Sum::Baselines { uv, weights } => {
                for (p, w) in uv.iter().zip(weights) {
                    let [x, y] = p.map(|v| TAU * v);
                    let (sin, cos) = (x * l + y * m).sin_cos();
                    out.value += w * cos;
                    out.gradient[0] -= w * x * sin;
                    out.gradient[1] -= w * y * sin;
                    out.hessian[0] -= w * x * x * cos;
                    out.hessian[1] -= w * x * y * cos;
                    out.hessian[2] -= w * y * y * cos;
                }
            }
        }
        out
    }

    /// The beam on the points i a + j b for i in -half..=half and j in 0..=half (the beam is even), \[j\]\[i\].
    pub(super) fn on_grid(&self, a: [f64; 2], b: [f64; 2], half: i64) -> Vec<Vec<f64>> {
        let width = (2 * half + 1) as usize;
        let mut out = vec![vec![0.0; width]; (half + 1) as usize];
        match &self.sum {
            Sum::Antennas { views, norm } => {
                for xy in views {
                    let n = xy.len() as f64;
                    // [i][antenna], so that the inner sum runs along memory.
                    let along: Vec<Vec<Complex64>> = (-half..=half).map(|i| xy.iter().map(|p| phasor(*p, a, i)).collect()).collect();
                    out.par_iter_mut().enumerate().for_each(|(j, row)| {
                        let across: Vec<Complex64> = xy.iter().map(|p| phasor(*p, b, j as i64)).collect();
                        for (value, column) in row.iter_mut().zip(&along) {
                            let af: Complex64 = column.iter().zip(&across).map(|(x, y)| x * y).sum();
                            *value += norm * (af.norm_sqr() - n);
                        }
                    });
                }
            }
            Sum::Baselines { uv, weights } => {
                for (uv, weights) in uv.chunks(CHUNK).zip(weights.chunks(CHUNK)) {
                    let along: Vec<Vec<Complex64>> = (-half..=half).map(|i| uv.iter().map(|p| phasor(*p, a, i)).collect()).collect();
                    out.par_iter_mut().enumerate().for_each(|(j, row)| {
                        let across: Vec<Complex64> = uv.iter().zip(weights).map(|(p, w)| phasor(*p, b, j as i64) * w).collect();
                        for (value, column) in row.iter_mut().zip(&along) {
                            *value += column.iter().zip(&across).map(|(x, y)| x.re * y.re - x.im * y.im).sum::<f64>();
                        }
                    });
                }
            }
        }
        out
    }
}

/// The phasor of a point (wavelengths) in the direction k times `step`.
pub(super) fn phasor(point: [f64; 2], step: [f64; 2], k: i64) -> Complex64 {
    Complex64::cis(TAU * (point[0] * step[0] + point[1] * step[1]) * k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> Plane {
        let xy: Vec<[f64; 2]> = (0..9).map(|k| [(f64::from(k * k) * 1.7) % 13.0, (f64::from(k) * 5.3) % 11.0]).collect();
        let mean = [0, 1].map(|k| xy.iter().map(|p| p[k]).sum::<f64>() / 9.0);
        Plane { views: vec![xy.iter().map(|p| [p[0] - mean[0], p[1] - mean[1]]).collect()] }
    }

    /// All pairs of antennas in both orders and all channels, without any shortcut.
    fn brute(plane: &Plane, scales: &[f64], l: f64, m: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for s in scales {
            for (i, a) in plane.views[0].iter().enumerate() {
                for (j, b) in plane.views[0].iter().enumerate() {
                    if i != j {
                        sum += (TAU * s * ((b[0] - a[0]) * l + (b[1] - a[1]) * m)).cos();
                        count += 1.0;
                    }
                }
            }
        }
        sum / count
    }

    #[test]
    fn the_sums_equal_a_sum_over_all_pairs() {
        let (plane, scales) = (plane(), [0.9, 1.0, 1.1]);
        // Cells so small that each baseline has its own: uniform weights are all alike.
        for weighting in [Weighting::Natural, Weighting::Uniform, Weighting::Briggs] {
            let psf = Psf::weighted(&plane, &scales, weighting, 0.0, 1e-6);
            let (a, b) = ([0.011, 0.002], [-0.003, 0.013]);
            let grid = psf.on_grid(a, b, 4);
            for (j, row) in grid.iter().enumerate() {
                for (i, value) in row.iter().enumerate() {
                    let (x, y) = (i as f64 - 4.0, j as f64);
                    let (l, m) = (x * a[0] + y * b[0], x * a[1] + y * b[1]);
                    let truth = brute(&plane, &scales, l, m);
                    assert!((value - truth).abs() < 1e-12 && (psf.at(l, m) - truth).abs() < 1e-12, "{weighting:?} {l} {m}");
                    assert!((psf.curve(l, m).value - truth).abs() < 1e-12);
                }
            }
        }
        // Natural weights, no zero spacing: nothing is lower than -1 / (N - 1).
        let psf = Psf::natural(&plane.views[0]);
        let lowest = (0..4000).map(|k| psf.at(f64::from(k) * 0.0007, f64::from(k * k % 997) * 0.001)).fold(1.0, f64::min);
        assert!((-1.0 / 8.0..0.0).contains(&lowest), "{lowest}");
    }

    #[test]
    fn derivatives_equal_differences() {
        let plane = plane();
        for (weighting, cell) in [(Weighting::Natural, 1.0), (Weighting::Uniform, 3.0)] {
            let psf = Psf::weighted(&plane, &[0.95, 1.05], weighting, 0.0, cell);
            let (l, m, h) = (0.031, -0.017, 1e-6);
            let c = psf.curve(l, m);
            let (right, up) = (psf.curve(l + h, m), psf.curve(l, m + h));
            let (left, down) = (psf.curve(l - h, m), psf.curve(l, m - h));
            let slopes = [(right.value - left.value) / (2.0 * h), (up.value - down.value) / (2.0 * h)];
            let seconds = [
                (right.gradient[0] - left.gradient[0]) / (2.0 * h),
                (right.gradient[1] - left.gradient[1]) / (2.0 * h),
                (up.gradient[1] - down.gradient[1]) / (2.0 * h),
            ];
            for (a, b) in c.gradient.iter().zip(slopes).chain(c.hessian.iter().zip(seconds)) {
                assert!((a - b).abs() < 1e-6 * a.abs().max(1.0), "{weighting:?}: {a} {b}");
            }
        }
    }
}
