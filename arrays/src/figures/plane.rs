//! Antennas projected on the aperture plane.

use crate::ArrayLayout;

/// Antennas projected on the aperture plane, from their mean, in wavelengths.
pub(super) struct Plane {
    pub(super) xy: Vec<[f64; 2]>,
}

impl Plane {
    pub(super) fn new(layout: &ArrayLayout, wavelength_m: f64) -> Self {
        let n = layout.n_ant() as f64;
        let mean = [0, 1].map(|k| layout.antennas().iter().map(|a| a.position_m[k]).sum::<f64>() / n);
        Self { xy: layout.antennas().iter().map(|a| [0, 1].map(|k| (a.position_m[k] - mean[k]) / wavelength_m)).collect() }
    }

    pub(super) fn pairs(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.xy.iter().enumerate().flat_map(|(i, a)| self.xy[i + 1..].iter().map(move |b| [b[0] - a[0], b[1] - a[1]]))
    }

    /// Shortest projected baseline, wavelengths; pairs along the line of sight do not count.
    pub(super) fn shortest(&self) -> f64 {
        let longest = self.longest();
        self.pairs().map(|[u, v]| u.hypot(v)).filter(|d| *d > 1e-9 * longest).fold(longest, f64::min)
    }

    pub(super) fn longest(&self) -> f64 {
        self.pairs().map(|[u, v]| u.hypot(v)).fold(0.0, f64::max)
    }
}
