//! Antennas as seen from the source: projected on the aperture plane, once or at each integration of a track.

use crate::{ArrayLayout, CoveragePlan};

/// Antennas in wavelengths, from their mean, as each view of the observation sees them. A snapshot has one view, a track one for each integration.
pub(super) struct Plane {
    pub(super) views: Vec<Vec<[f64; 2]>>,
}

impl Plane {
    /// One view of a layout, along the boresight or from the zenith.
    pub(super) fn new(layout: &ArrayLayout, wavelength_m: f64) -> Self {
        let seen = layout.antennas().iter().map(|a| [0, 1].map(|k| a.position_m[k] / wavelength_m)).collect();
        Self::of(vec![seen])
    }

    /// The views of a track.
    pub(super) fn along(plan: &CoveragePlan, wavelength_m: f64) -> Self {
        Self::of(plan.views().map(|view| view.into_iter().map(|(_, p)| p.map(|v| v / wavelength_m)).collect()).collect())
    }

    /// Views of antennas in wavelengths from any origin.
    pub(super) fn of(mut views: Vec<Vec<[f64; 2]>>) -> Self {
        for view in &mut views {
            let n = view.len() as f64;
            let mean = [0, 1].map(|k| view.iter().map(|p| p[k]).sum::<f64>() / n);
            view.iter_mut().for_each(|p| *p = [p[0] - mean[0], p[1] - mean[1]]);
        }
        Self { views }
    }

    /// Number of antennas in all views together.
    pub(super) fn n_seen(&self) -> usize {
        self.views.iter().map(Vec::len).sum()
    }

    pub(super) fn pairs(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.views
            .iter()
            .flat_map(|xy| xy.iter().enumerate().flat_map(move |(i, a)| xy[i + 1..].iter().map(move |b| [b[0] - a[0], b[1] - a[1]])))
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
