//! How many different baselines there are, and how much of the u-v disc they fill.

use super::Plane;
use crate::ArrayLayout;
use std::collections::{HashMap, HashSet};

/// Number of baselines (either direction) that differ by more than `tolerance_m`.
pub(super) fn unique_baselines(layout: &ArrayLayout, tolerance_m: f64) -> usize {
    let antennas = layout.antennas();
    let key = |b: [f64; 3]| b.map(|v| (v / tolerance_m).floor() as i64);
    let mut seen: HashMap<[i64; 3], Vec<[f64; 3]>> = HashMap::new();
    let mut unique = 0;
    for (i, a) in antennas.iter().enumerate() {
        for b in &antennas[i + 1..] {
            let baseline = [0, 1, 2].map(|k| b.position_m[k] - a.position_m[k]);
            if !near(&seen, key, baseline, tolerance_m) && !near(&seen, key, baseline.map(|v| -v), tolerance_m) {
                seen.entry(key(baseline)).or_default().push(baseline);
                unique += 1;
            }
        }
    }
    unique
}

/// Whether a baseline within the tolerance is in the same cell or one beside it.
fn near(seen: &HashMap<[i64; 3], Vec<[f64; 3]>>, key: impl Fn([f64; 3]) -> [i64; 3], b: [f64; 3], tolerance: f64) -> bool {
    let [x, y, z] = key(b);
    (-1..=1).any(|i| {
        (-1..=1).any(|j| {
            (-1..=1).any(|k| {
                let cell = [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)];
                let within = |o: &[f64; 3]| (0..3).map(|n| (o[n] - b[n]).powi(2)).sum::<f64>() <= tolerance * tolerance;
                seen.get(&cell).is_some_and(|v| v.iter().any(within))
            })
        })
    })
}

/// Cells hit by a baseline or its opposite, over the cells of the disc of the longest baseline.
pub(super) fn uv_fill(plane: &Plane, cell: f64) -> f64 {
    let mut hit = HashSet::new();
    for [u, v] in plane.pairs() {
        for s in [1.0, -1.0] {
            hit.insert(((s * u / cell).round() as i64, (s * v / cell).round() as i64));
        }
    }
    let radius = plane.longest() / cell;
    // Small discs have few cells; a cell counts by the part of it that the disc covers, which is its area on the whole.
    let cells = (std::f64::consts::PI * radius * radius).max(hit.len() as f64);
    hit.len() as f64 / cells
}
