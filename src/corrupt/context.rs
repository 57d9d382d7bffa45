//! The properties of the set that an error may use.

use crate::linalg::solve_3;
use crate::random::stream;
use crate::{ChainError, Result};
use cittert_arrays::{ArrayError, ArrayLayout, LayoutFrame, UvCoverage, VisibilityHeader};
use rand_chacha::ChaCha8Rng;

/// The set, its integrations, and random numbers.
#[derive(Debug, Clone)]
pub struct Context<'a> {
    /// Header of the set.
    pub header: &'a VisibilityHeader,
    /// Midpoints of the integrations, Julian date UTC, in ascending order \[time\].
    pub time_jd: &'a [f64],
    /// The same times in s after the first one \[time\].
    pub seconds: &'a [f64],
    /// Lengths of the integrations, s \[time\].
    pub length_s: &'a [f64],
    /// Unit vector towards the phase centre in the axes of the layout \[time\]. It is empty if no error needs it.
    pub toward: &'a [[f64; 3]],
    /// Channels of the gains, Hz \[chan\].
    pub freq_hz: &'a [f64],
    /// Seed of all random numbers.
    pub seed: u64,
    /// Name of the kind of error.
    pub name: &'static str,
    /// Index of the error among the errors of the same kind.
    pub place: usize,
}

impl Context<'_> {
    /// The random numbers of this error for one item (an antenna, a baseline, a row).
    #[must_use]
    pub fn rng(&self, item: u64) -> ChaCha8Rng {
        stream(self.seed, &format!("{} {}", self.name, self.place), item)
    }

    /// Index of the integration at a time.
    #[must_use]
    pub fn time_index(&self, time_jd: f64) -> usize {
        nearest_index(self.time_jd, time_jd)
    }
}

/// Index of the value that is nearest to `x` in a list in ascending order; 0 for an empty list.
pub(crate) fn nearest_index(values: &[f64], x: f64) -> usize {
    let after = values.partition_point(|v| *v < x);
    match (after.checked_sub(1), values.get(after)) {
        (Some(before), Some(next)) if x - values[before] > next - x => after,
        (Some(before), _) => before,
        (None, _) => 0,
    }
}

/// One integration of a set.
#[derive(Debug, Clone)]
pub(crate) struct Integration {
    pub(crate) time_jd: f64,
    pub(crate) length_s: f64,
    /// Normal equations of the direction: upper triangle, right side.
    sums: [f64; 9],
}

/// Finds the integrations of a set, and the direction of the phase centre in each.
///
/// The direction follows from the data: w = (r2 - r1) . s for every row is solved for s by least squares.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    found: Vec<Integration>,
    index: std::collections::HashMap<u64, usize>,
}

/// Times that differ by less than this belong to one integration. Julian dates in f64 are accurate to 0.05 ms.
const SAME_TIME_S: f64 = 1e-3;

impl Survey {
    /// Add the rows of a block.
    ///
    /// # Errors
    /// A row has an antenna that the layout does not have.
    pub(crate) fn add(&mut self, coverage: &UvCoverage, layout: &ArrayLayout) -> Result<()> {
        let position = |index: u32| {
            let (index, len) = (index as usize, layout.n_ant());
            let antenna = layout.antennas().get(index).ok_or(ArrayError::OutOfRange { what: "antenna", index, len });
            antenna.map(|a| a.position_m)
        };
        for row in 0..coverage.n_rows() {
            let time_jd = coverage.time_jd[row];
            let k = *self.index.entry(time_jd.to_bits()).or_insert_with(|| {
                self.found.push(Integration { time_jd, length_s: 0.0, sums: [0.0; 9] });
                self.found.len() - 1
            });
            let found = &mut self.found[k];
            found.length_s = found.length_s.max(coverage.integration_s[row]);
            let (a, b) = (position(coverage.ant1[row])?, position(coverage.ant2[row])?);
            let d = [0, 1, 2].map(|k| b[k] - a[k]);
            let w = coverage.uvw_m[[row, 2]];
            let terms = [d[0] * d[0], d[0] * d[1], d[0] * d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2], d[0] * w, d[1] * w, d[2] * w];
            found.sums.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
        }
        Ok(())
    }

    /// The integrations in the order of time.
    pub(crate) fn finish(mut self) -> Vec<Integration> {
        self.found.sort_by(|a, b| a.time_jd.total_cmp(&b.time_jd));
        let mut merged: Vec<Integration> = Vec::with_capacity(self.found.len());
        for next in self.found {
            match merged.last_mut() {
                Some(last) if (next.time_jd - last.time_jd) * 86_400.0 < SAME_TIME_S => {
                    last.length_s = last.length_s.max(next.length_s);
                    last.sums.iter_mut().zip(next.sums).for_each(|(s, t)| *s += t);
                }
                _ => merged.push(next),
            }
        }
        merged
    }
}

/// Unit vector s towards the phase centre in an integration, from the normal equations of w = d . s.
///
/// If the antennas lie in a plane, which may be tilted, the baselines do not determine the component across it. It follows from the length of 1,
/// with the source on the upper side of the plane.
///
/// # Errors
/// The integration has no baseline between antennas at different positions.
pub(crate) fn direction(integration: &Integration, layout: &ArrayLayout) -> Result<[f64; 3]> {
    if matches!(layout.frame, LayoutFrame::Boresight) {
        return Ok([0.0, 0.0, 1.0]);
    }
    let [xx, xy, xz, yy, yz, zz, xw, yw, zw] = integration.sums;
    // Small compared with every direction in which the antennas are spread, so it only matters in directions in which they are not.
    let ridge = 1e-10 * (xx + yy + zz);
    if !(ridge > 0.0) {
        let message = format!("the direction of the phase centre at JD {} is unknown: no baseline has a length", integration.time_jd);
        return Err(ChainError::NoData(message));
    }
    let (a, d, f) = (xx + ridge, yy + ridge, zz + ridge);
    let unknown = || ChainError::NoData(format!("the direction of the phase centre at JD {} is unknown", integration.time_jd));
    let matrix = [[a, xy, xz], [xy, d, yz], [xz, yz, f]];
    let mut s = solve_3(matrix, [xw, yw, zw]).ok_or_else(unknown)?;
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |v: [f64; 3]| v.map(|x| x / dot(v, v).sqrt());
    // The direction that the baselines tell least of: across a plane, and as steep as can be for antennas in a line.
    let mut across = [0.0, 0.0, 1.0];
    for _ in 0..8 {
        across = unit(solve_3(matrix, across).ok_or_else(unknown)?);
    }
    let along = dot(s, across);
    // |s + t across| = 1. In a plane s has no component across it, and the larger root raises the source. Where the baselines have told the
    // component, t is nearly 0.
    let root = (along * along + 1.0 - dot(s, s)).max(0.0).sqrt();
    let t = if along < -0.01 { -along - root } else { root - along };
    for k in 0..3 {
        s[k] += t * across[k];
    }
    Ok(unit(s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, Site};
    use ndarray::Array2;

    #[test]
    fn the_direction_comes_out_of_w_for_flat_and_for_hilly_arrays() {
        let truth = [0.3, -0.5, (1.0_f64 - 0.34).sqrt()];
        for hill in [0.0, 0.5, 300.0] {
            let at = |k: u32| [f64::from(k * k) * 100.0, f64::from(k * 3 % 5) * 130.0, hill * f64::from(k % 3)];
            let antennas = (0..7).map(|k| Antenna::new(format!("A{k}"), k, at(k))).collect();
            let site = Site { latitude_rad: 0.5, longitude_rad: 0.0, altitude_m: 0.0 };
            let layout = ArrayLayout::new("t", LayoutFrame::EastNorthUp(site), antennas).unwrap();
            let pairs: Vec<(u32, u32)> = (0..7).flat_map(|a| (a + 1..7).map(move |b| (a, b))).collect();
            let uvw = Array2::from_shape_fn((pairs.len(), 3), |(r, k)| {
                let (a, b) = (at(pairs[r].0), at(pairs[r].1));
                if k == 2 { (0..3).map(|i| (b[i] - a[i]) * truth[i]).sum() } else { 0.0 }
            });
            let n = pairs.len();
            let (ant1, ant2) = pairs.into_iter().unzip();
            let coverage = UvCoverage::new(uvw, ant1, ant2, vec![2.46e6; n], vec![10.0; n], vec![0; n]).unwrap();
            let mut survey = Survey::default();
            survey.add(&coverage, &layout).unwrap();
            let found = survey.finish();
            assert_eq!((found.len(), found[0].length_s), (1, 10.0));
            let toward = direction(&found[0], &layout).unwrap();
            for k in 0..3 {
                assert!((toward[k] - truth[k]).abs() < 1e-4, "hill {hill}: {toward:?}");
            }
        }
    }

    // The source was taken to be 14 degrees off, because its component across a tilted plane was looked for in the vertical one.
    #[test]
    fn antennas_on_a_slope_know_the_direction() {
        for (slope, toward) in [(0.25, [0.0, 0.0, 1.0]), (-0.4, [0.48, -0.36, 0.8]), (1.0, [-0.6, 0.0, 0.8]), (0.1, [0.96, 0.0, 0.28])] {
            let at = |k: usize| [[0.0, 0.0], [40.0, 0.0], [3.0, 40.0], [-20.0, 25.0]][k];
            let position = |k: usize| [at(k)[0], at(k)[1], slope * at(k)[0]];
            let antennas = (0..4).map(|k| Antenna::new(format!("A{k}"), k as u32, position(k))).collect();
            let site = Site { latitude_rad: 0.5, longitude_rad: 0.0, altitude_m: 0.0 };
            let layout = ArrayLayout::new("t", LayoutFrame::EastNorthUp(site), antennas).unwrap();
            let pairs: Vec<(usize, usize)> = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b))).collect();
            let w = |(a, b): (usize, usize)| (0..3).map(|i| (position(b)[i] - position(a)[i]) * toward[i]).sum();
            let uvw = Array2::from_shape_fn((pairs.len(), 3), |(r, k)| if k == 2 { w(pairs[r]) } else { 0.0 });
            let n = pairs.len();
            let (ant1, ant2) = pairs.into_iter().map(|(a, b)| (a as u32, b as u32)).unzip();
            let coverage = UvCoverage::new(uvw, ant1, ant2, vec![2.46e6; n], vec![10.0; n], vec![0; n]).unwrap();
            let mut survey = Survey::default();
            survey.add(&coverage, &layout).unwrap();
            let found = direction(&survey.finish()[0], &layout).unwrap();
            for k in 0..3 {
                assert!((found[k] - toward[k]).abs() < 1e-6, "slope {slope}: {found:?} {toward:?}");
            }
        }
    }

    #[test]
    fn the_nearest_time_is_found() {
        let times = [1.0, 2.0, 4.0];
        assert_eq!([0.0, 1.4, 1.6, 2.9, 3.1, 9.0].map(|t| nearest_index(&times, t)), [0, 0, 1, 1, 2, 2]);
    }
}
