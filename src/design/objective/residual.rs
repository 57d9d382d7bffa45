//! The rms difference of the mean beam and a wanted beam.

use crate::design::beam_map::BeamMap;
use crate::design::lobes::LobeGrid;
use crate::design::views::View;

/// Distance of the directions. The square of the beam contains no wave shorter than one half.
pub(super) const GRID_STEP: f64 = 0.25;

/// The mean beam, and the one that is wanted.
pub(super) struct Residual {
    map: BeamMap,
    /// In the order of [`LobeGrid::directions`].
    wanted: Vec<f64>,
}

impl Residual {
    pub(super) fn new(views: &[View], grid: &LobeGrid, wanted: impl FnMut([f64; 2]) -> f64) -> Self {
        Self { map: BeamMap::new(views, grid), wanted: grid.directions().map(wanted).collect() }
    }

    /// The rms. The map then holds the differences.
    pub(super) fn rms(&mut self, xy: &[[f64; 2]]) -> f64 {
        self.map.set(xy);
        let (offset, mut sum) = (1.0 / (xy.len() as f64 - 1.0), 0.0);
        let mut wanted = self.wanted.iter();
        self.map.apply(|a| {
            *a -= offset + wanted.next().copied().unwrap_or(0.0);
            sum += *a * *a;
        });
        (sum / self.wanted.len() as f64).sqrt()
    }

    /// The rms, with its gradient times `weight` added to `gradient`.
    pub(super) fn gradient(&mut self, xy: &[[f64; 2]], weight: f64, gradient: &mut [[f64; 2]]) -> f64 {
        let rms = self.rms(xy);
        let factor = weight / (rms.max(f64::MIN_POSITIVE) * self.wanted.len() as f64);
        self.map.apply(|a| *a *= factor);
        self.map.add_gradient(gradient);
        rms
    }
}
