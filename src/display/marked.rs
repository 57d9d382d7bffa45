//! The target of a study: a disc, or the pixels that show a surface.

use crate::enhance::{Target, TargetContrast};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Image, SkyGrid};
use ndarray::Array2;

/// The motion of a disc is measured within this multiple of its radius.
const AROUND_DISC: f64 = 1.5;
/// The surroundings of marked pixels begin after this many pixels, which may hold a part of the target, and end after so many.
const RING: (usize, usize) = (1, 5);
/// Fewest pixels of the surroundings.
const FEWEST: usize = 8;

/// A marked target of a scene.
#[derive(Debug, Clone)]
pub enum Marked {
    /// A disc.
    Disc(Target),
    /// Marked pixels, and those around them.
    Pixels(Pixels),
}

/// Marked pixels, and those around them. // [m, l]
#[derive(Debug, Clone)]
pub struct Pixels {
    inside: Array2<bool>,
    around: Array2<bool>,
}

/// Mark all pixels that are at most `reach` columns and rows from a marked one.
fn grown(mask: &Array2<bool>, reach: usize) -> Array2<bool> {
    let (rows, columns) = mask.dim();
    let mut across = Array2::from_elem(mask.dim(), false);
    let mut out = across.clone();
    for ((r, c), _) in mask.indexed_iter().filter(|(_, on)| **on) {
        across.slice_mut(ndarray::s![r, c.saturating_sub(reach)..(c + reach + 1).min(columns)]).fill(true);
    }
    for ((r, c), _) in across.indexed_iter().filter(|(_, on)| **on) {
        out.slice_mut(ndarray::s![r.saturating_sub(reach)..(r + reach + 1).min(rows), c]).fill(true);
    }
    out
}

impl Marked {
    /// The pixels of a scene that show a surface as a target, of these the ones in a disc if one is given. Pixels of the surface that lie outside of
    /// the disc belong neither to the target nor to its surroundings. \[m, l\]
    ///
    /// # Errors
    /// No marked pixel, or too few around them.
    pub fn pixels(surface: &Array2<bool>, disc: Option<&Target>) -> Result<Self> {
        let within = |(r, c): (usize, usize)| disc.is_none_or(|t| (r as f64 - t.row).hypot(c as f64 - t.column) <= t.radius);
        let inside = Array2::from_shape_fn(surface.dim(), |at| surface[at] && within(at));
        let (near, far) = (grown(surface, RING.0), grown(&inside, RING.1));
        let around = ndarray::Zip::from(&near).and(&far).map_collect(|near, far| *far && !near);
        let counts = [&inside, &around].map(|m| m.iter().filter(|v| **v).count());
        ensure!(counts[0] > 0, ChainError::NoData("no pixel shows the target".into()));
        ensure!(
            counts[1] >= FEWEST,
            ChainError::NoData(format!("the target has {} pixels around it, expected {FEWEST} or more", counts[1]))
        );
        Ok(Self::Pixels(Pixels { inside, around }))
    }

    /// Refuse a target that is not in a scene.
    ///
    /// # Errors
    /// A disc that lies outside, or marks of another size.
    pub fn check(&self, grid: &SkyGrid) -> Result<()> {
        match self {
            Self::Disc(target) => target.check(grid),
            Self::Pixels(pixels) => {
                let same = pixels.inside.dim() == (grid.n_m, grid.n_l);
                ensure!(same, ChainError::Internal("marks of another size than the scene".into()));
                Ok(())
            }
        }
    }

    /// Where the motion of the target is measured. // [m, l]
    pub(super) fn region(&self, grid: &SkyGrid) -> Array2<bool> {
        match self {
            Self::Disc(t) => Array2::from_shape_fn((grid.n_m, grid.n_l), |(r, c)| {
                (r as f64 - t.row).hypot(c as f64 - t.column) <= AROUND_DISC * t.radius
            }),
            Self::Pixels(pixels) => grown(&pixels.inside, RING.0),
        }
    }

    /// How the target stands out in an image of the scene on the grid `marked`. `None` where the image has no pixel of it.
    #[must_use]
    pub fn contrast(&self, marked: &SkyGrid, image: &Image) -> Option<TargetContrast> {
        let pixels = match self {
            Self::Disc(target) => return target.contrast(marked, image),
            Self::Pixels(pixels) => pixels,
        };
        let (mut inside, mut around) = (Vec::new(), Vec::new());
        for ((r, c), v) in image.plane(0, 0).indexed_iter() {
            let (row, column) = (marked.row_of(image.grid.m_at(r as f64)).round(), marked.column_of(image.grid.l_at(c as f64)).round());
            let at = [row.max(0.0) as usize, column.max(0.0) as usize];
            if pixels.inside.get(at).copied().unwrap_or(false) {
                inside.push(*v);
            } else if pixels.around.get(at).copied().unwrap_or(false) {
                around.push(*v);
            }
        }
        if inside.is_empty() || around.is_empty() {
            return None;
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let level = mean(&around);
        let clutter = (around.iter().map(|v| (v - level).powi(2)).sum::<f64>() / around.len() as f64).sqrt();
        let difference = mean(&inside) - level;
        Some(TargetContrast { difference, clutter, contrast: difference.abs() / clutter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SpectralWindow};
    use ndarray::Axis;

    fn square(n: usize, from: usize, to: usize) -> Array2<bool> {
        Array2::from_shape_fn((n, n), |(r, c)| (from..to).contains(&r) && (from..to).contains(&c))
    }

    fn image(plane: Array2<f64>, cell: f64) -> Image {
        let grid = SkyGrid::new(plane.ncols(), plane.nrows(), cell, SkyFrame::Boresight).unwrap();
        let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        Image::new(grid, SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
    }

    #[test]
    fn marked_pixels_stand_out_from_those_around_them_on_any_grid() {
        let mask = square(32, 12, 18);
        let marked = Marked::pixels(&mask, None).unwrap();
        // A chessboard of 1 K around a square that is 7 K warmer, and anything next to the square.
        let chess = |r: usize, c: usize| if (r + c).is_multiple_of(2) { 281.0 } else { 279.0 };
        let near = grown(&mask, 1);
        let of = |r: usize, c: usize| {
            if mask[[r, c]] {
                287.0
            } else if near[[r, c]] {
                0.0
            } else {
                chess(r, c)
            }
        };
        let scene = image(Array2::from_shape_fn((32, 32), |(r, c)| of(r, c)), 1e-3);
        let found = marked.contrast(&scene.grid, &scene).unwrap();
        assert!((found.difference - 7.0).abs() < 1e-9 && (found.clutter - 1.0).abs() < 1e-9 && (found.contrast - 7.0).abs() < 1e-9);
        // An image with three pixels for each one is measured at the same places.
        let fine = image(Array2::from_shape_fn((96, 96), |(r, c)| of((r + 1) / 3 % 32, (c + 1) / 3 % 32)), 1e-3 / 3.0);
        let same = marked.contrast(&scene.grid, &fine).unwrap();
        assert!((same.difference - 7.0).abs() < 1e-9, "{same:?}");
        assert_eq!(marked.region(&scene.grid).iter().filter(|v| **v).count(), 64);
    }

    #[test]
    fn a_disc_takes_a_part_of_a_surface_and_its_surroundings_hold_no_pixel_of_it() {
        // A strip over the whole image, with something cold beside its upper end.
        let strip = Array2::from_shape_fn((40, 40), |(_, c)| (15..25).contains(&c));
        let scene = image(
            Array2::from_shape_fn((40, 40), |(r, c)| {
                if strip[[r, c]] {
                    287.0
                } else if r > 30 && c > 25 {
                    100.0
                } else {
                    280.0
                }
            }),
            1e-3,
        );
        let whole = Marked::pixels(&strip, None).unwrap().contrast(&scene.grid, &scene).unwrap();
        assert!(whole.difference > 20.0, "{whole:?}");
        let disc: Target = "20,12,8".parse().unwrap();
        let part = Marked::pixels(&strip, Some(&disc)).unwrap().contrast(&scene.grid, &scene).unwrap();
        assert!((part.difference - 7.0).abs() < 1e-9 && part.clutter < 1e-9, "{part:?}");
        let nowhere: Target = "4,12,3".parse().unwrap();
        assert!(Marked::pixels(&strip, Some(&nowhere)).unwrap_err().to_string().contains("no pixel shows the target"));
    }

    #[test]
    fn targets_that_are_not_there_are_refused() {
        let told = |mask| Marked::pixels(&mask, None).unwrap_err().to_string();
        assert!(told(square(16, 3, 3)).contains("no pixel shows the target"));
        assert!(told(square(16, 0, 16)).contains("0 pixels around it"));
        let marked = Marked::pixels(&square(32, 12, 18), None).unwrap();
        assert!(marked.check(&SkyGrid::new(16, 16, 1e-3, SkyFrame::Boresight).unwrap()).is_err());
    }
}
