//! Rows averaged over time, as far as no pixel of an image can tell.
//!
//! The joint solution of image and gains keeps its data in memory. While the Earth turns by so little that the phase of every pixel of the field
//! hardly changes, successive rows of a baseline hold the same data with other noise, and one average of them says as much. The number of the
//! averages does not grow with the number of integrations: it is given by the lengths of the tracks on the u-v plane.
//!
//! # Reference
//! Cotton 2009, Effects of baseline dependent time averaging of UV data, Obit memo 13 (averages whose length depends on the baseline).

use super::over_ranks::{begin, first_row};
use crate::Result;
use crate::closure::{SolutionInterval, TimeBins};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::{Array2, Array3, s};
use num_complex::{Complex32, Complex64};
use std::collections::BTreeMap;

/// Largest change of the phase of any pixel over an average, rad. A point at the corner of the field loses x^2 / 24 of its flux, 0.04 %.
const TURN_RAD: f64 = 0.1;
/// Rows of a block of averages.
const ROWS: usize = 4096;

/// Two antennas and a phase centre.
type Baseline = (u32, u32, u16);

/// How far rows may be averaged.
pub(super) struct Averages {
    /// Change of phase for a change of uvw, rad / m.
    rad_per_m: f64,
    bins: TimeBins,
    open: BTreeMap<Baseline, Open>,
    done: Vec<Row>,
}

/// Sums over the rows of an average.
struct Open {
    interval: i64,
    first_m: [f64; 3],
    integration_s: f64,
    rows: f64,
    uvw_m: [f64; 3],
    time_jd: f64,
    /// Sums of weight x visibility and of weights \[chan, pol\].
    vis: Array2<Complex64>,
    weight: Array2<f64>,
}

/// An average.
struct Row {
    baseline: Baseline,
    sums: Open,
}

impl Averages {
    /// For the pixels of a grid and gains that are constant over these intervals.
    pub(super) fn new(header: &VisibilityHeader, grid: &SkyGrid, solint: SolutionInterval) -> Self {
        let radius = (0.5 * grid.cell_rad * (grid.n_l as f64).hypot(grid.n_m as f64)).min(1.0);
        // The length of (l, m, n - 1) at the corner of the field.
        let reach = (2.0 * (1.0 - (1.0 - radius * radius).sqrt())).sqrt();
        let top_hz = header.spectrum.freq_hz().iter().copied().fold(0.0, f64::max);
        let rad_per_m = std::f64::consts::TAU * top_hz / SPEED_OF_LIGHT_M_S * reach;
        Self { rad_per_m, bins: TimeBins::new(solint), open: BTreeMap::new(), done: Vec::new() }
    }

    /// Call `work` with blocks of averages of a set. Data that are flagged or not finite have no part in them.
    ///
    /// # Errors
    /// The source fails, or an interval is shorter than an integration.
    pub(super) fn for_each(
        mut self,
        data: &mut dyn VisibilitySource,
        block_bytes: usize,
        mut work: impl FnMut(VisibilityBlock) -> Result<()>,
    ) -> Result<()> {
        let ranks = data.ranks();
        if ranks.size() > 1 {
            // Intervals begin with the first row of all processes.
            begin(&mut self.bins, &*ranks, first_row(data, |_, _| true))?;
        }
        for_each_block(data, block_bytes, |_, block| -> Result<()> {
            self.add(&block)?;
            if self.done.len() >= ROWS { work(self.take()?) } else { Ok(()) }
        })?;
        let open = std::mem::take(&mut self.open);
        self.done.extend(open.into_iter().map(|(baseline, sums)| Row { baseline, sums }));
        if self.done.is_empty() { Ok(()) } else { work(self.take()?) }
    }

    fn add(&mut self, block: &VisibilityBlock) -> Result<()> {
        let c = &block.coverage;
        for row in 0..block.n_rows() {
            let baseline = (c.ant1[row], c.ant2[row], c.phase_center[row]);
            let interval = self.bins.key(c.time_jd[row], c.integration_s[row])?;
            let uvw = [c.uvw_m[(row, 0)], c.uvw_m[(row, 1)], c.uvw_m[(row, 2)]];
            let rad_per_m = self.rad_per_m;
            let fits = |o: &Open| {
                let moved: f64 = o.first_m.iter().zip(uvw).map(|(a, b)| (a - b).powi(2)).sum();
                o.interval == interval && moved.sqrt() * rad_per_m <= TURN_RAD
            };
            if !self.open.get(&baseline).is_some_and(fits) {
                let shape = (block.vis.shape()[1], block.vis.shape()[2]);
                let new = Open {
                    interval,
                    first_m: uvw,
                    integration_s: c.integration_s[row],
                    rows: 0.0,
                    uvw_m: [0.0; 3],
                    time_jd: 0.0,
                    vis: Array2::zeros(shape),
                    weight: Array2::zeros(shape),
                };
                self.done.extend(self.open.insert(baseline, new).map(|sums| Row { baseline, sums }));
            }
            if let Some(open) = self.open.get_mut(&baseline) {
                open.add(block, row, uvw);
            }
        }
        Ok(())
    }

    /// The finished averages as a block.
    fn take(&mut self) -> Result<VisibilityBlock> {
        let rows = std::mem::take(&mut self.done);
        let (n_chan, n_pol) = rows.first().map_or((0, 0), |r| r.sums.vis.dim());
        let shape = (rows.len(), n_chan, n_pol);
        let (mut vis, mut weights) = (Array3::<Complex32>::zeros(shape), Array3::<f32>::zeros(shape));
        for (k, Row { sums, .. }) in rows.iter().enumerate() {
            for (at, weight) in sums.weight.indexed_iter().filter(|(_, w)| **w > 0.0) {
                let mean = sums.vis[at] / *weight;
                vis[(k, at.0, at.1)] = Complex32::new(mean.re as f32, mean.im as f32);
                weights[(k, at.0, at.1)] = *weight as f32;
            }
        }
        let coverage = UvCoverage::new(
            Array2::from_shape_fn((rows.len(), 3), |(k, axis)| rows[k].sums.uvw_m[axis] / rows[k].sums.rows),
            rows.iter().map(|r| r.baseline.0).collect(),
            rows.iter().map(|r| r.baseline.1).collect(),
            rows.iter().map(|r| r.sums.time_jd / r.sums.rows).collect(),
            rows.iter().map(|r| r.sums.integration_s).collect(),
            rows.iter().map(|r| r.baseline.2).collect(),
        )?;
        let flags = weights.mapv(|w| !(w > 0.0));
        let nsamples = weights.mapv(|w| f32::from(u8::from(w > 0.0)));
        Ok(VisibilityBlock::new(coverage, vis, weights, flags, nsamples)?)
    }
}

impl Open {
    fn add(&mut self, block: &VisibilityBlock, row: usize, uvw: [f64; 3]) {
        self.rows += 1.0;
        self.uvw_m.iter_mut().zip(uvw).for_each(|(sum, x)| *sum += x);
        self.time_jd += block.coverage.time_jd[row];
        let (vis, weights) = (block.vis.slice(s![row, .., ..]), block.weights.slice(s![row, .., ..]));
        for (at, v) in vis.indexed_iter() {
            let w = weights[at];
            if !block.flags[(row, at.0, at.1)] && w > 0.0 && w.is_finite() && v.re.is_finite() && v.im.is_finite() {
                self.vis[at] += Complex64::new(v.re.into(), v.im.into()) * f64::from(w);
                self.weight[at] += f64::from(w);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, repeated, snapshot};
    use cittert_arrays::{Polarization, SkyFrame, VisUnit, VisibilitySet};

    fn tracked(times: usize, step_m: f64) -> VisibilitySet {
        let places = positions(5, 50.0, 0.0, 1);
        let set = snapshot(&places, &[1e9, 1.1e9], &[Polarization::I], &[(1e-3, 2e-3, 2.0)], (0.1, VisUnit::Jy));
        repeated(set, times, step_m)
    }

    fn averaged(set: &mut VisibilitySet, grid: &SkyGrid, solint: SolutionInterval) -> Vec<VisibilityBlock> {
        let mut blocks = Vec::new();
        Averages::new(&set.header.clone(), grid, solint)
            .for_each(set, 2000, |block| {
                blocks.push(block);
                Ok(())
            })
            .unwrap();
        blocks
    }

    #[test]
    fn rows_are_averaged_while_no_pixel_turns_and_weights_add_up() {
        let grid = SkyGrid::new(100, 100, 1e-4, SkyFrame::Boresight).unwrap();
        // The corner is 7.07e-3 rad away: 0.1 rad of phase at 1.1 GHz is 0.61 m.
        for (step_m, averages) in [(0.0, 1), (0.05, 1), (0.2, 3), (1.0, 12)] {
            let mut set = tracked(12, step_m);
            let total: f64 = set.data.weights.iter().map(|w| f64::from(*w)).sum();
            let blocks = averaged(&mut set, &grid, SolutionInterval::Infinite);
            let rows: usize = blocks.iter().map(VisibilityBlock::n_rows).sum();
            assert_eq!(rows, 10 * averages, "{step_m}");
            let kept: f64 = blocks.iter().flat_map(|b| &b.weights).map(|w| f64::from(*w)).sum();
            assert!((kept / total - 1.0).abs() < 1e-6, "{step_m}");
            let u = |b: &UvCoverage, r: usize| b.uvw_m[(r, 0)];
            let sum: f64 =
                blocks.iter().map(|b| (0..b.n_rows()).map(|r| u(&b.coverage, r)).sum::<f64>()).sum::<f64>() * 12.0 / averages as f64;
            let wanted: f64 = (0..set.data.n_rows()).map(|r| u(&set.data.coverage, r)).sum();
            assert!((sum - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{step_m}: {sum} {wanted}");
        }
    }

    #[test]
    fn an_average_stays_within_a_solution_interval_and_leaves_flagged_data_out() {
        let grid = SkyGrid::new(100, 100, 1e-4, SkyFrame::Boresight).unwrap();
        let mut set = tracked(12, 0.0);
        set.data.flags[(0, 1, 0)] = true;
        set.data.vis[(0, 1, 0)] = Complex32::new(f32::NAN, 0.0);
        let blocks = averaged(&mut set, &grid, SolutionInterval::Seconds(30.0));
        assert_eq!(blocks.iter().map(VisibilityBlock::n_rows).sum::<usize>(), 40);
        assert!(blocks.iter().flat_map(|b| &b.vis).all(|v| v.re.is_finite()));
        let first = &blocks[0];
        assert!((first.weights[(0, 1, 0)] / first.weights[(0, 0, 0)] - 2.0 / 3.0).abs() < 1e-6);
        assert!((first.vis[(0, 0, 0)] - set.data.vis[(0, 0, 0)]).norm() < 1e-6);
        assert_eq!(
            averaged(&mut tracked(12, 0.0), &grid, SolutionInterval::Integration).iter().map(VisibilityBlock::n_rows).sum::<usize>(),
            120
        );
    }
}
