//! Edge response: how many pixels an image needs from dark to bright.

use super::smooth::gaussian;
use super::sobel::gradient;
use cittert_arrays::{Image, SkyGrid};
use ndarray::ArrayView2;

/// The image is smoothed by this many pixels before its edges are looked for, so that they are edges and no noise.
const SMOOTHING: f64 = 1.0;
/// Most edges whose profiles are averaged, the steepest ones.
const MOST: usize = 300;
/// Fewest edges of which a mean profile is made.
const FEWEST: usize = 10;
/// An edge is at least this part as steep as the steepest.
const STEEP: f64 = 0.3;
/// Half length of a profile, pixels. The levels on both sides are means from `PLATEAU` on.
const REACH: f64 = 8.0;
const PLATEAU: f64 = 6.0;
/// Samples of a profile for each pixel.
const FINE: usize = 4;

/// The steepest places of an image, and the directions across their edges. Other images of the same field are measured at the same places.
#[derive(Debug, Clone, PartialEq)]
pub struct Edges {
    grid: SkyGrid,
    /// Row and column, and the unit vector towards the bright side.
    places: Vec<[f64; 4]>,
}

/// The mean profile across edges, in figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeResponse {
    /// Distance from 10 % to 90 % of the step, rad.
    pub width_rad: f64,
    /// Largest excess over the level on either side, as a part of the step.
    pub overshoot: f64,
    /// Height of the step, in the unit of the image.
    pub step: f64,
}

impl Edges {
    /// The edges of the first plane of an image: the largest gradients along their own direction.
    #[must_use]
    pub fn of(image: &Image) -> Self {
        let soft = gaussian(image.plane(0, 0), SMOOTHING);
        let (down, across) = gradient(soft.view());
        let length = ndarray::Zip::from(&down).and(&across).map_collect(|a, b| a.hypot(*b));
        let steepest = length.iter().fold(0.0_f64, |a, v| a.max(*v));
        let margin = REACH as usize + 1;
        let inside = |r: usize, c: usize| r.min(c) >= margin && r + margin < length.nrows() && c + margin < length.ncols();
        let mut found: Vec<(f64, [f64; 4])> = length
            .indexed_iter()
            .filter(|((r, c), g)| inside(*r, *c) && **g > STEEP * steepest)
            .filter_map(|((r, c), g)| {
                let (y, x) = (down[[r, c]] / g, across[[r, c]] / g);
                let (r, c) = (r as f64, c as f64);
                let [before, after] = [-1.0, 1.0].map(|s| sample(length.view(), r + s * y, c + s * x));
                // The vertex of the parabola through the three gradients is the place of the edge between the pixels.
                let shift = 0.5 * (before - after) / (before - 2.0 * g + after);
                (before <= *g && after <= *g && shift.is_finite()).then_some((*g, [r + shift * y, c + shift * x, y, x]))
            })
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(MOST);
        Self { grid: image.grid.clone(), places: found.into_iter().map(|(_, place)| place).collect() }
    }

    /// The edge response of another image of this field, or of the same one. `None` where there are too few edges, or no step across them.
    #[must_use]
    pub fn response(&self, image: &Image) -> Option<EdgeResponse> {
        let (plane, grid) = (image.plane(0, 0), &image.grid);
        if self.places.len() < FEWEST {
            return None;
        }
        let half = (REACH * FINE as f64) as i32;
        let distance = |k: i32| f64::from(k) / FINE as f64;
        let profile: Vec<f64> = (-half..=half)
            .map(|k| {
                let of_edge = |[r, c, y, x]: &[f64; 4]| {
                    let (r, c) = (r + distance(k) * y, c + distance(k) * x);
                    sample(plane, grid.row_of(self.grid.m_at(r)), grid.column_of(self.grid.l_at(c)))
                };
                self.places.iter().map(of_edge).sum::<f64>() / self.places.len() as f64
            })
            .collect();
        let ends = ((REACH - PLATEAU) * FINE as f64) as usize + 1;
        let level = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let (low, high) = (level(&profile[..ends]), level(&profile[profile.len() - ends..]));
        let step = high - low;
        if !(step > 0.0 && step.is_finite()) {
            return None;
        }
        let share: Vec<f64> = profile.iter().map(|v| (v - low) / step).collect();
        // The crossings nearest to the middle, on straight lines between the samples.
        let between = |k: usize, at: f64| k as f64 + (at - share[k]) / (share[k + 1] - share[k]);
        let middle = half as usize;
        let rises = |k: &usize, at: f64| share[*k] < at && share[k + 1] >= at;
        let lower = (0..share.len() - 1).filter(|k| rises(k, 0.1)).min_by_key(|k| k.abs_diff(middle))?;
        let upper = (lower..share.len() - 1).find(|k| rises(k, 0.9))?;
        let width = (between(upper, 0.9) - between(lower, 0.1)) / FINE as f64;
        let overshoot = share.iter().fold(0.0_f64, |a, v| a.max(v - 1.0).max(-v));
        Some(EdgeResponse { width_rad: width * self.grid.cell_rad, overshoot, step })
    }
}

/// A plane between its pixels, by cubic convolution (Keys 1981); the last pixel beyond the border.
fn sample(plane: ArrayView2<'_, f64>, r: f64, c: f64) -> f64 {
    let taps = |x: f64| {
        let (u, v) = (x - x.floor(), 1.0 - x + x.floor());
        [-0.5 * u * v * v, 1.0 + u * u * (1.5 * u - 2.5), 1.0 + v * v * (1.5 * v - 2.5), -0.5 * v * u * u]
    };
    let index = |x: f64, k: usize, n: usize| (x.floor() + k as f64 - 1.0).clamp(0.0, (n - 1) as f64) as usize;
    let (down, across) = (taps(r), taps(c));
    let row = |k: usize| {
        let line = plane.row(index(r, k, plane.nrows()));
        (0..4).map(|j| across[j] * line[index(c, j, plane.ncols())]).sum::<f64>()
    };
    (0..4).map(|k| down[k] * row(k)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;
    use crate::enhance::{StepList, enhance};
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SpectralWindow};
    use ndarray::{Array2, Axis};

    fn image(plane: Array2<f64>) -> Image {
        let grid = SkyGrid::new(plane.ncols(), plane.nrows(), 1e-3, SkyFrame::Boresight).unwrap();
        let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        Image::new(grid, SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
    }

    /// A disc of 280 K on 250 K, smoothed with a Gaussian of sigma pixels.
    fn disc(sigma: f64) -> Array2<f64> {
        let sharp = Array2::from_shape_fn((96, 96), |(r, c)| {
            let inside = (r as f64 - 47.5).hypot(c as f64 - 48.0) - 24.0;
            250.0 + 30.0 * (0.5 - inside).clamp(0.0, 1.0)
        });
        gaussian(sharp.view(), sigma)
    }

    #[test]
    fn a_gaussian_edge_has_its_width_also_with_noise_and_upsampled() {
        for sigma in [1.5, 2.0] {
            let clean = image(disc(sigma));
            // 10 % to 90 % of an error function, with the width of a pixel beside it.
            let truth = 2.563_103 * (sigma * sigma + 1.0 / 12.0_f64).sqrt() * 1e-3;
            let width = |image: &Image, edges: &Edges| edges.response(image).unwrap().width_rad;
            let own = width(&clean, &Edges::of(&clean));
            assert!((own / truth - 1.0).abs() < 0.04, "{sigma}: {own} {truth}");
            let noisy = image(disc(sigma) + noise(96, 96, 1));
            assert!((width(&noisy, &Edges::of(&noisy)) / truth - 1.0).abs() < 0.1, "{}", width(&noisy, &Edges::of(&noisy)));
            let steps: StepList = "fourier=2".parse().unwrap();
            let finer = enhance(std::slice::from_ref(&clean), &steps, None).unwrap();
            assert!((width(&finer, &Edges::of(&clean)) / truth - 1.0).abs() < 0.04);
        }
    }

    #[test]
    fn sharpening_shortens_the_edge_and_shows_as_overshoot() {
        let before = image(disc(1.5));
        let edges = Edges::of(&before);
        let steps: StepList = "unsharp=2:1.5".parse().unwrap();
        let after = enhance(std::slice::from_ref(&before), &steps, None).unwrap();
        let (a, b) = (edges.response(&before).unwrap(), edges.response(&after).unwrap());
        assert!(b.width_rad < 0.8 * a.width_rad && b.overshoot > 0.1 && a.overshoot < 0.02, "{a:?} {b:?}");
        assert_eq!(edges.response(&image(Array2::from_elem((96, 96), 3.0))), None);
    }
}
