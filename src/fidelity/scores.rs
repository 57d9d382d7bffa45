//! The scores of an image against its truth. This file has the only definition of each; the book lists them in `docs/algorithms/scores.md`.

use super::noise::robust_rms;
use crate::{ChainError, Result};
use ndarray::{Array2, ArrayView2};
use serde::{Deserialize, Serialize};

/// The scores of an image I against its truth T, over the pixels of a region.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// Root mean square of I - T, in the unit of the images.
    pub rms_difference: f64,
    /// `rms_difference` divided by the root mean square of T. A constant background of T counts as brightness here, and makes the score
    /// small for any image that has it.
    pub nrmse: f64,
    /// Rms of the difference from the truth over the rms of the truth less its mean: 1 is no better than a flat grey card, 0 is perfect.
    pub error_over_grey_card: f64,
    /// See [`peak_over_robust_rms`]; of the image alone.
    pub peak_over_robust_rms: f64,
    /// See [`fidelity_index`].
    pub fidelity: f64,
    /// See [`ssim`].
    pub ssim: f64,
    /// Peak of the image divided by the peak of the truth.
    pub peak_ratio: f64,
    /// Sum of the image divided by the sum of the truth.
    pub flux_ratio: f64,
}

/// Compare two planes \[m, l\] on the same grid, pixel by pixel. Pixels that are not finite in both are left out.
///
/// # Errors
/// The shapes differ, the truth is zero everywhere in the region, or the region has no finite pixel.
pub fn compare_planes(image: ArrayView2<'_, f64>, truth: ArrayView2<'_, f64>, region: &Array2<bool>) -> Result<Fidelity> {
    compare_planes_through(image, truth, None, region)
}

/// [`compare_planes`] for planes that contain the power pattern of the elements: the grey card is seen through the pattern too.
///
/// # Errors
/// As [`compare_planes`].
pub fn compare_planes_through(
    image: ArrayView2<'_, f64>,
    truth: ArrayView2<'_, f64>,
    pattern: Option<ArrayView2<'_, f64>>,
    region: &Array2<bool>,
) -> Result<Fidelity> {
    if image.dim() != truth.dim() || image.dim() != region.dim() {
        return Err(ChainError::Incompatible(format!(
            "the image is {} x {} pixels and the truth {} x {}",
            image.ncols(),
            image.nrows(),
            truth.ncols(),
            truth.nrows()
        )));
    }
    let both = |((i, t), inside): ((&f64, &f64), &bool)| (*inside && i.is_finite() && t.is_finite()).then_some((*i, *t));
    let pixels: Vec<(f64, f64)> = image.iter().zip(truth).zip(region).filter_map(both).collect();
    if pixels.is_empty() {
        return Err(ChainError::NoData("no pixel of the region has a value in both images".into()));
    }
    let error_over_grey_card = match pattern {
        None => error_over_grey_card(&pixels),
        Some(pattern) => {
            let kept = image.iter().zip(truth).zip(region).zip(pattern);
            let seen: Vec<f64> = kept.filter(|((pair, inside), _)| both((*pair, inside)).is_some()).map(|(_, a)| *a).collect();
            error_over_seen_card(&pixels, &seen)
        }
    };
    let truth_rms = rms(pixels.iter().map(|p| p.1));
    if truth_rms == 0.0 {
        return Err(ChainError::NoData("the truth is zero everywhere in the region, so no relative error exists".into()));
    }
    let rms_difference = rms(pixels.iter().map(|p| p.0 - p.1));
    let peak = |pick: fn(&(f64, f64)) -> f64| pixels.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
    Ok(Fidelity {
        rms_difference,
        nrmse: rms_difference / truth_rms,
        error_over_grey_card,
        peak_over_robust_rms: peak_over_robust_rms(image),
        fidelity: fidelity_index(&pixels),
        ssim: ssim(image, truth, region),
        peak_ratio: peak(|p| p.0) / peak(|p| p.1),
        flux_ratio: pixels.iter().map(|p| p.0).sum::<f64>() / pixels.iter().map(|p| p.1).sum::<f64>(),
    })
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0_u64, 0.0), |(n, s), v| (n + 1, s + v * v));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

/// Error relative to a grey card: rms(I - T) / rms(T - mean T) over the pixels (I, T) of image and truth. 0 is a perfect image. 1 is an image
/// that is no better than a flat grey card with the mean brightness of the truth. A constant that image and truth share does not change it.
/// It is infinite where the truth is flat and the image is not the same.
#[must_use]
pub fn error_over_grey_card(pixels: &[(f64, f64)]) -> f64 {
    let mean = pixels.iter().map(|p| p.1).sum::<f64>() / pixels.len().max(1) as f64;
    let (error, card) = (rms(pixels.iter().map(|p| p.0 - p.1)), rms(pixels.iter().map(|p| p.1 - mean)));
    if error == 0.0 { 0.0 } else { error / card }
}

/// [`error_over_grey_card`] where image and truth are the scene times a pattern, with the value of the pattern at each pixel. The card is the flat
/// scene times the pattern that comes closest to the truth. Without this, the shape of the pattern alone would count as detail of a warm scene.
fn error_over_seen_card(pixels: &[(f64, f64)], pattern: &[f64]) -> f64 {
    let (along, size) = pixels.iter().zip(pattern).fold((0.0, 0.0), |(t, a), (p, w)| (t + p.1 * w, a + w * w));
    let level = if size > 0.0 { along / size } else { 0.0 };
    let (error, card) = (rms(pixels.iter().map(|p| p.0 - p.1)), rms(pixels.iter().zip(pattern).map(|(p, w)| p.1 - level * w)));
    if error == 0.0 { 0.0 } else { error / card }
}

/// The largest pixel divided by the [`robust_rms`] of the whole image. It is infinite for an image without noise. Unlike the dynamic range,
/// it needs no residual image.
#[must_use]
pub fn peak_over_robust_rms(plane: ArrayView2<'_, f64>) -> f64 {
    let peak = plane.iter().copied().filter(|v| v.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let noise = robust_rms(plane);
    if noise == 0.0 { f64::INFINITY } else { peak / noise }
}

/// The fidelity of each pixel: |T| divided by |I - T|, or by 0.7 rms(I - T) where the error is smaller by accident. NaN where either is blank.
///
/// # Reference
/// Pety, Gueth & Guilloteau 2001, ALMA Memo 398; the limit is the one of CASA's `simanalyze`.
///
/// # Errors
/// The shapes differ.
pub fn fidelity_of_pixel(image: ArrayView2<'_, f64>, truth: ArrayView2<'_, f64>) -> Result<Array2<f64>> {
    if image.dim() != truth.dim() {
        return Err(ChainError::Incompatible("the image and the truth have different sizes".into()));
    }
    let difference = &image - &truth;
    let least = 0.7 * rms(difference.iter().copied().filter(|d| d.is_finite()));
    Ok(ndarray::Zip::from(&truth).and(&difference).map_collect(|t, d| if d.is_finite() { t.abs() / d.abs().max(least) } else { f64::NAN }))
}

/// Fidelity index: the sum of T^2 divided by the sum of |T| |I - T| over the pixels (I, T) of image and truth. It is the inverse of the
/// relative error, weighted by brightness. It is infinite for a perfect image, and NaN for a truth that is 0 everywhere.
///
/// # Reference
/// Pety, Gueth & Guilloteau 2001, ALMA Memo 398, where the fidelity of a pixel is |T| / |I - T|. Here the pixels have the weights
/// |T| |I - T|, so that neither empty pixels nor pixels with an accidentally small error dominate the mean.
#[must_use]
pub fn fidelity_index(pixels: &[(f64, f64)]) -> f64 {
    let (above, below) = pixels.iter().fold((0.0, 0.0), |(a, b), (i, t)| (a + t * t, b + t.abs() * (i - t).abs()));
    match (above > 0.0, below > 0.0) {
        (_, true) => above / below,
        (true, false) => f64::INFINITY,
        (false, false) => f64::NAN,
    }
}

/// Structural similarity, averaged over the region. The windows are Gaussians of 11 x 11 pixels with sigma 1.5, K1 = 0.01 and K2 = 0.03. The
/// constant L is the range of the truth. Windows that extend over the edge are left out, unless the region has no others. Windows that contain a
/// blank pixel are left out always. The result is NaN for an empty region and for a truth that is 0 everywhere.
///
/// # Reference
/// Wang, Bovik, Sheikh & Simoncelli 2004, IEEE Trans. Image Process. 13, 600, eqs 13-17.
#[must_use]
pub fn ssim(image: ArrayView2<'_, f64>, truth: ArrayView2<'_, f64>, region: &Array2<bool>) -> f64 {
    let (low, high) = truth.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let range = if high > low { high - low } else { high.abs() };
    let (c1, c2) = ((0.01 * range).powi(2), (0.03 * range).powi(2));
    let kernel: Vec<f64> = (-5..=5).map(|k| (-f64::from(k * k) / 4.5).exp()).collect();
    let total: f64 = kernel.iter().sum();
    let kernel: Vec<f64> = kernel.iter().map(|k| k / total).collect();
    let mean = |a: ArrayView2<'_, f64>, b: Option<ArrayView2<'_, f64>>| match b {
        Some(b) => smooth(&(&a * &b), &kernel),
        None => smooth(&a.to_owned(), &kernel),
    };
    let (mx, my) = (mean(image, None), mean(truth, None));
    let (xx, yy, xy) = (mean(image, Some(image)), mean(truth, Some(truth)), mean(image, Some(truth)));
    let value = |i: (usize, usize)| {
        let (mx, my) = (mx[i], my[i]);
        let (vx, vy, cov) = (xx[i] - mx * mx, yy[i] - my * my, xy[i] - mx * my);
        (2.0 * mx * my + c1) * (2.0 * cov + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2))
    };
    let (rows, columns) = image.dim();
    let whole = |(r, c): (usize, usize)| r >= 5 && c >= 5 && r + 5 < rows && c + 5 < columns;
    let at = |(i, on): ((usize, usize), &bool)| on.then(|| (i, value(i))).filter(|(_, v)| range > 0.0 && v.is_finite());
    let inside: Vec<((usize, usize), f64)> = region.indexed_iter().filter_map(at).collect();
    let any_whole = inside.iter().any(|(i, _)| whole(*i));
    let (n, sum) = inside.into_iter().filter(|(i, _)| !any_whole || whole(*i)).fold((0_u64, 0.0), |(n, s), (_, v)| (n + 1, s + v));
    if n == 0 || range == 0.0 { f64::NAN } else { sum / n as f64 }
}

/// Separable smoothing with a kernel of odd length. Near an edge the part of the kernel inside the image is normalised.
fn smooth(plane: &Array2<f64>, kernel: &[f64]) -> Array2<f64> {
    let half = kernel.len() / 2;
    let line = |from: ndarray::ArrayView1<'_, f64>, at: usize| {
        let (lo, hi) = (at.saturating_sub(half), (at + half + 1).min(from.len()));
        let (sum, weight) = (lo..hi).fold((0.0, 0.0), |(s, w), k| {
            let g = kernel[k + half - at];
            (s + g * from[k], w + g)
        });
        sum / weight
    };
    let across = Array2::from_shape_fn(plane.dim(), |(r, c)| line(plane.row(r), c));
    Array2::from_shape_fn(plane.dim(), |(r, c)| line(across.column(c), r))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    fn all(n: usize) -> Array2<bool> {
        Array2::from_elem((n, n), true)
    }

    #[test]
    fn a_perfect_image_is_perfect() {
        let t = Array2::from_shape_fn((32, 32), |(r, c)| ((r * 3 + c * 5) % 17) as f64);
        let f = compare_planes(t.view(), t.view(), &all(32)).unwrap();
        assert_eq!((f.rms_difference, f.nrmse, f.fidelity, f.peak_ratio, f.flux_ratio), (0.0, 0.0, f64::INFINITY, 1.0, 1.0));
        assert!((f.ssim - 1.0).abs() < 1e-12);
    }

    #[test]
    fn known_answers_of_a_small_image() {
        let t = array![[1.0, 2.0], [3.0, 4.0]];
        let i = array![[1.5, 2.0], [3.0, 3.0]];
        let f = compare_planes(i.view(), t.view(), &all(2)).unwrap();
        assert!((f.rms_difference - (1.25_f64 / 4.0).sqrt()).abs() < 1e-15);
        assert!((f.nrmse - (1.25_f64 / 30.0).sqrt()).abs() < 1e-15);
        // 30 / (1 x 0.5 + 4 x 1).
        assert!((f.fidelity - 30.0 / 4.5).abs() < 1e-14);
        assert_eq!((f.peak_ratio, f.flux_ratio), (0.75, 0.95));
        // Median 2.5, distances 1, 0.5, 0.5, 0.5: robust rms 1.4826 x 0.5.
        assert!((f.peak_over_robust_rms - 3.0 / (1.482_602_218_505_602 * 0.5)).abs() < 1e-12);
    }

    #[test]
    fn ssim_of_scaled_and_shifted_images_has_its_closed_form() {
        // A constant shift of a flat truth: only the luminance term is left, with L = |truth|.
        let t = Array2::from_elem((20, 20), 10.0);
        let i = Array2::from_elem((20, 20), 12.0);
        let c1 = 0.01;
        let truth = (2.0 * 120.0 + c1) / (144.0 + 100.0 + c1);
        assert!((ssim(i.view(), t.view(), &all(20)) - truth).abs() < 1e-12);
        // The negative of a pattern of zero local mean is anticorrelated.
        let t = Array2::from_shape_fn((32, 32), |(r, c)| if (r + c) % 2 == 0 { 1.0 } else { -1.0 });
        assert!(ssim((-&t).view(), t.view(), &all(32)) < -0.99);
    }

    #[test]
    fn nothing_to_compare_is_an_error_and_blank_pixels_are_left_out() {
        let zero = Array2::zeros((4, 4));
        assert!(compare_planes(zero.view(), zero.view(), &all(4)).is_err());
        let truth = Array2::from_shape_fn((4, 4), |(r, c)| (1 + r + 2 * c) as f64);
        let mut image = &truth * 1.1;
        let whole = compare_planes(image.view(), truth.view(), &all(4)).unwrap();
        image[[1, 2]] = f64::NAN;
        let mut region = all(4);
        region[[1, 2]] = false;
        let found = compare_planes(image.view(), truth.view(), &all(4)).unwrap();
        let expected = compare_planes((&truth * 1.1).view(), truth.view(), &region).unwrap();
        assert_eq!(found.rms_difference, expected.rms_difference);
        assert!(found.rms_difference != whole.rms_difference);
        image.fill(f64::NAN);
        let e = compare_planes(image.view(), truth.view(), &all(4)).unwrap_err().to_string();
        assert!(e.contains("no pixel"), "{e}");
    }

    /// Through a pattern, a flat card scores 1 however warm the scene is, and the score of an image does not depend on the background.
    #[test]
    fn a_grey_card_seen_through_a_pattern_scores_one() {
        let pattern = Array2::from_shape_fn((24, 24), |(r, c)| (-0.01 * ((r as f64 - 12.0).powi(2) + (c as f64 - 12.0).powi(2))).exp());
        let detail = Array2::from_shape_fn((24, 24), |(r, c)| f64::from(u8::from((r / 3 + c / 5) % 2 == 0)) - 0.5);
        let score = |background_k: f64, share: f64| {
            let truth = (&detail * 40.0 + background_k) * &pattern;
            let image = (&detail * (40.0 * share) + background_k) * &pattern;
            compare_planes_through(image.view(), truth.view(), Some(pattern.view()), &all(24)).unwrap().error_over_grey_card
        };
        for background_k in [0.0, 265.0] {
            assert!((score(background_k, 0.0) - 1.0).abs() < 0.05, "{}", score(background_k, 0.0));
            assert!((score(background_k, 0.5) - 0.5).abs() < 0.03, "{}", score(background_k, 0.5));
        }
    }

    #[test]
    fn a_grey_card_scores_one_with_and_without_a_pedestal() {
        let pattern = Array2::from_shape_fn((16, 16), |(r, c)| ((r * 5 + c * 3) % 7) as f64);
        for pedestal in [0.0, 290.0] {
            let truth = &pattern + pedestal;
            let card = Array2::from_elem((16, 16), truth.mean().unwrap());
            let score = |image: &Array2<f64>| compare_planes(image.view(), truth.view(), &all(16)).unwrap().error_over_grey_card;
            assert!((score(&card) - 1.0).abs() < 1e-12);
            assert_eq!(score(&truth), 0.0);
            // Half of the contrast is lost.
            assert!((score(&(&card + &((&truth - &card) * 0.5))) - 0.5).abs() < 1e-12);
        }
        let nrmse = compare_planes(Array2::from_elem((16, 16), 292.98).view(), (&pattern + 290.0).view(), &all(16)).unwrap().nrmse;
        assert!(nrmse < 0.01, "the pedestal hides the error in the NRMSE: {nrmse}");
    }

    #[test]
    fn the_fidelity_of_a_pixel_has_its_limit() {
        let (t, i) = (array![[1.0, 2.0], [3.0, f64::NAN]], array![[1.5, 2.0], [2.0, 1.0]]);
        let f = fidelity_of_pixel(i.view(), t.view()).unwrap();
        let least = 0.7 * (1.25_f64 / 3.0).sqrt();
        assert_eq!((f[[0, 0]], f[[0, 1]], f[[1, 0]]), (2.0, 2.0 / least, 3.0));
        assert!(f[[1, 1]].is_nan());
    }
}
