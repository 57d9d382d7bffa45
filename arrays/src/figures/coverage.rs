//! The number of different baselines, and the fraction of the u-v disc that they fill.

use super::plane::Plane;
use crate::ArrayLayout;
use std::collections::HashMap;

/// Cells of twice the tolerance, with the baselines in them and their numbers.
type Cells = HashMap<[i64; 3], Vec<([f64; 3], usize)>>;

/// A number for each pair of antennas, in the order of [`Plane::pairs`]: the same for baselines (in either direction) within `tolerance_m`.
/// The numbers run from 0 without a gap.
pub(super) fn different_baselines(layout: &ArrayLayout, tolerance_m: f64) -> Vec<usize> {
    let antennas = layout.antennas();
    let mut seen = Cells::new();
    let mut different = 0;
    let mut numbers = Vec::with_capacity(layout.n_baselines());
    for (i, a) in antennas.iter().enumerate() {
        for b in &antennas[i + 1..] {
            let baseline = [0, 1, 2].map(|k| b.position_m[k] - a.position_m[k]);
            let known = near(&seen, baseline, tolerance_m).or_else(|| near(&seen, baseline.map(|v| -v), tolerance_m));
            numbers.push(known.unwrap_or_else(|| {
                let key = baseline.map(|v| (v / (2.0 * tolerance_m)).floor() as i64);
                seen.entry(key).or_default().push((baseline, different));
                different += 1;
                different - 1
            }));
        }
    }
    numbers
}

/// The number of a known baseline within the tolerance. Such a baseline lies in the same cell or, along each axis, in the nearer
/// neighbouring cell.
fn near(seen: &Cells, b: [f64; 3], tolerance: f64) -> Option<usize> {
    let scaled = b.map(|v| v / (2.0 * tolerance));
    let sides = scaled.map(|v| {
        let cell = v.floor();
        [cell as i64, if v - cell < 0.5 { (cell as i64).saturating_sub(1) } else { (cell as i64).saturating_add(1) }]
    });
    (0..8_usize).find_map(|n| {
        let key = [0, 1, 2].map(|k| sides[k][n >> k & 1]);
        let within = |o: &&([f64; 3], usize)| (0..3).map(|k| (o.0[k] - b[k]).powi(2)).sum::<f64>() <= tolerance * tolerance;
        seen.get(&key).and_then(|v| v.iter().find(within)).map(|found| found.1)
    })
}

/// Numbers of the u-v cells that each pair of antennas hits, one for the baseline and one for its opposite. The numbers run from 0.
pub(super) fn uv_cells(plane: &Plane, cell: f64) -> Vec<[usize; 2]> {
    let mut known: HashMap<[i64; 2], usize> = HashMap::new();
    let mut number = |sign: f64, [u, v]: [f64; 2]| {
        let next = known.len();
        *known.entry([u, v].map(|x| (sign * x / cell).round() as i64)).or_insert(next)
    };
    plane.pairs().map(|p| [number(1.0, p), number(-1.0, p)]).collect()
}

/// Number of cells that are hit over the number of cells in a disc; radius and cell in wavelengths.
pub(super) fn uv_fill(hit: usize, radius: f64, cell: f64) -> f64 {
    let radius = radius / cell;
    // A small disc has few cells. Each cell counts by the fraction of it inside the disc, so the sum is the area of the disc.
    hit as f64 / (std::f64::consts::PI * radius * radius).max(hit as f64)
}
