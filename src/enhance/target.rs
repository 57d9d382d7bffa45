//! Detection contrast of a marked target.

use crate::{ChainError, Result, ensure};
use cittert_arrays::{Image, SkyGrid};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// The background is the ring between these multiples of the radius of the target.
const RING: (f64, f64) = (1.5, 3.0);
/// Fewest pixels of the background.
const FEWEST: usize = 8;

/// A disc around a target: column, row and radius in pixels of the image before the steps. Columns and rows count from 0 at the first pixel of the
/// FITS file, which is the lower left one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Column of the centre.
    pub column: f64,
    /// Row of the centre.
    pub row: f64,
    /// Radius of the disc, pixels.
    pub radius: f64,
}

/// How a target stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetContrast {
    /// Mean of the disc less the mean of the ring around it, in the unit of the image.
    pub difference: f64,
    /// Standard deviation of the ring: noise and clutter.
    pub clutter: f64,
    /// Absolute difference over the clutter.
    pub contrast: f64,
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[column, row, radius]) if radius > 0.0 => Ok(Self { column, row, radius }),
            _ => Err(format!("{text:?} is not X,Y,R: column, row and radius above 0 in pixels, such as 120,80,4")),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{}", self.column, self.row, self.radius)
    }
}

impl Serialize for Target {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Target {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(crate::values::TextVisitor(std::marker::PhantomData))
    }
}

impl Target {
    /// Refuse a target that is not in an image.
    ///
    /// # Errors
    /// A part of the disc lies outside, or too few pixels of the ring around it lie inside.
    pub fn check(&self, grid: &SkyGrid) -> Result<()> {
        let fits = |x: f64, n: usize| x - self.radius >= -0.5 && x + self.radius <= n as f64 - 0.5;
        let expected = |what: &str| ChainError::bad_option("target", self, what);
        let size = format!("a disc inside of the image of {} x {} pixels", grid.n_l, grid.n_m);
        ensure!(fits(self.column, grid.n_l) && fits(self.row, grid.n_m), expected(&size));
        let in_ring = (0..grid.n_m).flat_map(|r| (0..grid.n_l).map(move |c| (r as f64, c as f64)));
        let distance = |(r, c): (f64, f64)| (r - self.row).hypot(c - self.column) / self.radius;
        let ring = in_ring.filter(|at| (RING.0..=RING.1).contains(&distance(*at))).count();
        ensure!(ring >= FEWEST, expected(&format!("room for its background: a ring from {} to {} radii around it", RING.0, RING.1)));
        Ok(())
    }

    /// How the target stands out in an image of the field of `marked`, the grid that its pixels are of. `None` where the disc holds no pixel.
    #[must_use]
    pub fn contrast(&self, marked: &SkyGrid, image: &Image) -> Option<TargetContrast> {
        let grid = &image.grid;
        let (mut disc, mut ring) = (Vec::new(), Vec::new());
        for ((r, c), v) in image.plane(0, 0).indexed_iter() {
            let (row, column) = (marked.row_of(grid.m_at(r as f64)), marked.column_of(grid.l_at(c as f64)));
            let distance = (row - self.row).hypot(column - self.column) / self.radius;
            if distance <= 1.0 {
                disc.push(*v);
            } else if (RING.0..=RING.1).contains(&distance) {
                ring.push(*v);
            }
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        if disc.is_empty() || ring.is_empty() {
            return None;
        }
        let around = mean(&ring);
        let difference = mean(&disc) - around;
        let clutter = (ring.iter().map(|v| (v - around).powi(2)).sum::<f64>() / ring.len() as f64).sqrt();
        Some(TargetContrast { difference, clutter, contrast: difference.abs() / clutter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SpectralWindow};
    use ndarray::Axis;

    fn grid(n: usize, cell: f64) -> SkyGrid {
        SkyGrid::new(n, n, cell, SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.2, frame: "icrs".into() }).unwrap()
    }

    #[test]
    fn a_warm_disc_stands_out_by_its_excess_over_the_noise() {
        let mut plane = noise(80, 80, 1) * 0.5 + 280.0;
        for ((r, c), v) in plane.indexed_iter_mut() {
            *v += if (r as f64 - 30.0).hypot(c as f64 - 50.0) <= 5.0 { 4.0 } else { 0.0 };
        }
        let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        let image =
            Image::new(grid(80, 1e-3), SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin)
                .unwrap();
        let target: Target = "50,30,5".parse().unwrap();
        let found = target.contrast(&grid(80, 1e-3), &image).unwrap();
        // 81 pixels of the disc and 530 of the ring: the difference is uncertain by 0.06, the clutter by 3 %.
        assert!((found.difference - 4.0).abs() < 0.25 && (found.clutter - 0.5).abs() < 0.06, "{found:?}");
        // The same place of a grid with half of the cell has twice the pixel numbers around its centre.
        let fine: Target = "100,60,10".parse().unwrap();
        assert_eq!(fine.contrast(&grid(160, 5e-4), &image), Some(found));
    }

    #[test]
    fn targets_outside_and_without_background_are_refused() {
        let check = |text: &str| text.parse::<Target>().unwrap().check(&grid(64, 1e-3)).map_err(|e| e.to_string());
        assert!(check("20,30,5").is_ok());
        assert!(check("62,30,5").unwrap_err().contains("64 x 64 pixels"));
        assert!(check("31.5,31.5,32").unwrap_err().contains("1.5 to 3 radii"));
        for text in ["1,2", "1,2,0", "1,2,-3", "a,2,3", "1,2,nan"] {
            assert!(text.parse::<Target>().is_err(), "{text}");
        }
    }
}
