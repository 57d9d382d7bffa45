//! The surface on which a scene lies: the distance of its points in every direction.

use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayError, BrightnessUnit, Image, SceneRange, SkyFrame, SkyGrid};
use ndarray::Array2;
use std::sync::Arc;

/// The distance of the points of a scene from the origin of the layout.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// A plane across the boresight at this distance, m.
    Plane(f64),
    /// A sphere of this radius around the origin, m.
    Sphere(f64),
    /// A map of distances.
    Map(Arc<RangeMap>),
}

/// Distances on a grid of directions.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeMap {
    name: String,
    grid: SkyGrid,
    /// 1 / distance \[m, l\], 1/m; 0 for the sky.
    curvature: Array2<f64>,
}

impl RangeMap {
    /// A map of distances from the origin of the layout in m, such as `scene render --range` writes. A pixel that is not a number is sky, which is infinitely
    /// far away.
    ///
    /// # Errors
    /// An image in another unit or around a point of the sky, a distance that is not positive.
    pub fn new(name: &str, image: &Image) -> Result<Self> {
        let wrong = |why: String| Err(ChainError::Incompatible(format!("the map of distances {why}")));
        if image.unit != BrightnessUnit::Metre {
            return wrong(format!("has the unit {:?}: expected m, as scene render --range writes it", image.unit.bunit()));
        }
        if image.grid.frame != SkyFrame::Boresight {
            return wrong("is drawn on the sky: expected one around a boresight".into());
        }
        let plane = image.plane(0, 0);
        if let Some(((row, column), d)) = plane.indexed_iter().find(|(_, d)| **d <= 0.0) {
            return wrong(format!("is {d} m at column {column}, row {row}: expected positive distances"));
        }
        let curvature = plane.mapv(|d| if d.is_nan() { 0.0 } else { d.recip() });
        Ok(Self { name: name.to_owned(), grid: image.grid.clone(), curvature })
    }

    /// The nearest pixel: between the two distances at an edge there is nothing.
    fn curvature(&self, l: f64, m: f64) -> f64 {
        let index = |x: f64, n: usize| x.round().clamp(0.0, (n - 1) as f64) as usize;
        self.curvature[(index(self.grid.row_of(m), self.grid.n_m), index(self.grid.column_of(l), self.grid.n_l))]
    }
}

impl Surface {
    /// 1 / distance towards direction cosines (l, m), 1/m.
    #[must_use]
    pub fn curvature(&self, l: f64, m: f64) -> f64 {
        match self {
            Self::Plane(distance) => (1.0 - l * l - m * m).max(0.0).sqrt() / distance,
            Self::Sphere(radius) => radius.recip(),
            Self::Map(map) => map.curvature(l, m),
        }
    }

    /// The smallest distance, m.
    #[must_use]
    pub fn nearest_m(&self) -> f64 {
        match self {
            Self::Plane(distance) => *distance,
            Self::Sphere(radius) => *radius,
            Self::Map(map) => map.curvature.iter().copied().fold(0.0, f64::max).recip(),
        }
    }

    /// Check that the surface says how far the pixels of a grid are.
    ///
    /// # Errors
    /// A distance that is not positive; a grid around a point of the sky; a map that ends within the grid.
    pub fn check(&self, grid: &SkyGrid) -> Result<()> {
        let distance = self.nearest_m();
        ArrayError::unless(distance > 0.0, "distance of the scene in m", distance, "a positive distance")?;
        let text = "the image is drawn on the sky: a scene in the near field is drawn around the boresight of an array that is fixed to it";
        ensure!(grid.frame == SkyFrame::Boresight, ChainError::Incompatible(text.into()));
        if let Self::Map(map) = self {
            let half = |n: usize, cell: f64| (n / 2) as f64 * cell;
            let (has, needs) = (
                [half(map.grid.n_l, map.grid.cell_rad), half(map.grid.n_m, map.grid.cell_rad)],
                [half(grid.n_l, grid.cell_rad), half(grid.n_m, grid.cell_rad)],
            );
            let reach = 0.5 * (map.grid.cell_rad + grid.cell_rad);
            let text = format!(
                "the map of distances covers {:.4} rad by {:.4} rad, but the image needs {:.4} rad by {:.4} rad: give a map of the whole field",
                2.0 * has[0],
                2.0 * has[1],
                2.0 * needs[0],
                2.0 * needs[1]
            );
            ensure!((0..2).all(|k| has[k] + reach >= needs[k]), ChainError::Incompatible(text));
        }
        Ok(())
    }

    /// What the header of a set says of it.
    #[must_use]
    pub fn scene_range(&self) -> SceneRange {
        match self {
            Self::Plane(distance_m) => SceneRange::Plane { distance_m: *distance_m },
            Self::Sphere(radius_m) => SceneRange::Sphere { radius_m: *radius_m },
            Self::Map(map) => SceneRange::map(&map.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SpectralWindow};

    fn map(cell: f64, value: impl Fn(usize, usize) -> f64) -> Result<Surface> {
        let grid = SkyGrid::new(8, 6, cell, SkyFrame::Boresight).unwrap();
        let data = ndarray::Array4::from_shape_fn((1, 1, 6, 8), |(_, _, r, c)| value(r, c));
        let band = SpectralWindow::band(1e11, 1e9, 1).unwrap();
        let image = Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Metre).unwrap();
        Ok(Surface::Map(RangeMap::new("scene", &image)?.into()))
    }

    #[test]
    fn a_plane_is_farther_at_its_edge_and_a_sphere_is_not() {
        let at = 0.6_f64;
        assert!((Surface::Plane(8.0).curvature(at, 0.0) - 0.1).abs() < 1e-15, "8 m / cos = 10 m");
        assert_eq!(Surface::Sphere(8.0).curvature(at, 0.3), 0.125);
    }

    #[test]
    fn a_map_says_its_distances_and_where_the_sky_is() {
        let surface = map(0.01, |r, c| if c == 7 { f64::NAN } else { (r * 10 + c + 1) as f64 }).unwrap();
        assert_eq!(surface.curvature(0.03, 0.0), 0.0);
        assert_eq!(surface.curvature(-0.01, 0.02), 1.0 / 54.0);
        assert_eq!(surface.nearest_m(), 1.0);
        surface.check(&SkyGrid::new(8, 6, 0.01, SkyFrame::Boresight).unwrap()).unwrap();
        let e = surface.check(&SkyGrid::new(8, 6, 0.02, SkyFrame::Boresight).unwrap()).unwrap_err().to_string();
        assert!(e.contains("covers 0.0800 rad by 0.0600 rad"), "{e}");
        assert!(map(0.01, |r, _| r as f64 - 1.0).unwrap_err().to_string().contains("row 0"));
    }
}
