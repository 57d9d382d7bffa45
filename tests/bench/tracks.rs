//! Earth-rotation tracks of an array with three arms, for the benchmarks: the rows of a long observation, without a file.

use ndarray::Array2;
use num_complex::Complex32;
use std::ops::Range;

/// Side of a pixel of the images, rad.
pub(crate) const CELL_RAD: f64 = 0.25 / 206_264.806;

/// Rows and channels of a benchmark.
pub(crate) struct Tracks {
    /// uvw, m \[row, 3\].
    pub(crate) uvw_m: Array2<f64>,
    /// Channel centres, Hz.
    pub(crate) freq_hz: Vec<f64>,
    /// Visibilities \[row, chan\].
    pub(crate) vis: Array2<Complex32>,
}

/// The integrations `times` of an observation that has `n_times` integrations in eight hours at declination 30 deg, with 27 antennas on arms
/// of 36 km and `n_chan` channels from 1.3 GHz.
pub(crate) fn tracks(times: Range<usize>, n_times: usize, n_chan: usize) -> Tracks {
    let (latitude, declination) = (34.08_f64.to_radians(), 30.5_f64.to_radians());
    let antennas: Vec<[f64; 3]> = [236.0_f64, 115.0, 355.0]
        .iter()
        .flat_map(|azimuth| (1..=9).map(move |n| (azimuth.to_radians(), 484.0 * f64::from(n).powf(1.716))))
        .map(|(a, r)| {
            let (east, north) = (r * a.sin(), r * a.cos());
            [-north * latitude.sin(), east, north * latitude.cos()]
        })
        .collect();
    let pairs: Vec<(usize, usize)> = (0..27).flat_map(|a| (a + 1..27).map(move |b| (a, b))).collect();
    let uvw_m = Array2::from_shape_fn((times.len() * pairs.len(), 3), |(row, k)| {
        let (time, (a, b)) = (times.start + row / pairs.len(), pairs[row % pairs.len()]);
        let angle = ((time as f64 + 0.5) / n_times as f64 - 0.5) * 8.0 * 15.0_f64.to_radians();
        let [x, y, z] = [0, 1, 2].map(|i| antennas[b][i] - antennas[a][i]);
        let ((sh, ch), (sd, cd)) = (angle.sin_cos(), declination.sin_cos());
        match k {
            0 => sh * x + ch * y,
            1 => -sd * ch * x + sd * sh * y + cd * z,
            _ => cd * ch * x - cd * sh * y + sd * z,
        }
    });
    let vis = Array2::from_shape_fn((uvw_m.nrows(), n_chan), |(r, c)| Complex32::new(1.0 + (r % 7) as f32, c as f32 * 0.01 - 0.3));
    Tracks { uvw_m, freq_hz: (0..n_chan).map(|c| 1.3e9 + 2e6 * c as f64).collect(), vis }
}
