//! How fast the picture moves.

use crate::Result;
use crate::enhance::gaussian;
use ndarray::{Array2, ArrayView2, Zip};

/// Standard deviation of the smoothing before differences are taken, pixels. Lines of one pixel have no gradient that tells a displacement.
const SMOOTHING: f64 = 1.5;
/// Pixels at the edge of the picture without a derivative.
const BORDER: usize = 2;
/// The displacement is measured where it is about this, pixels: larger ones leave the range of the gradients, smaller ones drown in rounding.
const WANTED: f64 = 0.25;
/// Displacements above this are measured again over a shorter time.
const LARGEST: f64 = 0.5;
/// Most times that the time between the two pictures is shortened.
const TRIALS: usize = 12;
/// Side of a part of the picture in which the motion is measured, pixels.
const PART: usize = 32;
/// The gradients of a part tell a motion where the smaller eigenvalue of their matrix is above this share of the largest of the picture.
const TEXTURE: f64 = 1e-3;

/// The derivative of the fourth order from two values before a pixel and two after it.
fn slope([a, b, c, d]: [f64; 4]) -> f64 {
    (8.0 * (c - b) - (d - a)) / 12.0
}

/// The displacement between two pictures over the pixels with a weight, by least squares; and the smaller eigenvalue of its matrix.
///
/// # Reference
/// Lucas & Kanade 1981, Proc. IJCAI, 674, one step.
fn displacement(from: ArrayView2<'_, f64>, to: ArrayView2<'_, f64>, weight: impl Fn(usize, usize) -> bool) -> ([f64; 2], f64) {
    let middle = (&from + &to) * 0.5;
    let (rows, columns) = middle.dim();
    let (mut a, mut b, mut c, mut p, mut q) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (r, k) in (BORDER..rows.saturating_sub(BORDER)).flat_map(|r| (BORDER..columns.saturating_sub(BORDER)).map(move |k| (r, k))) {
        if weight(r, k) {
            let y = slope([middle[[r - 2, k]], middle[[r - 1, k]], middle[[r + 1, k]], middle[[r + 2, k]]]);
            let x = slope([middle[[r, k - 2]], middle[[r, k - 1]], middle[[r, k + 1]], middle[[r, k + 2]]]);
            let d = to[[r, k]] - from[[r, k]];
            (a, b, c) = (a + y * y, b + y * x, c + x * x);
            (p, q) = (p - y * d, q - x * d);
        }
    }
    let det = a * c - b * b;
    let smaller = 0.5 * (a + c) - (0.25 * (a - c).powi(2) + b * b).sqrt();
    if det > 0.0 { ([(c * p - b * q) / det, (a * q - b * p) / det], smaller) } else { ([0.0; 2], 0.0) }
}

/// Speed of the picture around a time, pixels per second: that of the pixels of `region`, or the median over the parts of the whole picture that show
/// something that can be followed. 0 where nothing can be followed. `still` gives the picture at a time, `step_s` the first time between two pictures.
///
/// # Errors
/// That of `still`.
pub fn speed(still: &mut dyn FnMut(f64) -> Result<Array2<f64>>, at_s: f64, step_s: f64, region: Option<&Array2<bool>>) -> Result<f64> {
    let mut step = step_s;
    let mut found = 0.0;
    for _ in 0..TRIALS {
        let [from, to] = [at_s - 0.5 * step, at_s + 0.5 * step].map(|t| still(t).map(|p| gaussian(p.view(), SMOOTHING)));
        let moved = match region {
            Some(region) => length(displacement(from?.view(), to?.view(), |m, l| region[[m, l]]).0),
            None => median_of_parts(&from?, &to?),
        };
        found = moved / step;
        if moved <= LARGEST {
            break;
        }
        step *= (WANTED / moved).max(0.05);
    }
    Ok(found)
}

fn length(d: [f64; 2]) -> f64 {
    d[0].hypot(d[1])
}

fn median_of_parts(from: &Array2<f64>, to: &Array2<f64>) -> f64 {
    let (rows, columns) = from.dim();
    let parts = (0..rows.div_ceil(PART)).flat_map(|i| (0..columns.div_ceil(PART)).map(move |j| (i * PART, j * PART)));
    let mut found: Vec<(f64, f64)> = parts
        .map(|(r, c)| {
            let window = ndarray::s![r..(r + PART).min(rows), c..(c + PART).min(columns)];
            let (d, texture) = displacement(from.slice(window), to.slice(window), |_, _| true);
            (length(d), texture)
        })
        .collect();
    let most = found.iter().fold(0.0_f64, |a, f| a.max(f.1));
    found.retain(|f| f.1 > TEXTURE * most && f.1 > 0.0);
    if found.is_empty() {
        return 0.0;
    }
    let middle = found.len() / 2;
    found.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0)).1.0
}

/// The mean of pictures over an exposure around a time: one picture for each pixel of motion, at most `most` and at least one.
///
/// # Errors
/// That of `still`.
pub fn exposed(still: &mut dyn FnMut(f64) -> Result<Array2<f64>>, at_s: f64, exposure_s: f64, pictures: usize) -> Result<Array2<f64>> {
    let n = pictures.max(1);
    let time = |k: usize| at_s + ((k as f64 + 0.5) / n as f64 - 0.5) * exposure_s;
    let mut sum = still(time(0))?;
    for k in 1..n {
        Zip::from(&mut sum).and(&still(time(k))?).for_each(|s, v| *s += v);
    }
    Ok(sum / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of waves in all directions that moves by `v` columns and a third of it rows a second.
    fn waves(v: f64) -> impl FnMut(f64) -> Result<Array2<f64>> {
        move |t| {
            Ok(Array2::from_shape_fn((96, 128), |(r, c)| {
                let (x, y) = (c as f64 - v * t, r as f64 - v * t / 3.0);
                280.0 + 10.0 * (0.31 * x).sin() * (0.23 * y + 1.0).cos() + 5.0 * (0.17 * (x + y)).sin()
            }))
        }
    }

    #[test]
    fn the_speed_of_a_moving_picture_is_found_at_all_speeds() {
        for v in [0.5, 20.0, 900.0] {
            let truth = v * (10.0_f64 / 9.0).sqrt();
            let disc = Array2::from_shape_fn((96, 128), |(r, c)| (r as f64 - 50.0).hypot(c as f64 - 60.0) < 12.0);
            for region in [None, Some(&disc)] {
                let found = speed(&mut waves(v), 3.0, 0.01, region).unwrap();
                // The derivatives of a wave of 16 pixels are 0.1 % too small; the smoothing reflects the border.
                assert!((found / truth - 1.0).abs() < 0.01, "{v}: {found} and not {truth}");
            }
        }
        assert_eq!(speed(&mut |_| Ok(Array2::from_elem((40, 40), 3.0)), 0.0, 0.1, None).unwrap(), 0.0);
    }

    #[test]
    fn an_exposure_turns_an_edge_into_a_ramp_of_the_length_of_the_motion() {
        let mut edge = |t: f64| Ok(Array2::from_shape_fn((3, 60), |(_, c)| (c as f64 - 30.0 - 40.0 * t + 0.5).clamp(0.0, 1.0)));
        // 40 pixels a second for 0.25 s are 10 pixels, of which 10 % to 90 % are 8.
        let ramp = exposed(&mut edge, 0.0, 0.25, 200).unwrap();
        let crossing = |level: f64| {
            let row: Vec<f64> = ramp.row(1).to_vec();
            let k = (0..59).find(|k| row[*k] < level && row[k + 1] >= level).unwrap();
            k as f64 + (level - row[k]) / (row[k + 1] - row[k])
        };
        assert!((crossing(0.9) - crossing(0.1) - 8.0).abs() < 0.05, "{}", crossing(0.9) - crossing(0.1));
    }
}
