//! Visibilities through patterns that differ from antenna to antenna: V_pq = sum of S E_p E_q exp(2 pi i (u l + v m + w (n - 1))), with the
//! voltages E of the two patterns.
//!
//! Every baseline sees a scene of its own, so one Fourier transform does not serve them all. The sums are exact.

use super::analytic::Seen;
use super::dft::{Cells, n_minus_1, sum_cells};
use crate::Result;
use crate::fourier::phasor::uniform_step;
use cittert_arrays::pattern::Pointings;
use cittert_arrays::{ElementPattern, SPEED_OF_LIGHT_M_S, SkyGrid, UvCoverage};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;
use std::collections::BTreeMap;

/// Cells whose voltages are held at a time. Those of 100 antennas take 13 MB.
const CELLS: usize = 16_384;

/// The patterns of the antennas over time.
#[derive(Debug, Clone)]
pub(super) struct AntennaPatterns {
    pub(super) common: ElementPattern,
    pointings: Pointings,
    /// The first interval with the same pointings \[time\].
    same_as: Vec<usize>,
}

impl AntennaPatterns {
    pub(super) fn new(common: ElementPattern, pointings: Pointings) -> Self {
        let rows = &pointings.antennas;
        let mut same_as: Vec<usize> = Vec::with_capacity(rows.nrows());
        for t in 0..rows.nrows() {
            same_as.push(if t > 0 && rows.row(t) == rows.row(t - 1) { same_as[t - 1] } else { t });
        }
        Self { common, pointings, same_as }
    }

    /// The rows of each interval, with the antennas that they use.
    fn groups(&self, rows: &UvCoverage, of: &[usize]) -> Vec<Group> {
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for row in of {
            groups.entry(self.same_as[self.pointings.index_at(rows.time_jd[*row])]).or_default().push(*row);
        }
        let group = |(time, members): (usize, Vec<usize>)| {
            let mut antennas: Vec<usize> = members.iter().flat_map(|r| [rows.ant1[*r] as usize, rows.ant2[*r] as usize]).collect();
            antennas.sort_unstable();
            antennas.dedup();
            Group { time, rows: members, antennas }
        };
        groups.into_iter().map(group).collect()
    }

    /// Voltages of some antennas in some directions \[ant\]\[direction\]; empty for the other antennas.
    fn voltages(&self, group: &Group, freq_hz: f64, toward: &[[f64; 3]]) -> Vec<Vec<f64>> {
        let mut all = vec![Vec::new(); self.pointings.antennas.ncols()];
        let found: Vec<Vec<f64>> = group
            .antennas
            .par_iter()
            .map(|ant| self.pointings.voltages(&self.common, (group.time, *ant), freq_hz, toward.iter().copied()).collect())
            .collect();
        for (ant, v) in group.antennas.iter().zip(found) {
            all[*ant] = v;
        }
        all
    }
}

/// Rows whose antennas have the same patterns.
struct Group {
    time: usize,
    rows: Vec<usize>,
    antennas: Vec<usize>,
}

/// Visibilities \[row, freq\] of a plane \[m, l\] of values per cell before the pattern. The pattern is that at `pattern_hz`.
///
/// # Errors
/// The plane has another shape than the grid.
pub(super) fn image_through(
    patterns: &AntennaPatterns,
    (grid, plane): (&SkyGrid, ArrayView2<'_, f64>),
    coverage: &UvCoverage,
    (freq_hz, pattern_hz): (&[f64], f64),
    w_term: bool,
) -> Result<Array2<Complex64>> {
    let step = uniform_step(freq_hz);
    let all = Cells::of(grid, plane);
    let rows: Vec<usize> = (0..coverage.n_rows()).collect();
    let mut out = Array2::zeros((coverage.n_rows(), freq_hz.len()));
    for group in patterns.groups(coverage, &rows) {
        let mut start = 0;
        while start < all.len() {
            let cells = all.part(start..(start + CELLS).min(all.len()));
            start += CELLS;
            let voltages = patterns.voltages(&group, pattern_hz, &cells.directions());
            let sums: Vec<Vec<Complex64>> = group
                .rows
                .par_iter()
                .map(|row| {
                    let (e1, e2) = (&voltages[coverage.ant1[*row] as usize], &voltages[coverage.ant2[*row] as usize]);
                    let seen: Vec<f64> = cells.values().iter().zip(e1.iter().zip(e2)).map(|(v, (a, b))| v * a * b).collect();
                    let uvw = coverage.uvw_m.row(*row);
                    let mut sum = vec![Complex64::ZERO; freq_hz.len()];
                    let w = if w_term { uvw[2] } else { 0.0 };
                    sum_cells(&cells, &seen, [uvw[0], uvw[1], w], freq_hz, step, &mut |c, v| sum[c] += v);
                    sum
                })
                .collect();
            for (row, sum) in group.rows.iter().zip(sums) {
                out.row_mut(*row).iter_mut().zip(sum).for_each(|(o, v)| *o += v);
            }
        }
    }
    Ok(out)
}

/// Visibilities \[row of `rows`, freq\] of sources; `amplitude(source, freq)` gives the flux density before the pattern.
pub(super) fn sources_through<S: AsRef<Seen> + Sync>(
    patterns: &AntennaPatterns,
    sources: &[S],
    (coverage, rows): (&UvCoverage, &[usize]),
    freq_hz: &[f64],
    w_term: bool,
    amplitude: impl Fn(&S, f64) -> f64 + Sync,
) -> Array2<Complex64> {
    let flux = Array2::from_shape_fn((freq_hz.len(), sources.len()), |(c, s)| amplitude(&sources[s], freq_hz[c]));
    let toward: Vec<[f64; 3]> = sources.iter().map(AsRef::as_ref).map(|s| [s.l, s.m, 1.0 + n_minus_1(s.l, s.m).unwrap_or(-1.0)]).collect();
    let place: BTreeMap<usize, usize> = rows.iter().enumerate().map(|(k, r)| (*r, k)).collect();
    let mut out = Array2::zeros((rows.len(), freq_hz.len()));
    for group in patterns.groups(coverage, rows) {
        for (c, freq) in freq_hz.iter().enumerate() {
            let voltages = patterns.voltages(&group, *freq, &toward);
            let sums: Vec<Complex64> = group
                .rows
                .par_iter()
                .map(|row| {
                    let uvw: [f64; 3] = std::array::from_fn(|k| coverage.uvw_m[[*row, k]] / SPEED_OF_LIGHT_M_S);
                    let (e1, e2) = (&voltages[coverage.ant1[*row] as usize], &voltages[coverage.ant2[*row] as usize]);
                    let of = |(k, s): (usize, &S)| s.as_ref().phasor(uvw, *freq, w_term) * (flux[[c, k]] * e1[k] * e2[k]);
                    sources.iter().enumerate().map(of).sum()
                })
                .collect();
            for (row, sum) in group.rows.iter().zip(sums) {
                out[[place[row], c]] = sum;
            }
        }
    }
    out
}
