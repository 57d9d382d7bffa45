//! Adaptive Wiener filter.

use super::border::mean;
use super::smooth::window_mean;
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2, Zip};

#[derive(Debug)]
struct Wiener {
    window: usize,
    noise: Option<f64>,
}

impl Step for Wiener {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(wiener(frame.view(), self.window, self.noise))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Wiener { window: given.whole(0), noise: given.optional(1) }))
}

/// Draw each pixel towards the mean of its window, the more the nearer the variance in the window is to that of the noise: flat parts are smoothed,
/// edges stay. `noise` is the standard deviation of the noise, in the unit of the plane; without it, the noise variance is the mean of
/// the variances of all windows.
///
/// # Reference
/// Lee 1980, IEEE Trans. PAMI 2, 165, as `scipy.signal.wiener` has it.
#[must_use]
pub fn wiener(plane: ArrayView2<'_, f64>, window: usize, noise: Option<f64>) -> Array2<f64> {
    // Variances from squares lose digits where the mean is large against the noise.
    let level = mean(plane);
    let around = plane.mapv(|v| v - level);
    let means = window_mean(around.view(), window);
    let squares = window_mean(around.mapv(|v| v * v).view(), window);
    let variances = Zip::from(&squares).and(&means).map_collect(|s, m| s - m * m);
    let noise = noise.map_or_else(|| mean(variances.view()), |sigma| sigma * sigma);
    Zip::from(&around).and(&means).and(&variances).map_collect(|v, m, variance| {
        let kept = if *variance < noise { 0.0 } else { 1.0 - noise / variance };
        level + m + if kept > 0.0 { kept * (v - m) } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::{noise, rms};

    #[test]
    fn noise_falls_by_the_width_of_the_window_and_an_edge_stays() {
        let edge = Array2::from_shape_fn((64, 64), |(_, c)| if c < 32 { 250.0 } else { 300.0 });
        let noisy = &edge + &noise(64, 64, 1);
        let out = wiener(noisy.view(), 5, Some(1.0));
        let left = rms((&out - &edge).slice(ndarray::s![8..56, 8..24]).to_owned());
        // The mean of 25 pixels has a noise of 0.2; windows whose variance is above 1 by chance keep some of theirs.
        assert!(left > 0.2 && left < 0.4, "{left}");
        assert!((out[[30, 31]] - noisy[[30, 31]]).abs() < 0.2 && (out[[30, 32]] - noisy[[30, 32]]).abs() < 0.2);
        let flat = wiener(Array2::from_elem((9, 9), 271.5).view(), 3, None);
        assert!(flat.iter().all(|v| (v - 271.5).abs() < 1e-12));
    }
}
