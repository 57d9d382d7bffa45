//! Pictures of rendered scenes without axes: temperatures in a stretch that shows details, and colours by cause.

use super::canvas::encode;
use super::grey::grey;
use crate::{ChainError, Result};
use image::RgbImage;
use ndarray::{Array2, ArrayView2, ArrayView3, Zip};

/// How the temperatures of a scene become grey levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SceneStretch {
    /// asinh about the median of the surfaces, in units of half their interquartile range: small differences between warm surfaces show, and
    /// metal that mirrors a cold sky stays dark without taking the range.
    #[default]
    Asinh,
    /// In proportion, from the 1st to the 99th percentile of the surfaces.
    Linear,
    /// By rank: equal numbers of surface pixels have each level.
    Rank,
}

/// Percentiles of the surfaces between which levels are spread.
const ENDS: (f64, f64) = (0.01, 0.99);
/// Smallest unit of the asinh stretch, K. Differences below it are noise of most radiometers.
const LEAST_K: f64 = 0.5;

/// A grey PNG of temperatures in K, the last row on top. `on_surface` marks the pixels that show surfaces; the levels follow from these alone, so
/// a cold sky takes no part of the range. A picture without surfaces takes its levels from all pixels. // [m, l]
///
/// # Errors
/// Planes of different shapes, without pixels, or larger than a PNG can be.
pub fn scene_picture(temperature_k: ArrayView2<'_, f64>, on_surface: ArrayView2<'_, bool>, stretch: SceneStretch) -> Result<Vec<u8>> {
    if temperature_k.dim() != on_surface.dim() {
        return Err(ChainError::NoData(format!(
            "temperatures {:?} and surfaces {:?} differ in size",
            temperature_k.dim(),
            on_surface.dim()
        )));
    }
    let finite = |shown: bool| {
        let pairs = temperature_k.iter().zip(on_surface.iter());
        let mut values: Vec<f64> = pairs.filter(|(t, s)| t.is_finite() && (**s || !shown)).map(|(t, _)| *t).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let surfaces = finite(true);
    let sorted = if surfaces.is_empty() { finite(false) } else { surfaces };
    if sorted.is_empty() {
        return Err(ChainError::NoData("a picture without temperatures cannot be drawn".into()));
    }
    let at = |share: f64| sorted[((share * sorted.len() as f64) as usize).min(sorted.len() - 1)];
    let (low, high) = (at(ENDS.0), at(ENDS.1).max(at(ENDS.0) + 1e-6));
    match stretch {
        SceneStretch::Linear => grey(temperature_k, low, high),
        SceneStretch::Asinh => {
            let (middle, unit) = (at(0.5), (0.5 * (at(0.75) - at(0.25))).max(LEAST_K));
            let level = |t: f64| ((t - middle) / unit).asinh();
            grey(temperature_k.mapv(level).view(), level(low), level(high))
        }
        SceneStretch::Rank => {
            let n = sorted.len() as f64;
            let rank = |t: f64| 0.5 * (sorted.partition_point(|v| *v < t) + sorted.partition_point(|v| *v <= t)) as f64 / n;
            grey(temperature_k.mapv(rank).view(), 0.0, 1.0)
        }
    }
}

/// A PNG in colour of what temperatures come from: red for the emission of the surface in view, green for what it mirrors of other surfaces
/// and the ground, blue for sky, air and weather. A channel is full at the 99.5th percentile of the sum, so the channels of a pixel compare. // [cause, m, l]
///
/// # Errors
/// Other than three planes; no pixels, or more than a PNG can have.
pub fn cause_picture(causes_k: ArrayView3<'_, f64>) -> Result<Vec<u8>> {
    let (planes, rows, columns) = causes_k.dim();
    let size = u32::try_from(columns).ok().zip(u32::try_from(rows).ok()).filter(|(w, h)| planes == 3 && *w > 0 && *h > 0);
    let fault = || ChainError::NoData(format!("{planes} causes of {columns} x {rows} pixels cannot be drawn"));
    let (width, height) = size.ok_or_else(fault)?;
    let mut sums = Array2::<f64>::zeros((rows, columns));
    for plane in causes_k.outer_iter() {
        Zip::from(&mut sums).and(plane).for_each(|s, v| *s += v);
    }
    let mut sorted: Vec<f64> = sums.iter().copied().filter(|s| s.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let full = sorted.get((0.995 * sorted.len() as f64) as usize).copied().unwrap_or(1.0).max(1e-6);
    let level = |v: f64| (255.0 * (v / full).clamp(0.0, 1.0)).round() as u8;
    let picture = RgbImage::from_fn(width, height, |x, y| {
        let at = |cause| level(causes_k[[cause, rows - 1 - y as usize, x as usize]]);
        image::Rgb([at(0), at(1), at(2)])
    });
    encode(picture.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, array};

    fn levels(png: &[u8]) -> Vec<u8> {
        image::load_from_memory(png).unwrap().into_luma8().into_raw()
    }

    #[test]
    fn a_cold_sky_takes_no_part_of_the_range() {
        // A row of sky at 50 K above surfaces from 280 K to 299 K.
        let t = Array2::from_shape_fn((2, 20), |(row, column)| if row == 1 { 50.0 } else { 280.0 + column as f64 });
        let on_surface = Array2::from_shape_fn((2, 20), |(row, _)| row == 0);
        for stretch in [SceneStretch::Linear, SceneStretch::Asinh, SceneStretch::Rank] {
            let levels = levels(&scene_picture(t.view(), on_surface.view(), stretch).unwrap());
            // The last row is on top: the sky is black, and the surfaces rise from black to white.
            assert!(levels[..20].iter().all(|v| *v == 0), "{stretch:?}");
            assert!(levels[20] <= 7 && levels[39] >= 248 && levels[20..].windows(2).all(|w| w[0] < w[1]), "{stretch:?}: {levels:?}");
        }
    }

    #[test]
    fn small_differences_show_beside_cold_metal() {
        // 10 pixels of metal at 30 K, and ground at 288 K with a patch of 290 K.
        let t = Array2::from_shape_fn((1, 100), |(_, k)| {
            if k < 10 {
                30.0
            } else if k < 80 {
                288.0
            } else {
                290.0
            }
        });
        let all = Array2::from_elem((1, 100), true);
        let contrast = |stretch| {
            let levels = levels(&scene_picture(t.view(), all.view(), stretch).unwrap());
            i32::from(levels[90]) - i32::from(levels[50])
        };
        assert!(contrast(SceneStretch::Linear) < 5 && contrast(SceneStretch::Asinh) > 30, "{}", contrast(SceneStretch::Asinh));
    }

    #[test]
    fn causes_are_colours() {
        let mut causes = Array3::zeros((3, 1, 3));
        causes[[0, 0, 0]] = 280.0;
        causes[[1, 0, 1]] = 140.0;
        causes[[2, 0, 1]] = 140.0;
        causes[[2, 0, 2]] = 28.0;
        let read = image::load_from_memory(&cause_picture(causes.view()).unwrap()).unwrap().into_rgb8().into_raw();
        assert_eq!(read, [255, 0, 0, 0, 128, 128, 0, 0, 26]);
        assert!(cause_picture(Array3::zeros((2, 1, 3)).view()).is_err());
        assert!(scene_picture(array![[1.0]].view(), array![[true, false]].view(), SceneStretch::Rank).is_err());
    }
}
