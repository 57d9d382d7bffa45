//! The restoring beam: an elliptical Gaussian that is fitted to the main lobe of the dirty beam.

use crate::fourier::Real;
use crate::linalg::solve_3;
use cittert_arrays::{RestoringBeam, SkyGrid};
use ndarray::ArrayView2;
use std::collections::VecDeque;

/// The main lobe consists of the pixels above this level that are connected with the peak.
pub(super) const LEVEL: f64 = 0.35;
/// Largest number of pixels in the fit. With more pixels the fit is not more accurate, but slower.
const MOST_PIXELS: usize = 200_000;

/// Fit exp(-(a x^2 + 2 b x y + c y^2)) by least squares to the main lobe of a beam \[m, l\] with its peak of 1 at the centre pixel.
///
/// The fit is in pixels, so its accuracy does not depend on the size of a cell. `None` if the main lobe is narrower than the pixels can show in
/// some direction: the caller needs to give a beam, or a smaller cell.
///
/// # Reference
/// Levenberg-Marquardt: Press et al. 2007, Numerical Recipes, sect. 15.5.
#[must_use]
pub fn fit_beam<P: Real>(grid: &SkyGrid, psf: ArrayView2<'_, P>) -> Option<RestoringBeam> {
    let lobe = main_lobe(psf)?;
    let mut p = start(&lobe)?;
    let mut lambda = 1e-3;
    let mut cost = Normal::of(&lobe, &p).cost;
    for _ in 0..200 {
        let Normal { mut matrix, gradient, .. } = Normal::of(&lobe, &p);
        (0..3).for_each(|k| matrix[k][k] *= 1.0 + lambda);
        let step = solve_3(matrix, gradient)?;
        let next = [p[0] + step[0], p[1] + step[1], p[2] + step[2]];
        let elliptic = next[0] > 0.0 && next[2] > 0.0 && next[0] * next[2] > next[1] * next[1];
        let after = if elliptic { Normal::of(&lobe, &next).cost } else { f64::INFINITY };
        if after <= cost {
            let done = cost - after <= 1e-14 * cost && (0..3).all(|k| step[k].abs() <= 1e-9 * (p[0] + p[2]));
            (p, cost) = (next, after);
            lambda = (lambda * 0.2).max(1e-12);
            if done {
                break;
            }
        } else {
            lambda *= 8.0;
            if lambda > 1e12 {
                break;
            }
        }
    }
    to_beam(grid, p)
}

/// A pixel of the main lobe: its offsets from the peak along l and m, in pixels, and its value.
struct Pixel {
    x: f64,
    y: f64,
    value: f64,
}

fn main_lobe<P: Real>(psf: ArrayView2<'_, P>) -> Option<Vec<Pixel>> {
    let (n_m, n_l) = psf.dim();
    let center = (n_m / 2, n_l / 2);
    if !(psf[center].to64() > LEVEL) {
        return None;
    }
    let mut seen = ndarray::Array2::from_elem((n_m, n_l), false);
    let mut queue = VecDeque::from([center]);
    let mut lobe = Vec::new();
    seen[center] = true;
    while let Some((i, j)) = queue.pop_front() {
        lobe.push(Pixel { x: j as f64 - center.1 as f64, y: i as f64 - center.0 as f64, value: psf[(i, j)].to64() });
        if lobe.len() >= MOST_PIXELS {
            break;
        }
        for (di, dj) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            let next = (i.wrapping_add_signed(di), j.wrapping_add_signed(dj));
            if let (Some(v), Some(s)) = (psf.get(next), seen.get_mut(next))
                && !*s
                && v.to64() > LEVEL
            {
                *s = true;
                queue.push_back(next);
            }
        }
    }
    // A lobe of one row or one column does not show its width. The neighbours of the peak are therefore always included.
    for (di, dj) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)] {
        let at = (center.0.wrapping_add_signed(di), center.1.wrapping_add_signed(dj));
        if let (Some(v), Some(s)) = (psf.get(at), seen.get(at))
            && !*s
        {
            lobe.push(Pixel { x: dj as f64, y: di as f64, value: v.to64() });
        }
    }
    Some(lobe)
}

/// Initial parameters, from a linear least squares fit to -ln of the values with the squared values as weights.
fn start(lobe: &[Pixel]) -> Option<[f64; 3]> {
    let mut matrix = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for Pixel { x, y, value: v } in lobe.iter().filter(|p| p.value > 0.05 && p.value <= 1.0) {
        let row = [x * x, 2.0 * x * y, y * y];
        for i in 0..3 {
            right[i] -= v * v * v.ln() * row[i];
            for j in 0..3 {
                matrix[i][j] += v * v * row[i] * row[j];
            }
        }
    }
    let p = solve_3(matrix, right)?;
    (p[0] > 0.0 && p[2] > 0.0 && p[0] * p[2] > p[1] * p[1]).then_some(p)
}

/// The normal equations of one step of the fit.
#[derive(Default)]
struct Normal {
    matrix: [[f64; 3]; 3],
    gradient: [f64; 3],
    /// Sum of the squared residuals.
    cost: f64,
}

impl Normal {
    fn of(lobe: &[Pixel], p: &[f64; 3]) -> Self {
        let mut n = Self::default();
        for Pixel { x, y, value } in lobe {
            let row = [x * x, 2.0 * x * y, y * y];
            let g = (-(p[0] * row[0] + p[1] * row[1] + p[2] * row[2])).exp();
            let r = value - g;
            n.cost += r * r;
            for i in 0..3 {
                n.gradient[i] -= r * g * row[i];
                for j in 0..3 {
                    n.matrix[i][j] += g * g * row[i] * row[j];
                }
            }
        }
        n
    }
}

fn to_beam(grid: &SkyGrid, p: [f64; 3]) -> Option<RestoringBeam> {
    // Convert from columns to +l, which may point to the left.
    let (a, b, c) = (p[0], p[1] * grid.l_sign(), p[2]);
    let (mean, spread) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
    let (small, large) = (mean - spread, mean + spread);
    if !(small > 0.0 && large.is_finite()) {
        return None;
    }
    let fwhm = |curvature: f64| 2.0 * (std::f64::consts::LN_2 / curvature).sqrt() * grid.cell_rad;
    // The major axis is the eigenvector of the smaller curvature; its angle is counted from +m towards +l.
    let angle = if spread > 1e-12 * mean { 0.5 * (-2.0 * b).atan2(a - c) } else { 0.0 };
    Some(RestoringBeam { bmaj_rad: fwhm(small), bmin_rad: fwhm(large), bpa_rad: angle })
}

#[cfg(test)]
mod tests {
    use super::super::restore::gaussian;
    use super::*;
    use cittert_arrays::SkyFrame;

    #[test]
    fn the_gaussian_that_was_drawn_is_found_in_both_frames_and_any_cell() {
        let sky = SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() };
        for frame in [sky, SkyFrame::Boresight] {
            for cell in [1e-11, 1e-6, 1e-3] {
                for (major, minor, pa) in [(7.0, 4.0, 0.5), (5.0, 4.9, -1.2), (12.0, 2.2, 1.4), (3.0, 3.0, 0.0)] {
                    let grid = SkyGrid::new(64, 48, cell, frame.clone()).unwrap();
                    let beam = RestoringBeam { bmaj_rad: major * cell, bmin_rad: minor * cell, bpa_rad: pa };
                    let fit = fit_beam(&grid, gaussian(&grid, &beam).view()).unwrap();
                    assert!((fit.bmaj_rad / beam.bmaj_rad - 1.0).abs() < 1e-6, "{fit:?} {beam:?}");
                    assert!((fit.bmin_rad / beam.bmin_rad - 1.0).abs() < 1e-6, "{fit:?} {beam:?}");
                    assert!(major - minor < 0.05 || (fit.bpa_rad - pa).sin().abs() < 1e-6, "{fit:?} {beam:?}");
                }
            }
        }
    }

    #[test]
    fn a_beam_without_a_lobe_is_none() {
        let grid = SkyGrid::new(8, 8, 1e-3, SkyFrame::Boresight).unwrap();
        assert!(fit_beam(&grid, ndarray::Array2::<f64>::zeros((8, 8)).view()).is_none());
    }
}
