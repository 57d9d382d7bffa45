//! The number of different baselines, and the fraction of the u-v disc that they fill.

use super::plane::Plane;
use crate::ArrayLayout;
use std::collections::{HashMap, HashSet};

/// Cells of twice the tolerance, with the baselines in them.
type Cells = HashMap<[i64; 3], Vec<[f64; 3]>>;

/// Number of baselines (either direction) that differ by more than `tolerance_m`.
pub(super) fn unique_baselines(layout: &ArrayLayout, tolerance_m: f64) -> usize {
    let antennas = layout.antennas();
    let mut seen = Cells::new();
    let mut unique = 0;
    for (i, a) in antennas.iter().enumerate() {
        for b in &antennas[i + 1..] {
            let baseline = [0, 1, 2].map(|k| b.position_m[k] - a.position_m[k]);
            if !near(&seen, baseline, tolerance_m) && !near(&seen, baseline.map(|v| -v), tolerance_m) {
                let key = baseline.map(|v| (v / (2.0 * tolerance_m)).floor() as i64);
                seen.entry(key).or_default().push(baseline);
                unique += 1;
            }
        }
    }
    unique
}

/// True where a baseline within the tolerance is known. Such a baseline lies in the same cell or, along each axis, in the nearer
/// neighbouring cell.
fn near(seen: &Cells, b: [f64; 3], tolerance: f64) -> bool {
    let scaled = b.map(|v| v / (2.0 * tolerance));
    let sides = scaled.map(|v| {
        let cell = v.floor();
        [cell as i64, if v - cell < 0.5 { (cell as i64).saturating_sub(1) } else { (cell as i64).saturating_add(1) }]
    });
    (0..8_usize).any(|n| {
        let key = [0, 1, 2].map(|k| sides[k][n >> k & 1]);
        let within = |o: &[f64; 3]| (0..3).map(|k| (o[k] - b[k]).powi(2)).sum::<f64>() <= tolerance * tolerance;
        seen.get(&key).is_some_and(|v| v.iter().any(within))
    })
}

/// Number of cells that contain a baseline or its opposite, divided by the number of cells in the disc of the longest baseline.
pub(super) fn uv_fill(plane: &Plane, cell: f64) -> f64 {
    let mut hit = HashSet::new();
    for [u, v] in plane.pairs() {
        for s in [1.0, -1.0] {
            hit.insert(((s * u / cell).round() as i64, (s * v / cell).round() as i64));
        }
    }
    let radius = plane.longest() / cell;
    // A small disc has few cells. Each cell counts by the fraction of it inside the disc, so the sum is the area of the disc.
    let cells = (std::f64::consts::PI * radius * radius).max(hit.len() as f64);
    hit.len() as f64 / cells
}
