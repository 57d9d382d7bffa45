//! Earth-rotation tracks of a three-armed array, for the benches: rows like those of a long observation, without a file.

use ndarray::Array2;
use num_complex::Complex32;

/// Side of a pixel of the images, rad.
#[allow(dead_code)] // not every bench makes images
pub(crate) const CELL_RAD: f64 = 0.25 / 206_264.806;

/// Rows and channels of a bench.
pub(crate) struct Tracks {
    /// uvw, m \[row, 3\].
    pub(crate) uvw_m: Array2<f64>,
    /// Channel centres, Hz.
    pub(crate) freq_hz: Vec<f64>,
    /// Visibilities \[row, chan\].
    pub(crate) vis: Array2<Complex32>,
}

/// `n_times` integrations over eight hours at declination 30 deg of 27 antennas on arms of 36 km, `n_chan` channels from 1.3 GHz.
#[allow(dead_code)] // some benches take parts
pub(crate) fn tracks(n_times: usize, n_chan: usize) -> Tracks {
    tracks_from((0, n_times), n_times, n_chan)
}

/// The integrations `first..last` of such an observation.
pub(crate) fn tracks_from((first, last): (usize, usize), n_times: usize, n_chan: usize) -> Tracks {
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
    let uvw_m = Array2::from_shape_fn(((last - first) * pairs.len(), 3), |(row, k)| {
        let (time, (a, b)) = (first + row / pairs.len(), pairs[row % pairs.len()]);
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
