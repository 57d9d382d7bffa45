//! The match to a target density of baselines in the u-v plane.
//!
//! The beam is the transform of the density of baselines, so both match where their beams match. The figure is the rms difference of the mean beam and
//! that of the target, out to the edge of the ring of directions. It compares densities on scales down to one over that radius, and it has a gradient,
//! which counts in u-v cells have not.

use super::kind::{Objective, Setting};
use super::residual::{GRID_STEP, Residual};
use crate::Result;
use crate::design::lobes::LobeGrid;
use crate::design::profile::Profile;

struct Density(Residual);

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    let grid = LobeGrid::new(0.0, setting.ring.outer, GRID_STEP);
    let Profile(points) = &setting.density;
    let wanted = |direction: [f64; 2]| beam_of(points, direction[0].hypot(direction[1]));
    Ok(Box::new(Density(Residual::new(&setting.views, &grid, wanted))))
}

/// Steps of the transform for each point of the profile, which is linear between its points.
const STEPS: usize = 8;

/// The beam of a density that depends on the length of the baseline alone: its Hankel transform.
fn beam_of(profile: &[(f64, f64)], radius: f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for pair in profile.windows(2) {
        let [(q0, d0), (q1, d1)] = [pair[0], pair[1]];
        for k in 0..STEPS {
            let part = (k as f64 + 0.5) / STEPS as f64;
            let (q, d) = (q0 + part * (q1 - q0), d0 + part * (d1 - d0));
            let share = d * q * (q1 - q0);
            total += share;
            sum += share * libm::j0(std::f64::consts::TAU * q * radius);
        }
    }
    sum / total
}

impl Objective for Density {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        Ok(self.0.rms(xy))
    }

    fn smooth(&mut self, xy: &[[f64; 2]], _doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        Some(self.0.gradient(xy, weight, gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beams_of_a_disc_and_of_a_gaussian_are_the_known_ones() {
        let Profile(disc) = Profile::uniform();
        for radius in [0.0, 0.3, 0.61, 1.7, 8.2] {
            let x = std::f64::consts::TAU * radius;
            let truth = if radius == 0.0 { 1.0 } else { 2.0 * libm::j1(x) / x };
            assert!((beam_of(&disc, radius) - truth).abs() < 2e-5, "{radius} {} {truth}", beam_of(&disc, radius));
        }
        // A narrow Gaussian is not cut by the edge. Its transform is a Gaussian of width 4 ln 2 / (pi fwhm).
        let Profile(gauss) = Profile::gaussian(0.3);
        for radius in [0.0, 0.5, 1.0, 2.0] {
            let truth = (-(std::f64::consts::PI * 0.3 * radius).powi(2) / (4.0 * std::f64::consts::LN_2)).exp();
            assert!((beam_of(&gauss, radius) - truth).abs() < 1e-3, "{radius} {} {truth}", beam_of(&gauss, radius));
        }
    }
}
