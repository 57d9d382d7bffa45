//! Components as they leave a run of CLEAN.

use crate::deconvolve::Component;
use cittert_arrays::SkyGrid;
use std::collections::BTreeMap;

/// A component with its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CleanComponent {
    /// Output channel.
    pub channel: usize,
    /// Direction cosines of its centre.
    pub l: f64,
    /// See `l`.
    pub m: f64,
    /// Flux: Jy, or K sr.
    pub flux: f64,
    /// Width of its scale, rad; 0 for a point.
    pub scale_rad: f64,
}

/// Components of one place and scale as one.
pub(super) fn merged(grid: &SkyGrid, channel: usize, components: impl Iterator<Item = Component>) -> Vec<CleanComponent> {
    let mut sums: BTreeMap<(usize, usize, u64), f64> = BTreeMap::new();
    for c in components {
        *sums.entry((c.row, c.column, c.scale_px.to_bits())).or_default() += c.flux;
    }
    let place = |((row, column, scale), flux): ((usize, usize, u64), f64)| CleanComponent {
        channel,
        l: grid.l_at(column as f64),
        m: grid.m_at(row as f64),
        flux,
        scale_rad: f64::from_bits(scale) * grid.cell_rad,
    };
    sums.into_iter().map(place).collect()
}

/// Lists of components as one list, brightest first; those of one place and scale become one.
#[must_use]
pub fn joined(lists: impl IntoIterator<Item = CleanComponent>) -> Vec<CleanComponent> {
    let mut sums: BTreeMap<(usize, u64, u64, u64), CleanComponent> = BTreeMap::new();
    for c in lists {
        let key = (c.channel, c.l.to_bits(), c.m.to_bits(), c.scale_rad.to_bits());
        sums.entry(key).and_modify(|all| all.flux += c.flux).or_insert(c);
    }
    let mut all: Vec<CleanComponent> = sums.into_values().filter(|c| c.flux != 0.0).collect();
    all.sort_by(|a, b| b.flux.abs().total_cmp(&a.flux.abs()));
    all
}
