//! How much a scene varies, from the data: the multiplier of chi squared that belongs to the expectation of a smooth scene.
//!
//! Where the scene departs from its prior as a Gaussian field of the spectrum s(u), a visibility is a complex Gaussian number of the variance sum A^2 s(u) plus that of the
//! noise, with the response A of the elements. The likelihood of all |V|^2 is highest at the amplitude that is looked for (type II maximum likelihood). Baselines that
//! see patches of the size of the elements' beam do not count, because the level of the prior is uncertain there. The power of the prior itself, which has
//! edges where the image ends, is a part of what is expected.
//!
//! # Reference
//! MacKay 1992, Neural Computation 4, 415 (the evidence); Whittle 1953, Ark. Mat. 2, 423 (the likelihood of a spectrum).

use super::beam::BeamHessian;
use super::response::Response;
use super::statistics::PowerBin;
use std::f64::consts::TAU;

/// Baselines count that see patches of less than the width of what the elements see, divided by this.
const PATCHES: f64 = 1.5;
/// Steps of the search for the best amplitude. Each makes the interval of its logarithm smaller by a factor of 0.618.
const STEPS: usize = 60;
/// Logarithm of the likelihood that a smooth scene must have above one that does not vary at all: three standard deviations of one parameter.
const SIGNIFICANT: f64 = 4.5;
/// Logarithms of the least and largest variance of a pixel, in units of the squared prior.
const RANGE: (f64, f64) = (-30.0, 12.0);

/// What the data say about the variation of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fluctuations {
    /// Variance of a pixel in units of the squared mean prior, before neighbours are taken to be alike: the multiplier of chi squared in units of the mean
    /// prior.
    pub(super) lambda: f64,
    /// True if the data are more likely from a smooth scene than from one whose pixels are independent, and significantly so than from one that is flat.
    pub(super) smooth: bool,
}

/// The number of pixels that the elements see of an image of this shape \[m, l\]: the sum of their response.
fn seen(response: &Response, (n_m, n_l): (usize, usize)) -> f64 {
    response.plane().map_or((n_m * n_l) as f64, |r| r.iter().map(|r| f64::from(*r)).sum())
}

/// Factor of the squared differences of neighbours for a field that is smooth on all scales below the width of what the elements see of an image \[m, l\]:
/// 1 / (2 pi k0 cell)^2 with k0 = 1 / width. No baseline measures larger scales, so nothing else is expected of them than of that width.
pub(super) fn strength(response: &Response, shape: (usize, usize)) -> f64 {
    seen(response, shape) / (TAU * TAU)
}

/// Mean over the Fourier components of 1 / (1 + strength c): variance of a pixel over the variance for c = 0.
pub(super) fn mean_spectrum(beam: &BeamHessian, strength: f64) -> f64 {
    let differences = beam.differences();
    let sum: f64 = differences.values().iter().map(|c| 1.0 / (1.0 + strength * f64::from(*c))).sum();
    sum / differences.values().len().max(1) as f64
}

impl Fluctuations {
    /// From the power of the visibilities against the length of their baselines, for an image of a shape \[m, l\]. `unit` is the mean of the prior in flux a pixel,
    /// and `cell` the size of a pixel in radians. `None` if no baseline says anything.
    pub(super) fn of(bins: &[PowerBin], response: &Response, shape: (usize, usize), (unit, cell): (f64, f64)) -> Option<Self> {
        let pixels = (shape.0 * shape.1) as f64;
        // The solid angle of what the elements see and that of its square, in pixels.
        let (seen, squares) = response
            .plane()
            .map_or((pixels, pixels), |r| (r.iter().map(|r| f64::from(*r)).sum(), r.iter().map(|r| f64::from(*r).powi(2)).sum()));
        let shortest = PATCHES / (seen.sqrt() * cell);
        let strength = strength(response, shape);
        // Number, power, noise and power of the prior of each bin, in units of the squared mean prior, and its squared difference of neighbours.
        let squared = unit * unit;
        let terms: Vec<[f64; 5]> = bins
            .iter()
            .filter(|b| b.length > shortest)
            .map(|b| [b.count, b.power / squared, b.noise / squared, b.known / squared, (TAU * b.length * cell).powi(2)])
            .collect();
        if terms.is_empty() {
            return None;
        }
        // Minus the logarithm of the likelihood, for the logarithm of the variance.
        let unlikely = |log: f64, strength: f64| -> f64 {
            let variance = log.exp() * squares;
            let one = |[count, power, noise, known, c]: &[f64; 5]| {
                let expected = noise + known + variance / (1.0 + strength * c);
                // Without noise, a scene that does not vary makes no power at all.
                if expected > 0.0 { count * (expected.ln() + power / expected) } else { f64::INFINITY }
            };
            terms.iter().map(one).sum()
        };
        let (smooth, alone) = (lowest(|x| unlikely(x, strength)), lowest(|x| unlikely(x, 0.0)));
        let nothing = unlikely(f64::NEG_INFINITY, 0.0);
        let is_smooth = smooth.1 < alone.1 && smooth.1 < nothing - SIGNIFICANT;
        let best = if smooth.1 < alone.1 { smooth.0 } else { alone.0 };
        Some(Self { lambda: best.exp(), smooth: is_smooth })
    }
}

/// Place and value of the minimum of a function over [`RANGE`], by golden sections.
fn lowest(f: impl Fn(f64) -> f64) -> (f64, f64) {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = RANGE;
    let (mut x, mut y) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..STEPS {
        if b - a < 1e-3 {
            break;
        }
        if fx < fy {
            (b, y, fy) = (y, x, fx);
            x = b - ratio * (b - a);
            fx = f(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + ratio * (b - a);
            fy = f(y);
        }
    }
    if fx < fy { (x, fx) } else { (y, fy) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mem::power_plane::PowerPlane;
    use cittert_arrays::{SkyFrame, SkyGrid};
    use ndarray::Array2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Exp1};

    const N: usize = 64;
    const CELL: f64 = 1e-3;

    fn beam() -> (SkyGrid, BeamHessian) {
        let grid = SkyGrid::new(N, N, CELL, SkyFrame::Boresight).unwrap();
        let mut point = Array2::zeros((2 * N, 2 * N));
        point[(N, N)] = 1.0_f32;
        let beam = BeamHessian::of_beam(&grid, point, 1.0);
        (grid, beam)
    }

    fn found(bins: &[PowerBin]) -> Fluctuations {
        Fluctuations::of(bins, &Response::default(), (N, N), (1.0, CELL)).unwrap()
    }

    /// The mean power of `count` visibilities on baselines of each length, where the variance of a pixel is `variance` for the largest patches.
    fn observed(rng: &mut ChaCha8Rng, (variance, strength): (f64, f64), noise: f64) -> Vec<PowerBin> {
        (0..30)
            .map(|k| {
                let length = 20.0 * 1.1_f64.powi(k);
                let signal = variance * (N * N) as f64 / (1.0 + strength * (TAU * length * CELL).powi(2));
                let count = 400;
                let draws: f64 = (0..count).map(|_| -> f64 { Exp1.sample(rng) }).sum();
                PowerBin { length, count: f64::from(count), power: (signal + noise) * draws / f64::from(count), noise, known: 0.0 }
            })
            .collect()
    }

    #[test]
    fn the_amplitude_and_the_kind_of_a_field_are_found() {
        let (_, beam) = beam();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (smooth, variance, noise) in
            [(true, 100.0, 10.0), (true, 3000.0, 0.0), (true, 2.0, 30.0), (false, 0.5, 100.0), (false, 20.0, 1.0)]
        {
            let strength = if smooth { strength(&Response::default(), (N, N)) } else { 0.0 };
            let found = found(&observed(&mut rng, (variance, strength), noise));
            assert_eq!(found.smooth, smooth, "{variance}: {found:?}");
            assert!((found.lambda / variance).ln().abs() < 0.1, "{variance}: {found:?}");
        }
        // Noise alone has no fluctuations.
        let nothing = found(&observed(&mut rng, (0.0, 0.0), 5.0));
        assert!(!nothing.smooth, "{nothing:?}");
        assert!(nothing.lambda * mean_spectrum(&beam, strength(&Response::default(), (N, N))) * ((N * N) as f64) < 0.2, "{nothing:?}");
    }

    #[test]
    fn the_edges_of_the_prior_are_no_fluctuation() {
        let (grid, beam) = beam();
        let plane = PowerPlane::of(&beam, &grid, Array2::from_elem((N, N), 1.0).view());
        // The transform of a uniform square is a product of sin(pi N x) / sin(pi x) along both axes.
        let side = |x: f64| if x.abs() < 1e-9 { N as f64 } else { (TAU * 0.5 * N as f64 * x).sin() / (TAU * 0.5 * x).sin() };
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let (white, count) = (300.0, 400);
        let bins: Vec<PowerBin> = (0..30)
            .map(|k| {
                let length = 30.0 * 1.09_f64.powi(k);
                let mut bin = PowerBin { length, count: f64::from(count), noise: 1.0, ..PowerBin::default() };
                for _ in 0..count {
                    let (length, angle) = (length * rng.random_range(0.96..1.04), rng.random_range(0.0..TAU));
                    let (v, u) = angle.sin_cos();
                    bin.power += ((side(length * u * CELL) * side(length * v * CELL)).powi(2) + white) / f64::from(count);
                    bin.known += plane.at(length * u, length * v) / f64::from(count);
                }
                bin
            })
            .collect();
        let seen = found(&bins);
        // What is left is the white power of independent pixels.
        assert!(!seen.smooth && (seen.lambda * (N * N) as f64 / white - 1.0).abs() < 0.2, "{}", seen.lambda * (N * N) as f64);
        let blind: Vec<PowerBin> = bins.iter().map(|b| PowerBin { known: 0.0, ..*b }).collect();
        assert!(found(&blind).smooth);
    }
}
