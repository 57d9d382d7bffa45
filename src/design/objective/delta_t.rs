//! The noise of the image in kelvin, relative to elements that fill the disc evenly.
//!
//! The noise of the brightness temperature is Tsys lambda^2 / (A sqrt(N (N - 1) B t) Omega), where A is the area of an element, B the bandwidth, t the
//! time and Omega the solid angle of the main lobe (Thompson, Moran & Swenson 2017, section 6.2; Ruf et al. 1988, IEEE Trans. Geosci. Remote Sens. 26,
//! 597). Of a layout it depends on Omega alone. Near its centre the beam falls as the second moments of the positions say, and a Gaussian of this
//! curvature has an Omega of one over the root of their determinant. In an evenly filled disc each second moment is 1/16 of the square of the
//! aperture, so the figure is 16 sqrt(det) in apertures.

use super::kind::{Objective, Setting};
use crate::Result;

struct DeltaT;

pub(super) fn make(_setting: &Setting) -> Result<Box<dyn Objective>> {
    Ok(Box::new(DeltaT))
}

/// The mean position and the second moments about it: xx, xy, yy.
fn moments(xy: &[[f64; 2]]) -> ([f64; 2], [f64; 3]) {
    let n = xy.len() as f64;
    let mean = [0, 1].map(|k| xy.iter().map(|p| p[k]).sum::<f64>() / n);
    let second = |i: usize, j: usize| xy.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>() / n;
    (mean, [second(0, 0), second(0, 1), second(1, 1)])
}

impl Objective for DeltaT {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        let (_, [xx, cross, yy]) = moments(xy);
        Ok(16.0 * (xx * yy - cross * cross).max(0.0).sqrt())
    }

    fn smooth(&mut self, xy: &[[f64; 2]], _doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        let (mean, [xx, cross, yy]) = moments(xy);
        let root = (xx * yy - cross * cross).max(1e-30).sqrt();
        let factor = weight * 16.0 / (root * xy.len() as f64);
        for (g, p) in gradient.iter_mut().zip(xy) {
            let (x, y) = (p[0] - mean[0], p[1] - mean[1]);
            *g = [g[0] + factor * (yy * x - cross * y), g[1] + factor * (xx * y - cross * x)];
        }
        Some(16.0 * root)
    }
}
