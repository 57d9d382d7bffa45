//! The components of a run of CLEAN.

use crate::deconvolve::Component;
use cittert_arrays::SkyGrid;
use std::collections::BTreeMap;

/// A component with its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CleanComponent {
    /// Output channel.
    pub channel: usize,
    /// Direction cosine l of its centre.
    pub l: f64,
    /// Direction cosine m of its centre.
    pub m: f64,
    /// Flux: Jy, or K sr.
    pub flux: f64,
    /// Width of its scale, rad; 0 for a point.
    pub scale_rad: f64,
}

impl CleanComponent {
    /// A component of an output channel on the grid of the image.
    pub(super) fn on(grid: &SkyGrid, channel: usize, c: Component) -> Self {
        let (l, m) = (grid.l_at(c.column as f64), grid.m_at(c.row as f64));
        Self { channel, l, m, flux: c.flux, scale_rad: c.scale_px * grid.cell_rad }
    }
}

/// Channel, position and scale of a component, as the bits of the numbers.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    channel: usize,
    m: u64,
    l: u64,
    scale: u64,
}

/// Sum the components with the same channel, position and scale. The result is ordered by flux, brightest first.
#[must_use]
pub fn joined(components: impl IntoIterator<Item = CleanComponent>) -> Vec<CleanComponent> {
    let mut sums: BTreeMap<Place, CleanComponent> = BTreeMap::new();
    for c in components {
        let place = Place { channel: c.channel, m: c.m.to_bits(), l: c.l.to_bits(), scale: c.scale_rad.to_bits() };
        sums.entry(place).and_modify(|all| all.flux += c.flux).or_insert(c);
    }
    let mut all: Vec<CleanComponent> = sums.into_values().filter(|c| c.flux != 0.0).collect();
    all.sort_by(|a, b| b.flux.abs().total_cmp(&a.flux.abs()));
    all
}
