//! The transfer function of the whole sensor: optics, footprint of the detector, and the path that a sample moves during its dwell.

use super::transfer::Transfer;
use crate::{ChainError, Result, ensure};
use num_complex::Complex64;

/// Most widths of the finest detail of the optics in a cell.
const COARSEST: f64 = 64.0;

/// sin(pi x) / (pi x).
pub(super) fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

/// A straight path (x, y) on the sky, rad, over which a sample is averaged evenly. A square detector is two of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Path(pub(super) f64, pub(super) f64);

impl Path {
    /// Transfer function at spatial frequencies in cycles/rad.
    pub(super) fn at(self, u: f64, v: f64) -> f64 {
        sinc(u * self.0 + v * self.1)
    }
}

/// Optics and paths.
#[derive(Debug)]
pub(super) struct Response {
    pub(super) optics: Transfer,
    pub(super) paths: Vec<Path>,
}

impl Response {
    /// Transfer function at spatial frequencies in cycles/rad.
    pub(super) fn at(&self, u: f64, v: f64) -> Complex64 {
        let path: f64 = self.paths.iter().map(|path| path.at(u, v)).product();
        if path == 0.0 { Complex64::default() } else { self.optics.at(u, v) * path }
    }

    /// The response as weights of pixels.
    ///
    /// # Errors
    /// Pixels that are much coarser than the optics.
    pub(super) fn sampled(&self, cell_rad: f64) -> Result<Sampled<'_>> {
        let finest = 1.0 / self.optics.cutoff();
        ensure!(
            cell_rad <= COARSEST * finest,
            ChainError::Incompatible(format!(
                "pixels of {cell_rad:.3e} rad are more than {COARSEST} times as wide as the finest detail that the aperture passes, {finest:.3e} rad: \
                 use a finer image, or an aperture that is smaller"
            ))
        );
        let mut sampled = Sampled { of: self, cell_rad, norm: 1.0 };
        sampled.norm = sampled.at(0.0, 0.0).re;
        Ok(sampled)
    }
}

/// The response at the centres of pixels: its Fourier transform repeats, and the repetitions add up. They overlap only where pixels are too coarse
/// for the optics. The weights are never negative, since they are values of a PSF, and their sum is 1.
#[derive(Debug)]
pub(super) struct Sampled<'a> {
    of: &'a Response,
    cell_rad: f64,
    norm: f64,
}

impl Sampled<'_> {
    /// Transfer function at frequencies in cycles a pixel.
    pub(super) fn at(&self, u: f64, v: f64) -> Complex64 {
        let reach = self.of.optics.cutoff() * self.cell_rad;
        let orders = |f: f64| (-reach - f).ceil() as i64..=(reach - f).floor() as i64;
        let mut sum = Complex64::default();
        for j in orders(v) {
            for i in orders(u) {
                sum += self.of.at((u + i as f64) / self.cell_rad, (v + j as f64) / self.cell_rad);
            }
        }
        sum / self.norm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_detector_is_the_sinc_of_the_fourier_integral() {
        let width = 2e-3;
        let square = [Path(width, 0.0), Path(0.0, width)];
        for (u, v) in [(0.0, 0.0), (100.0, 0.0), (120.0, -310.0), (500.0, 500.0), (1e-6, 740.0)] {
            let n = 4000;
            // The mean of exp(-2 pi i (u x + v y)) over the square, by the midpoint rule.
            let mean = |f: f64| {
                (0..n).map(|k| (std::f64::consts::TAU * f * width * ((k as f64 + 0.5) / n as f64 - 0.5)).cos()).sum::<f64>() / n as f64
            };
            let found: f64 = square.iter().map(|path| path.at(u, v)).product();
            assert!((found - mean(u) * mean(v)).abs() < 1e-6, "{u} {v}: {found}");
        }
    }
}
