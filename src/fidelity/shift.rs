//! The shift between two images. Self-calibration without a fixed model does not determine the position of the image.

use crate::fourier::Convolver;
use crate::{ChainError, Result};
use ndarray::{Array1, Array2, ArrayView2, Axis, s};

/// Half width of the interpolation kernel, pixels.
const LANCZOS: f64 = 6.0;
/// Number of times that the image is shifted and correlated again. Each round reduces the error of the parabola by a large factor.
const ROUNDS: usize = 4;

/// The shift in pixels (along m, along l) that moves `image` onto `truth` \[m, l\], from the peak of their correlation.
///
/// # Errors
/// The images have different shapes, or no pixel.
pub fn find_shift(image: ArrayView2<'_, f64>, truth: ArrayView2<'_, f64>) -> Result<(f64, f64)> {
    if image.dim() != truth.dim() || image.is_empty() {
        let message = format!("an image of {:?} pixels cannot be moved onto one of {:?} pixels", image.dim(), truth.dim());
        return Err(ChainError::Incompatible(message));
    }
    let (n_m, n_l) = truth.dim();
    let centered = |a: ArrayView2<'_, f64>| {
        let mean = a.sum() / a.len() as f64;
        a.mapv(|v| v - mean)
    };
    let convolver = Convolver::<f64>::new((n_m, n_l), n_m.max(n_l));
    let truth = centered(truth);
    // Pixels from outside the image are 0. This is the mean of the centred image, so they make no edge.
    let image = centered(image);
    let (mut total, mut moved) = ((0.0, 0.0), image.clone());
    for _ in 0..ROUNDS {
        // Correlation is convolution with the mirrored image. The kernel has its centre at n / 2.
        let mirrored = convolver.kernel(moved.slice(s![..;-1, ..;-1]));
        let correlation = convolver.convolve(truth.view(), &mirrored);
        let step = peak(&correlation);
        // Pixel k is mirrored to n - 1 - k, which has the coordinate n - 1 - k - n / 2 in the kernel.
        let zero = |n: usize| (n - 1 - n / 2) as f64;
        let step = (step.0 - zero(n_m), step.1 - zero(n_l));
        total = (total.0 + step.0, total.1 + step.1);
        moved = shifted(image.view(), total);
        if step.0.hypot(step.1) < 1e-6 {
            break;
        }
    }
    Ok(total)
}

/// Position of the largest value, from parabolas through the value and its neighbours.
fn peak(a: &Array2<f64>) -> (f64, f64) {
    let best = a.indexed_iter().fold(((0, 0), f64::NEG_INFINITY), |b, (at, v)| if *v > b.1 { (at, *v) } else { b });
    let (row, column) = best.0;
    let vertex = |low: Option<&f64>, high: Option<&f64>| match (low, high) {
        (Some(l), Some(h)) if l + h < 2.0 * best.1 => 0.5 * (h - l) / (2.0 * best.1 - l - h),
        _ => 0.0,
    };
    let before = |k: usize| k.checked_sub(1);
    let rows = vertex(before(row).and_then(|r| a.get((r, column))), a.get((row + 1, column)));
    let columns = vertex(before(column).and_then(|c| a.get((row, c))), a.get((row, column + 1)));
    (row as f64 + rows, column as f64 + columns)
}

/// An image \[m, l\] moved by a number of pixels (along m, along l). Pixels from outside the image are 0.
#[must_use]
pub fn shifted(image: ArrayView2<'_, f64>, (by_m, by_l): (f64, f64)) -> Array2<f64> {
    let mut out = image.to_owned();
    for (axis, by) in [(Axis(0), by_m), (Axis(1), by_l)] {
        if by != 0.0 {
            let taps = taps(by - by.floor());
            for mut lane in out.lanes_mut(axis) {
                let from: Array1<f64> = lane.to_owned();
                for (k, v) in lane.iter_mut().enumerate() {
                    let first = k as i64 - by.floor() as i64 - LANCZOS as i64;
                    let value =
                        |(j, w): (usize, &f64)| usize::try_from(first + j as i64).ok().and_then(|i| from.get(i)).map_or(0.0, |x| w * x);
                    *v = taps.iter().enumerate().map(value).sum();
                }
            }
        }
    }
    out
}

/// Weights of the pixels from -LANCZOS to LANCZOS for a shift by `fraction` of a pixel.
///
/// # Reference
/// Duchon 1979, J. Appl. Meteor. 18, 1016 (the window).
fn taps(fraction: f64) -> Vec<f64> {
    let sinc = |x: f64| if x.abs() < 1e-12 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    let half = LANCZOS as i64;
    let weight = |j: i64| {
        let x = j as f64 + fraction;
        if x.abs() < LANCZOS { sinc(x) * sinc(x / LANCZOS) } else { 0.0 }
    };
    let all: Vec<f64> = (-half..=half).map(weight).collect();
    let sum: f64 = all.iter().sum();
    all.into_iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blobs(n_m: usize, n_l: usize, at: (f64, f64)) -> Array2<f64> {
        let blob = |r: f64, c: f64, width: f64| (-(r * r + c * c) / (2.0 * width * width)).exp();
        Array2::from_shape_fn((n_m, n_l), |(r, c)| {
            let (r, c) = (r as f64 - at.0, c as f64 - at.1);
            0.2 + blob(r, c, 2.0) + 0.6 * blob(r - 9.0, c + 7.0, 3.0) - 0.1 * blob(r + 6.0, c + 3.0, 2.5)
        })
    }

    #[test]
    fn a_shift_of_parts_of_a_pixel_is_found_and_undone() {
        for (n_m, n_l, by) in [(64, 64, (3.3, -2.7)), (61, 80, (-5.0, 0.25)), (50, 49, (0.0, 0.0))] {
            let truth = blobs(n_m, n_l, (30.0, 31.0));
            let image = blobs(n_m, n_l, (30.0 - by.0, 31.0 - by.1));
            let found = find_shift(image.view(), truth.view()).unwrap();
            assert!((found.0 - by.0).abs() < 0.02 && (found.1 - by.1).abs() < 0.02, "{by:?} {found:?}");
            let back = shifted(image.view(), found);
            let inner = s![16..44, 16..44];
            let off = (&back.slice(inner) - &truth.slice(inner)).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            assert!(off < 0.02, "{by:?}: {off}");
        }
    }
}
