//! Measures of the quality of an image, alone and compared with a true image.

use super::noise::robust_rms;
use crate::{ChainError, Result};
use cittert_arrays::{Image, RestoringBeam, SkyFrame, SkyGrid};
use ndarray::{Array2, ArrayView2};
use serde::{Deserialize, Serialize};

/// The pixels that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Region {
    /// All pixels.
    #[default]
    All,
    /// A disc around the middle of the frame.
    Disc {
        /// Radius as a fraction of the smaller side of the frame; 0.5 touches its edge.
        radius: f64,
    },
}

impl Region {
    /// True for the pixels of the region \[m, l\].
    ///
    /// # Errors
    /// The radius is not positive.
    pub fn mask(self, n_m: usize, n_l: usize) -> Result<Array2<bool>> {
        match self {
            Self::All => Ok(Array2::from_elem((n_m, n_l), true)),
            Self::Disc { radius } if radius.is_finite() && radius > 0.0 => {
                let r = radius * n_m.min(n_l) as f64;
                Ok(Array2::from_shape_fn((n_m, n_l), |(row, column)| {
                    (row as f64 - (n_m / 2) as f64).hypot(column as f64 - (n_l / 2) as f64) <= r
                }))
            }
            Self::Disc { radius } => Err(ChainError::bad_option("radius of the disc", radius, "a positive fraction of the frame")),
        }
    }
}

/// Options of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CompareOptions {
    /// The pixels that are compared.
    pub region: Region,
    /// Convolve the truth with this beam first. The brightness of a uniform sky does not change.
    pub beam: Option<RestoringBeam>,
}

/// The result of the comparison of an image with its truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// Root mean square of image minus truth, in the unit of the images.
    pub rms: f64,
    /// `rms` divided by the root mean square of the truth.
    pub nrmse: f64,
    /// See [`dynamic_range`]; of the image alone.
    pub dynamic_range: f64,
    /// See [`fidelity_index`].
    pub fidelity: f64,
    /// See [`ssim`].
    pub ssim: f64,
    /// Peak of the image divided by the peak of the truth.
    pub peak_ratio: f64,
    /// Sum of the image divided by the sum of the truth.
    pub flux_ratio: f64,
}

/// Compare two planes \[m, l\] on the same grid, pixel by pixel.
///
/// # Errors
/// The shapes differ, a pixel is not finite, the truth is zero everywhere in the region, or the region is empty.
pub fn compare_planes(image: ArrayView2<'_, f64>, truth: ArrayView2<'_, f64>, region: &Array2<bool>) -> Result<Fidelity> {
    if image.dim() != truth.dim() || image.dim() != region.dim() {
        return Err(ChainError::Incompatible(format!(
            "the image is {} x {} pixels and the truth {} x {}",
            image.ncols(),
            image.nrows(),
            truth.ncols(),
            truth.nrows()
        )));
    }
    for (name, plane) in [("image", image), ("truth", truth)] {
        if let Some(((row, column), v)) = plane.indexed_iter().find(|(_, v)| !v.is_finite()) {
            return Err(ChainError::Incompatible(format!("the {name} is {v} at column {column}, row {row}")));
        }
    }
    let pixels: Vec<(f64, f64)> = image.iter().zip(truth).zip(region).filter(|(_, inside)| **inside).map(|((i, t), _)| (*i, *t)).collect();
    let truth_rms = rms(pixels.iter().map(|p| p.1));
    if pixels.is_empty() || truth_rms == 0.0 {
        return Err(ChainError::NoData("the truth is zero everywhere in the region, so no relative error exists".into()));
    }
    let error = rms(pixels.iter().map(|p| p.0 - p.1));
    let peak = |pick: fn(&(f64, f64)) -> f64| pixels.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
    Ok(Fidelity {
        rms: error,
        nrmse: error / truth_rms,
        dynamic_range: dynamic_range(image),
        fidelity: fidelity_index(&pixels),
        ssim: ssim(image, truth, region),
        peak_ratio: peak(|p| p.0) / peak(|p| p.1),
        flux_ratio: pixels.iter().map(|p| p.0).sum::<f64>() / pixels.iter().map(|p| p.1).sum::<f64>(),
    })
}

/// Compare the first plane of two images.
///
/// # Errors
/// The grids differ in size, cell, frame or centre (the message names it), or the units differ. Also as [`compare_planes`].
pub fn compare(image: &Image, truth: &Image, options: &CompareOptions) -> Result<Fidelity> {
    check_alignment(&image.grid, &truth.grid)?;
    if image.unit != truth.unit && ![image.unit, truth.unit].contains(&cittert_arrays::BrightnessUnit::Other) {
        return Err(ChainError::Incompatible(format!("the image is in {:?} and the truth in {:?}", image.unit, truth.unit)));
    }
    let region = options.region.mask(image.grid.n_m, image.grid.n_l)?;
    let plane = truth.plane(0, 0);
    match options.beam {
        Some(beam) => compare_planes(image.plane(0, 0), convolve(plane, &truth.grid, &beam)?.view(), &region),
        None => compare_planes(image.plane(0, 0), plane, &region),
    }
}

/// Check that two grids have the same direction at the same pixel.
///
/// # Errors
/// The grids differ. The message gives the first difference with both values.
pub fn check_alignment(a: &SkyGrid, b: &SkyGrid) -> Result<()> {
    let differ = |what: &str, x: String, y: String| Err(ChainError::Incompatible(format!("the {what} differs: {x} against {y}")));
    if (a.n_l, a.n_m) != (b.n_l, b.n_m) {
        return differ("size", format!("{} x {}", a.n_l, a.n_m), format!("{} x {}", b.n_l, b.n_m));
    }
    let arcsec = |x: f64| format!("{:.6} arcsec", x.to_degrees() * 3600.0);
    // A hundredth of a cell at the edge of the frame.
    if (a.cell_rad - b.cell_rad).abs() * a.n_l.max(a.n_m) as f64 > 0.02 * a.cell_rad {
        return differ("cell", arcsec(a.cell_rad), arcsec(b.cell_rad));
    }
    match (&a.frame, &b.frame) {
        (SkyFrame::Boresight, SkyFrame::Boresight) => Ok(()),
        (SkyFrame::Sky { ra_rad, dec_rad, .. }, SkyFrame::Sky { ra_rad: ra, dec_rad: dec, .. }) => {
            let d_ra = (ra_rad - ra + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
            if (d_ra * dec.cos()).hypot(dec_rad - dec) > 0.01 * a.cell_rad {
                let show = |ra: f64, dec: f64| format!("RA {:.6} deg, Dec {:.6} deg", ra.to_degrees(), dec.to_degrees());
                return differ("centre", show(*ra_rad, *dec_rad), show(*ra, *dec));
            }
            Ok(())
        }
        _ => differ("frame", format!("{:?}", a.frame), format!("{:?}", b.frame)),
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0_u64, 0.0), |(n, s), v| (n + 1, s + v * v));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

/// Dynamic range: the largest pixel divided by the [`robust_rms`] of the whole image. It is infinite for an image without noise.
#[must_use]
pub fn dynamic_range(plane: ArrayView2<'_, f64>) -> f64 {
    let peak = plane.iter().copied().filter(|v| v.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let noise = robust_rms(plane);
    if noise == 0.0 { f64::INFINITY } else { peak / noise }
}

/// Dynamic range with the noise measured off source: the largest pixel divided by the rms of the pixels outside `on_source` \[m, l\].
///
/// # Errors
/// The mask has another shape, or no finite pixel lies outside it.
pub fn off_source_dynamic_range(plane: ArrayView2<'_, f64>, on_source: &Array2<bool>) -> Result<f64> {
    let outside = || plane.iter().zip(on_source).filter(|(v, on)| !**on && v.is_finite()).map(|(v, _)| *v);
    if plane.dim() != on_source.dim() || outside().next().is_none() {
        return Err(ChainError::NoData("no pixel lies outside the source, so there is no noise to measure".into()));
    }
    let peak = plane.iter().copied().filter(|v| v.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let noise = rms(outside());
    Ok(if noise > 0.0 { peak / noise } else { f64::INFINITY })
}

/// Fidelity index: the sum of T^2 divided by the sum of |T| |I - T| over the pixels (I, T) of image and truth. It is the inverse of the
/// relative error, weighted by brightness, and infinite for a perfect image.
///
/// # Reference
/// Pety, Gueth & Guilloteau 2001, ALMA Memo 398, where the fidelity of a pixel is |T| / |I - T|. Here the pixels have the weights
/// |T| |I - T|, so that neither empty pixels nor pixels with an accidentally small error dominate the mean.
#[must_use]
pub fn fidelity_index(pixels: &[(f64, f64)]) -> f64 {
    let (above, below) = pixels.iter().fold((0.0, 0.0), |(a, b), (i, t)| (a + t * t, b + t.abs() * (i - t).abs()));
    if below > 0.0 { above / below } else { f64::INFINITY }
}

/// Structural similarity, averaged over the region. The windows are Gaussians of 11 x 11 pixels with sigma 1.5, K1 = 0.01 and K2 = 0.03. The
/// dynamic range L is the range of the truth. Windows that extend over the edge are left out, unless the region has no others. The result is
/// NaN for an empty region and for a truth that is 0 everywhere.
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
    let inside: Vec<(usize, usize)> = region.indexed_iter().filter(|(_, on)| **on).map(|(i, _)| i).collect();
    let any_whole = inside.iter().any(|i| whole(*i));
    let (n, sum) = inside.into_iter().filter(|i| !any_whole || whole(*i)).fold((0_u64, 0.0), |(n, s), i| (n + 1, s + value(i)));
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

/// A plane convolved with a Gaussian beam whose sum is 1: the average of the brightness over the beam. Outside the frame the sky is taken as 0.
///
/// # Errors
/// The beam has no width, or is wider than the frame.
pub fn convolve(plane: ArrayView2<'_, f64>, grid: &SkyGrid, beam: &RestoringBeam) -> Result<Array2<f64>> {
    let widest = beam.bmaj_rad / grid.cell_rad;
    if !(beam.bmin_rad > 0.0 && beam.bmaj_rad >= beam.bmin_rad && widest < grid.n_l.max(grid.n_m) as f64 && beam.bpa_rad.is_finite()) {
        let value = format!("{} x {} rad", beam.bmaj_rad, beam.bmin_rad);
        return Err(ChainError::bad_option("beam", value, "positive axes below the width of the image"));
    }
    // The covariance of the beam in cells (column, row) is separated into a vertical Gaussian and a horizontal one. The centre of the
    // horizontal one shifts by `slope` from row to row, so that each row needs taps only at the tilted beam.
    let to_sigma = 1.0 / (2.0 * (2.0 * std::f64::consts::LN_2).sqrt() * grid.cell_rad);
    let (major, minor) = ((beam.bmaj_rad * to_sigma).powi(2), (beam.bmin_rad * to_sigma).powi(2));
    let (sin, cos) = beam.bpa_rad.sin_cos();
    let sin = sin * grid.l_sign();
    let (cxx, cyy, cxy) = (major * sin * sin + minor * cos * cos, major * cos * cos + minor * sin * sin, (major - minor) * sin * cos);
    let (slope, across) = (cxy / cyy, cxx - cxy * cxy / cyy);
    let reach = |variance: f64| (5.0 * variance.sqrt()).ceil() as isize;
    let (rx, ry) = (reach(across) + 1, reach(cyy));
    let (rows, columns) = plane.dim();
    let mut out = Array2::zeros((rows, columns));
    let mut total = 0.0;
    for dy in -ry..=ry {
        let center = slope * dy as f64;
        let first = (center.round() as isize) - rx;
        let taps: Vec<f64> = (0..=2 * rx)
            .map(|k| (-(((first + k) as f64 - center).powi(2)) / (2.0 * across) - (dy * dy) as f64 / (2.0 * cyy)).exp())
            .collect();
        total += taps.iter().sum::<f64>();
        for row in 0..rows {
            let Some(from) = row.checked_add_signed(-dy).filter(|r| *r < rows) else { continue };
            let source = plane.row(from);
            for column in 0..columns {
                let mut sum = 0.0;
                for (k, tap) in taps.iter().enumerate() {
                    if let Some(c) = column.checked_add_signed(-(first + k as isize)).filter(|c| *c < columns) {
                        sum += tap * source[c];
                    }
                }
                out[[row, column]] += sum;
            }
        }
    }
    out /= total;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    fn grid(n: usize, frame: SkyFrame) -> SkyGrid {
        SkyGrid::new(n, n, 1e-3, frame).unwrap()
    }

    fn sky() -> SkyFrame {
        SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.3, frame: "icrs".into() }
    }

    fn all(n: usize) -> Array2<bool> {
        Array2::from_elem((n, n), true)
    }

    #[test]
    fn a_perfect_image_is_perfect() {
        let t = Array2::from_shape_fn((32, 32), |(r, c)| ((r * 3 + c * 5) % 17) as f64);
        let f = compare_planes(t.view(), t.view(), &all(32)).unwrap();
        assert_eq!((f.rms, f.nrmse, f.fidelity, f.peak_ratio, f.flux_ratio), (0.0, 0.0, f64::INFINITY, 1.0, 1.0));
        assert!((f.ssim - 1.0).abs() < 1e-12);
    }

    #[test]
    fn known_answers_of_a_small_image() {
        let t = array![[1.0, 2.0], [3.0, 4.0]];
        let i = array![[1.5, 2.0], [3.0, 3.0]];
        let f = compare_planes(i.view(), t.view(), &all(2)).unwrap();
        assert!((f.rms - (1.25_f64 / 4.0).sqrt()).abs() < 1e-15);
        assert!((f.nrmse - (1.25_f64 / 30.0).sqrt()).abs() < 1e-15);
        // 30 / (1 x 0.5 + 4 x 1).
        assert!((f.fidelity - 30.0 / 4.5).abs() < 1e-14);
        assert_eq!((f.peak_ratio, f.flux_ratio), (0.75, 0.95));
        // Median 2.5, distances 1, 0.5, 0.5, 0.5: robust rms 1.4826 x 0.5.
        assert!((f.dynamic_range - 3.0 / (1.482_602_218_505_602 * 0.5)).abs() < 1e-12);
        let on = array![[false, false], [true, true]];
        let dr = off_source_dynamic_range(i.view(), &on).unwrap();
        assert!((dr - 3.0 / (0.5_f64 * (2.25 + 4.0)).sqrt()).abs() < 1e-14);
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
    fn a_convolved_point_is_the_beam_with_its_position_angle() {
        let beam = RestoringBeam { bmaj_rad: 8e-3, bmin_rad: 4e-3, bpa_rad: 0.6 };
        for frame in [sky(), SkyFrame::Boresight] {
            let g = grid(48, frame);
            let mut plane = Array2::zeros((48, 48));
            plane[[24, 24]] = 1.0;
            let out = convolve(plane.view(), &g, &beam).unwrap();
            assert!((out.sum() - 1.0).abs() < 1e-5);
            let at = |along: f64, across: f64| {
                let (sin, cos) = 0.6_f64.sin_cos();
                let (l, m) = (along * sin + across * cos, along * cos - across * sin);
                (g.column_of(l).round() as usize, g.row_of(m).round() as usize)
            };
            for (along, across) in [(4e-3, 0.0), (0.0, 2e-3), (3e-3, 1e-3)] {
                let (column, row) = at(along, across);
                // The exact offset of that pixel from the middle.
                let (l, m) = (g.l_at(column as f64), g.m_at(row as f64));
                let (x, y) = (l * 0.6_f64.sin() + m * 0.6_f64.cos(), l * 0.6_f64.cos() - m * 0.6_f64.sin());
                let truth = (-4.0 * std::f64::consts::LN_2 * ((x / 8e-3).powi(2) + (y / 4e-3).powi(2))).exp();
                assert!((out[[row, column]] / out[[24, 24]] - truth).abs() < 1e-9, "{along} {across}");
            }
        }
    }

    #[test]
    fn the_disc_and_the_alignment_are_checked() {
        let mask = Region::Disc { radius: 0.25 }.mask(16, 16).unwrap();
        assert!(mask[[8, 12]] && !mask[[8, 13]] && !mask[[0, 0]]);
        assert!(Region::Disc { radius: 0.0 }.mask(16, 16).is_err());
        let a = grid(16, sky());
        check_alignment(&a, &a).unwrap();
        let say = |b: &SkyGrid| check_alignment(&a, b).unwrap_err().to_string();
        assert!(say(&grid(17, sky())).contains("size"));
        assert!(say(&SkyGrid { cell_rad: 1.1e-3, ..a.clone() }).contains("cell"));
        assert!(say(&grid(16, SkyFrame::Boresight)).contains("frame"));
        assert!(say(&grid(16, SkyFrame::Sky { ra_rad: 1.1, dec_rad: 0.3, frame: "icrs".into() })).contains("centre"));
    }

    #[test]
    fn nothing_to_compare_is_an_error() {
        let zero = Array2::zeros((4, 4));
        assert!(compare_planes(zero.view(), zero.view(), &all(4)).is_err());
        let mut nan = Array2::ones((4, 4));
        nan[[1, 2]] = f64::NAN;
        let e = compare_planes(nan.view(), Array2::ones((4, 4)).view(), &all(4)).unwrap_err().to_string();
        assert!(e.contains("column 2, row 1"), "{e}");
    }
}
