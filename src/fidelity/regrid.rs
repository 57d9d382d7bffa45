//! The values of an image at the pixels of another grid.

use super::alignment::Across;
use crate::Result;
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// Half width of the kernels, in pixels of the coarser grid.
const HALF: f64 = 3.0;
/// A pixel of a smaller weight does not count. Without this limit, a blank pixel whose weight is 0 up to rounding would blank its neighbours.
const LEAST_WEIGHT: f64 = 1e-6;

/// The values of a plane \[m, l\] on the grid `from` at the pixels of the grid `to`, by Lagrange interpolation with three pixels on each side.
/// Where the new pixels are larger than the old ones, a Lanczos kernel with the width of the new ones averages instead. Values are brightness:
/// they do not scale with the size of the pixels.
///
/// Six points of Lagrange are exact for polynomials of the fifth degree, and err by 7e-4 of the peak at most for a Gaussian of 2.1 pixels rms,
/// which is a beam of 5 pixels. The mean position of the weights of a Lanczos kernel of the same width is off by up to 0.02 pixels, which
/// costs six times as much.
///
/// A pixel is NaN if its kernel reaches a pixel that is not finite, or over the edge of `from`.
///
/// # Errors
/// One grid has a place on the sky and the other has none.
///
/// # Reference
/// Duchon 1979, J. Appl. Meteor. 18, 1016 (the window).
pub fn regrid(plane: ArrayView2<'_, f64>, from: &SkyGrid, to: &SkyGrid) -> Result<Array2<f64>> {
    let across = Across::new(to, from)?;
    let stretch = (to.cell_rad / from.cell_rad).max(1.0);
    let mut out = Array2::from_elem((to.n_m, to.n_l), f64::NAN);
    out.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut values)| {
        let (mut x, mut y) = (Taps::default(), Taps::default());
        for (column, value) in values.iter_mut().enumerate() {
            let Some((at_x, at_y)) = across.place(column, row) else { continue };
            if x.set(at_x, stretch, from.n_l) && y.set(at_y, stretch, from.n_m) {
                *value = y.iter().map(|(r, wy)| wy * x.iter().map(|(c, wx)| wx * plane[[r, c]]).sum::<f64>()).sum();
            }
        }
    });
    Ok(out)
}

/// Weights of the pixels around a place on one axis.
#[derive(Default)]
struct Taps(Vec<(usize, f64)>);

impl Taps {
    /// Weights around `at` on an axis of `n` pixels; false if they reach over an end of the axis.
    fn set(&mut self, at: f64, stretch: f64, n: usize) -> bool {
        self.0.clear();
        let averages = stretch > 1.0;
        let (first, last) = if averages {
            ((at - HALF * stretch).ceil(), (at + HALF * stretch).floor())
        } else {
            (at.floor() - HALF + 1.0, at.floor() + HALF)
        };
        // A far direction has no pixel. This also keeps the conversion to integers below safe.
        if !(last >= 0.0 && first < n as f64) {
            return false;
        }
        let mut sum = 0.0;
        for k in first as i64..=last as i64 {
            let weight = if averages { lanczos((k as f64 - at) / stretch) } else { lagrange(k as f64, at, first, last) };
            if weight.abs() < LEAST_WEIGHT {
                continue;
            }
            match usize::try_from(k).ok().filter(|k| *k < n) {
                Some(k) => self.0.push((k, weight)),
                None => return false,
            }
            sum += weight;
        }
        self.0.iter_mut().for_each(|(_, w)| *w /= sum);
        true
    }

    fn iter(&self) -> impl Iterator<Item = (usize, f64)> {
        self.0.iter().copied()
    }
}

/// Weight of the point `k` in the interpolation at `at` between all whole numbers from `first` to `last`.
fn lagrange(k: f64, at: f64, first: f64, last: f64) -> f64 {
    let others = (first as i64..=last as i64).map(|j| j as f64).filter(|j| *j != k);
    others.map(|j| (at - j) / (k - j)).product()
}

fn lanczos(x: f64) -> f64 {
    let sinc = |x: f64| if x.abs() < 1e-12 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    if x.abs() < HALF { sinc(x) * sinc(x / HALF) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    fn grid(n: usize, cell_rad: f64, ra_rad: f64) -> SkyGrid {
        SkyGrid::new(n, n, cell_rad, SkyFrame::Sky { ra_rad, dec_rad: 0.3, frame: "icrs".into() }).unwrap()
    }

    /// A Gaussian of 1e-3 rad rms at a fixed place on the sky, a little off the centre of the grid.
    fn blob(g: &SkyGrid, shift: f64) -> Array2<f64> {
        Array2::from_shape_fn((g.n_m, g.n_l), |(r, c)| {
            let (l, m) = (g.l_at(c as f64) - 1.1e-3 + shift, g.m_at(r as f64) + 0.7e-3);
            0.5 + (-(l * l + m * m) / 2e-6).exp()
        })
    }

    #[test]
    fn a_smooth_image_has_the_same_values_on_another_grid() {
        // The centre moves by a thirtieth of a pixel, and by 3.4 pixels. Lagrange errs by 2e-5 for a Gaussian of 4 pixels rms, along each axis.
        // The larger shift also turns the north of the image by 2.6e-4 rad, which the expected image leaves out: that moves pixels which are 12
        // from the centre by 3e-3, and the slope is 0.15 of the peak a pixel. Where the cells are twice as large, the response of the Lanczos
        // kernel to the Gaussian is 1 within 1 %.
        for (cell, by, allowed) in [(2.5e-4, 0.25e-4 / 3.0, 1e-4), (2.5e-4, 8.5e-4, 6e-4), (5e-4, 0.0, 0.01), (1e-4, 0.0, 1e-4)] {
            let (from, to) = (grid(64, 2.5e-4, 1.0), grid(32, cell, 1.0 + by / 0.3_f64.cos()));
            let found = regrid(blob(&from, 0.0).view(), &from, &to).unwrap();
            let expected = blob(&to, by);
            let finite: Vec<f64> = found.iter().zip(&expected).filter(|(f, _)| f.is_finite()).map(|(f, e)| (f - e).abs()).collect();
            let worst = finite.iter().copied().fold(0.0, f64::max);
            assert!(worst < allowed && finite.len() > 600, "{cell} {by}: {worst}, {} pixels", finite.len());
        }
    }

    #[test]
    fn blank_pixels_and_the_outside_stay_blank() {
        let (from, to) = (grid(16, 1e-3, 1.0), grid(20, 1e-3, 1.0));
        let mut plane = Array2::ones((16, 16));
        plane[[4, 5]] = f64::NAN;
        // The pixels of both grids agree, so only the pixel itself and the frame of two pixels are blank.
        let found = regrid(plane.view(), &from, &to).unwrap();
        assert_eq!(found.iter().filter(|v| v.is_nan()).count(), 400 - 256 + 1);
        assert!(found[[6, 7]].is_nan() && found[[6, 8]] == 1.0);
        let half = regrid(plane.view(), &from, &grid(16, 1e-3, 1.0 + 0.5e-3 / 0.3_f64.cos())).unwrap();
        // Half a pixel off, the kernel takes three columns to each side.
        assert!(half.iter().filter(|v| v.is_finite()).all(|v| (v - 1.0).abs() < 1e-12));
        assert!(half[[8, 1]].is_nan() && half[[8, 8]].is_finite());
    }
}
