//! Steps against OpenCV, scikit-image and SciPy on one picture: `tests/oracle/enhancement.csv`, which `enhancement.py` beside it writes.

use super::*;
use ndarray::{Array2, ArrayView2, s};
use std::collections::BTreeMap;
use std::path::Path;

const DIM: (usize, usize) = (40, 48);
/// The digits that the table gives of numbers below 100.
const DIGITS: f64 = 1e-8;
/// Rounding of OpenCV's 32-bit numbers below 100, some operations deep.
const SINGLE: f64 = 5e-5;

fn columns() -> BTreeMap<String, Array2<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/enhancement.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    lines.for_each(|line| columns.iter_mut().zip(line).for_each(|(column, text)| column.push(text.parse().unwrap())));
    let planes = columns.into_iter().map(|values| Array2::from_shape_vec(DIM, values).unwrap());
    names.into_iter().map(str::to_owned).zip(planes).collect()
}

/// The largest difference at least `border` pixels away from the border.
fn apart(a: &Array2<f64>, b: &Array2<f64>, border: usize) -> f64 {
    let inner = s![border..DIM.0 - border, border..DIM.1 - border];
    (&a.slice(inner) - &b.slice(inner)).iter().fold(0.0, |most, v| v.abs().max(most))
}

#[test]
fn filters_of_noise_agree_with_scipy_and_opencv() {
    let c = columns();
    let picture = c["picture"].view();
    assert_eq!(apart(&median(picture, 3), &c["median_3"], 0), 0.0);
    assert_eq!(apart(&median(picture, 9), &c["median_9"], 0), 0.0);
    // OpenCV repeats the last pixel beyond the border.
    assert!(apart(&median(picture, 5), &c["median_5_opencv"], 2) < SINGLE);
    // SciPy takes zeros beyond the border.
    assert!(apart(&wiener(picture, 5, Some(2.0)), &c["wiener_5_noise_2"], 2) < DIGITS);
    assert!(apart(&wiener(picture, 3, Some(1.0)), &c["wiener_3_noise_1"], 1) < DIGITS);
    assert!(apart(&bilateral(picture, 2.0, 6.0, 9), &c["bilateral_2_6_9"], 0) < SINGLE);
}

#[test]
fn the_minimum_of_total_variation_is_that_of_scikit_image() {
    let c = columns();
    let (out, bound) = total_variation(c["picture"].view(), 3.0, 100_000, 1e-7);
    assert!(bound <= 1e-7);
    // 20,000 iterations of Chambolle's algorithm leave an error that falls with their number.
    let difference = apart(&out, &c["tv_3"], 0);
    assert!(difference < 2e-3, "{difference}");
}

/// Non-local means as the double sum of their definition; `weight` gets the distance of two patches without and with their last row.
fn double_sum(plane: ArrayView2<'_, f64>, (strength, noise): (f64, f64), weight: impl Fn(f64, f64) -> f64) -> Array2<f64> {
    let (half, reach) = (2_isize, 6_isize);
    let at = |r: isize, c: isize| plane[[border::reflect(r, DIM.0), border::reflect(c, DIM.1)]];
    let tap = |y: isize, x: isize| (-((y * y + x * x) as f64) / 2.0).exp();
    let square = |n: isize| (-n..=n).flat_map(move |y| (-n..=n).map(move |x| (y, x)));
    let total: f64 = square(half).map(|(y, x)| tap(y, x)).sum();
    Array2::from_shape_fn(DIM, |(r, c)| {
        let (r, c) = (r as isize, c as isize);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dy, dx) in square(reach) {
            let (mut before_last, mut all) = (0.0, 0.0);
            for (y, x) in square(half) {
                let difference = (at(r + y, c + x) - at(r + dy + y, c + dx + x)).powi(2) - 2.0 * noise * noise;
                let term = tap(y, x) / total * difference / (strength * strength);
                all += term;
                before_last += if y < half { term } else { 0.0 };
            }
            let w = weight(before_last, all.max(0.0));
            sum += w * at(r + dy, c + dx);
            weights += w;
        }
        sum / weights
    })
}

#[test]
fn non_local_means_differ_from_scikit_image_by_its_exponential_alone() {
    let c = columns();
    // The exponential of scikit-image: bits of the number in place of a series, 4 % low to 2 % high. It looks at the limit of the distance
    // before the last row of the patch.
    let rough = |before_last: f64, all: f64| {
        let bits = (1_512_775.395_195_185_7 * -all + 1_072_632_447.0) as i64;
        if before_last > 5.0 { 0.0 } else { f64::from_bits((bits << 32) as u64) }
    };
    let exact = |_: f64, all: f64| if all > 5.0 { 0.0 } else { (-all).exp() };
    for (name, noise) in [("nl_means_3_5_6", 0.0), ("nl_means_3_5_6_noise_1", 1.0)] {
        let picture = c["picture"].view();
        // The step is the double sum with the exact exponential.
        let found = nl_means(picture, 3.0, 5, 6, noise);
        assert!(apart(&found, &double_sum(picture, (3.0, noise), exact), 0) < 1e-10);
        // scikit-image is the double sum with its own one, to a unit in the last of its 20 bits; its border is reflected at the pixel.
        assert!(apart(&double_sum(picture, (3.0, noise), rough), &c[name], 8) < 1e-5);
        // What this makes of a picture with noise of 2.
        let left = (&found - &c[name]).slice_move(s![8..32, 8..40]);
        assert!(samples::rms(left) < 0.02);
    }
}

#[test]
fn sharpening_agrees_with_scikit_image_scipy_and_opencv() {
    let c = columns();
    let picture = c["picture"].view();
    assert!(apart(&gaussian(picture, 1.5), &c["gaussian_1.5"], 0) < DIGITS);
    assert!(apart(&unsharp(picture, 1.5, 0.8, 0.0), &c["unsharp_1.5_0.8"], 0) < DIGITS);
    for name in ["laplacian", "laplacian_opencv"] {
        assert!(apart(&laplacian(picture), &c[name], 0) < DIGITS);
    }
    let (down, across) = gradient(picture);
    assert!(apart(&down, &c["sobel_down"], 0) < DIGITS && apart(&across, &c["sobel_across"], 0) < DIGITS);
}

/// The curve of a part as OpenCV makes it: whole counts, what is left after even shares goes to every k-th bin from the first on, and the curve is
/// rounded to a level.
fn curve_of_opencv(clip: f64) -> impl Fn(Vec<f64>, f64) -> Vec<f64> {
    move |counts, pixels| {
        let most = ((clip * pixels / 256.0) as u64).max(1);
        let counts: Vec<u64> = counts.into_iter().map(|n| n as u64).collect();
        let excess: u64 = counts.iter().map(|n| n.saturating_sub(most)).sum();
        let (share, mut rest) = (excess / 256, excess % 256);
        let step = (256 / rest.max(1)).max(1) as usize;
        let mut sum = 0;
        let level = |(bin, n): (usize, &u64)| {
            sum += n.min(&most) + share;
            if bin % step == 0 && rest > 0 {
                (sum, rest) = (sum + 1, rest - 1);
            }
            (sum as f64 * 255.0 / pixels).round_ties_even().min(255.0) / 255.0
        };
        counts.iter().enumerate().map(level).collect()
    }
}

#[test]
fn equalisation_agrees_with_the_eight_bits_of_opencv() {
    let c = columns();
    let levels = c["levels"].view();
    // OpenCV rounds its result to a level.
    assert!(apart(&equalize(levels), &c["equalize_levels"], 0) <= 0.5 + 1e-9);
    // Without a limit, it rounds the curve of a part and the result.
    assert!(apart(&clahe(levels, 1000.0, 4), &c["clahe_levels_1000_4"], 0) <= 1.0 + 1e-9);
    // With a limit, it gives out whole counts, the last of them to some bins only. All else is the same.
    for (name, clip, tiles) in [("clahe_levels_2_4", 2.0, 4), ("clahe_levels_8_2", 8.0, 2)] {
        let found = clahe::with_curves(levels, tiles, curve_of_opencv(clip));
        let difference = apart(&found, &c[name], 0);
        // Its weights are in single precision: a half may be rounded to either side.
        assert!(difference <= 0.5 + 1e-4, "{name}: {difference}");
    }
}

#[test]
fn upsampling_agrees_with_opencv() {
    let c = columns();
    let small = c["picture"].slice(s![..;2, ..;2]).to_owned();
    let edges = Placing::Edges;
    // OpenCV repeats the last pixel beyond the border, and has weights in single precision.
    assert!(apart(&bilinear(small.view(), 2, edges), &c["bilinear_2"], 0) < SINGLE);
    assert!(apart(&bicubic(small.view(), 2, -0.75, edges), &c["bicubic_2"], 4) < SINGLE);
    assert!(apart(&lanczos(small.view(), 2, 4, edges), &c["lanczos_2"], 8) < SINGLE);
}

#[test]
fn deconvolution_agrees_with_scikit_image() {
    let c = columns();
    let picture = c["picture"].view();
    let rows = [[1, 2, 1, 0, 0], [2, 6, 4, 1, 0], [1, 5, 9, 4, 1], [0, 2, 4, 3, 1], [0, 0, 1, 1, 1]];
    let psf = Psf::new(Array2::from_shape_fn((5, 5), |(r, c)| f64::from(rows[r][c])).view(), 1.0).unwrap();
    assert!(apart(&wiener_deconvolution(picture, &psf, 0.05), &c["wiener_deconvolution"], 0) < DIGITS);
    // scikit-image takes zeros beyond the border, which eight convolutions carry 16 pixels into the picture.
    let out = richardson_lucy(picture, &psf, 4).unwrap();
    let inner = s![16..24, 16..32];
    let relative = (&out.slice(inner) / &c["richardson_lucy_4"].slice(inner) - 1.0).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    assert!(relative < 1e-9, "{relative}");
}
