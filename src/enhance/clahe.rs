//! Contrast-limited adaptive histogram equalisation.

use super::border::{by_rows, line, range, reflect};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

/// Bins of the histogram of a tile. Between two bins the curve of a tile is a straight line, so a picture gets no steps.
const BINS: usize = 256;

#[derive(Debug)]
struct Clahe {
    clip: f64,
    tiles: usize,
}

impl Step for Clahe {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(clahe(frame.view(), self.clip, self.tiles))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Clahe { clip: given.number(0), tiles: given.whole(1) }))
}

/// Histogram equalisation in each of `tiles` x `tiles` parts of the frame, with at most `clip` times the pixels of an even histogram in a bin (what
/// is cut off is spread over all bins), so that noise in a flat part is not drawn out to the full range. Between the middles of the parts the
/// results of the four nearest are mixed bilinearly. The result lies in the range of the plane. Where `tiles` does not divide the frame,
/// the frame is continued by reflection.
///
/// # Reference
/// Zuiderveld 1994, Graphics Gems IV, 474, with the bins of OpenCV's `createCLAHE`.
#[must_use]
pub fn clahe(plane: ArrayView2<'_, f64>, clip: f64, tiles: usize) -> Array2<f64> {
    with_curves(plane, tiles, |counts, pixels| curve(counts, clip, pixels))
}

/// As [`clahe`], with the share of the pixels up to each bin from a function of the counts in the bins of a part and of their sum.
pub(super) fn with_curves(plane: ArrayView2<'_, f64>, tiles: usize, curve: impl Fn(Vec<f64>, f64) -> Vec<f64> + Sync) -> Array2<f64> {
    let plane = plane.as_standard_layout().into_owned();
    let ((low, high), (n_m, n_l)) = (range(plane.view()), plane.dim());
    if high <= low {
        return plane;
    }
    let (tall, wide) = (n_m.div_ceil(tiles), n_l.div_ceil(tiles));
    let place = |v: f64| (v - low) / (high - low) * (BINS - 1) as f64;
    let curves: Vec<Vec<f64>> = (0..tiles * tiles)
        .into_par_iter()
        .map(|tile| {
            let (top, left) = (tile / tiles * tall, tile % tiles * wide);
            let mut counts = vec![0.0; BINS];
            for r in top..top + tall {
                let row = line(&plane, reflect(r as isize, n_m));
                (left..left + wide).for_each(|c| counts[place(row[reflect(c as isize, n_l)]).round() as usize] += 1.0);
            }
            curve(counts, (tall * wide) as f64)
        })
        .collect();
    by_rows((n_m, n_l), |r, out| {
        let (above, below, down) = between(r, tall, tiles);
        for (c, (o, v)) in out.iter_mut().zip(line(&plane, r)).enumerate() {
            let (left, right, across) = between(c, wide, tiles);
            let bin = place(*v);
            let first = (bin as usize).min(BINS - 2);
            let of = |tile: usize| {
                let curve = &curves[tile];
                curve[first] + (bin - first as f64) * (curve[first + 1] - curve[first])
            };
            let mix = |row: usize| of(row * tiles + left) * (1.0 - across) + of(row * tiles + right) * across;
            *o = low + (high - low) * (mix(above) * (1.0 - down) + mix(below) * down);
        }
    })
}

/// The two parts whose middles lie around a pixel, and the weight of the second.
fn between(pixel: usize, size: usize, tiles: usize) -> (usize, usize, f64) {
    let at = pixel as f64 / size as f64 - 0.5;
    let first = at.floor();
    let limited = |k: f64| k.clamp(0.0, (tiles - 1) as f64) as usize;
    (limited(first), limited(first + 1.0), at - first)
}

/// The share of the pixels of a part up to each bin, after its histogram was limited.
fn curve(mut counts: Vec<f64>, clip: f64, pixels: f64) -> Vec<f64> {
    let most = (clip * pixels / BINS as f64).max(1.0);
    let excess: f64 = counts.iter().map(|n| (n - most).max(0.0)).sum();
    let mut sum = 0.0;
    for n in &mut counts {
        sum += n.min(most) + excess / BINS as f64;
        *n = sum / pixels;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;

    #[test]
    fn weak_contrast_beside_a_hot_pixel_grows_up_to_the_limit_within_the_range() {
        let mut plane = noise(64, 64, 8).mapv(|v| 280.0 + 4.0 * v);
        plane[[3, 3]] = 380.0;
        let out = clahe(plane.view(), 3.0, 4);
        let (low, high) = range(plane.view());
        assert!(range(out.view()).0 >= low && range(out.view()).1 <= high);
        // A bin holds at most 3 times the even count and its part of what was cut off, so no difference grows by more than 4.
        let inner = ndarray::s![40..56, 8..24];
        let growth = out.slice(inner).std(0.0) / plane.slice(inner).std(0.0);
        assert!(growth > 2.0 && growth < 4.0, "{growth}");
    }

    #[test]
    fn frames_that_the_parts_do_not_divide_and_flat_ones_are_fine() {
        let out = clahe(noise(37, 41, 9).view(), 2.0, 8);
        assert!(out.iter().all(|v| v.is_finite()));
        let flat = Array2::from_elem((16, 16), 290.0);
        assert_eq!(clahe(flat.view(), 2.0, 8), flat);
    }
}
