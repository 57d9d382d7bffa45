//! What an error may know of the set that it is put into.

use crate::random::stream;
use cittert_arrays::{ArrayLayout, LayoutFrame, UvCoverage, VisibilityHeader};
use rand_chacha::ChaCha8Rng;

/// The set, its integrations, and random numbers.
#[derive(Debug, Clone)]
pub struct Context<'a> {
    /// What all rows share.
    pub header: &'a VisibilityHeader,
    /// Midpoints of the integrations, Julian date UTC, growing \[time\].
    pub time_jd: &'a [f64],
    /// The same in s from the first \[time\].
    pub seconds: &'a [f64],
    /// Unit vector towards the phase centre in the axes of the layout \[time\]; empty where no error needs it.
    pub toward: &'a [[f64; 3]],
    /// Channels of the gains, Hz \[chan\].
    pub freq_hz: &'a [f64],
    /// Seed of all random numbers.
    pub seed: u64,
    /// Name of the error, and its place among those of the same call.
    pub name: &'static str,
    /// See `name`.
    pub place: usize,
}

impl Context<'_> {
    /// The random numbers of one item (an antenna, a baseline, a row) of this error.
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

/// Index of the value of a growing list that is nearest to `x`; 0 for an empty list.
pub(crate) fn nearest_index(values: &[f64], x: f64) -> usize {
    let after = values.partition_point(|v| *v < x);
    match (after.checked_sub(1), values.get(after)) {
        (Some(before), Some(next)) if x - values[before] > next - x => after,
        (Some(before), _) => before,
        (None, _) => 0,
    }
}

/// Finds the integrations of a set and, where asked, the direction of the phase centre in each.
///
/// The direction comes from the data themselves: w = (r2 - r1) . s for every row, solved for s by least squares.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    /// Time, integration, normal equations (upper triangle, right side).
    found: Vec<(f64, f64, [f64; 9])>,
    index: std::collections::HashMap<u64, usize>,
}

/// Times closer than this are one integration: Julian dates in f64 are good to 0.05 ms.
const SAME_TIME_S: f64 = 1e-3;

impl Survey {
    /// Take the rows of a block.
    pub(crate) fn add(&mut self, coverage: &UvCoverage, layout: &ArrayLayout) {
        for row in 0..coverage.n_rows() {
            let time = coverage.time_jd[row];
            let k = *self.index.entry(time.to_bits()).or_insert_with(|| {
                self.found.push((time, 0.0, [0.0; 9]));
                self.found.len() - 1
            });
            let (_, integration, sums) = &mut self.found[k];
            *integration = integration.max(coverage.integration_s[row]);
            let (a, b) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
            if let (Some(a), Some(b)) = (layout.antennas().get(a), layout.antennas().get(b)) {
                let d = [0, 1, 2].map(|k| b.position_m[k] - a.position_m[k]);
                let w = coverage.uvw_m[[row, 2]];
                let terms = [d[0] * d[0], d[0] * d[1], d[0] * d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2], d[0] * w, d[1] * w, d[2] * w];
                sums.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
            }
        }
    }

    /// Times, integrations and directions, in the order of time.
    pub(crate) fn finish(mut self, layout: &ArrayLayout) -> (Vec<f64>, Vec<f64>, Vec<[f64; 3]>) {
        self.found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut merged: Vec<(f64, f64, [f64; 9])> = Vec::with_capacity(self.found.len());
        for next in self.found {
            match merged.last_mut() {
                Some(last) if (next.0 - last.0) * 86_400.0 < SAME_TIME_S => {
                    last.1 = last.1.max(next.1);
                    last.2.iter_mut().zip(next.2).for_each(|(s, t)| *s += t);
                }
                _ => merged.push(next),
            }
        }
        let toward = merged.iter().map(|m| direction(&m.2, layout)).collect();
        (merged.iter().map(|m| m.0).collect(), merged.iter().map(|m| m.1).collect(), toward)
    }
}

/// Unit vector s from the normal equations of w = d . s.
///
/// Antennas in a plane leave the component across it open: it follows from the length of 1 and from the source being above the
/// horizon.
fn direction(sums: &[f64; 9], layout: &ArrayLayout) -> [f64; 3] {
    if matches!(layout.frame, LayoutFrame::Boresight) {
        return [0.0, 0.0, 1.0];
    }
    let [xx, xy, xz, yy, yz, zz, xw, yw, zw] = *sums;
    // Small against every direction in which antennas are spread, so that it only decides where none are.
    let ridge = 1e-10 * (xx + yy + zz);
    if ridge == 0.0 {
        return [0.0, 0.0, 1.0];
    }
    let (a, d, f) = (xx + ridge, yy + ridge, zz + ridge);
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let matrix = [[a, xy, xz], [xy, d, yz], [xz, yz, f]];
    let whole = det(matrix);
    let mut s = [0, 1, 2].map(|k| {
        let mut m = matrix;
        for (row, w) in m.iter_mut().zip([xw, yw, zw]) {
            row[k] = w;
        }
        det(m) / whole
    });
    // |s + x up|^2 = 1 with the larger root, which raises the source.
    let rest = 1.0 - s[0] * s[0] - s[1] * s[1];
    if s[2] * s[2] < rest {
        s[2] = rest.sqrt();
    }
    let length = (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]).sqrt();
    s.map(|x| x / length)
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
            survey.add(&coverage, &layout);
            let (times, integrations, toward) = survey.finish(&layout);
            assert_eq!((times.len(), integrations[0]), (1, 10.0));
            for k in 0..3 {
                assert!((toward[0][k] - truth[k]).abs() < 1e-4, "hill {hill}: {:?}", toward[0]);
            }
        }
    }

    #[test]
    fn the_nearest_time_is_found() {
        let times = [1.0, 2.0, 4.0];
        assert_eq!([0.0, 1.4, 1.6, 2.9, 3.1, 9.0].map(|t| nearest_index(&times, t)), [0, 0, 1, 1, 2, 2]);
    }
}
