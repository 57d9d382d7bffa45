//! Scenes of analytic shapes: a background, and shapes painted over it in order.
//!
//! Angles are given in degrees as they appear from the sensor; a shape's coordinates are direction cosines
//! l (to the right or the east) and m (up or north) times 180/pi, so that small angles read as degrees.

mod shape;

pub use shape::Shape;

use crate::error::{Result, SceneError};
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyGrid, SpectralWindow};
use ndarray::Array4;
use serde::{Deserialize, Serialize};

/// The brightness of the background.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Background {
    /// Temperature at the centre, K.
    pub temperature_k: f64,
    /// Change of temperature with l and m, K/deg.
    #[serde(default)]
    pub gradient_k_per_deg: [f64; 2],
}

/// A field of view with a soft edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// Radius inside which the scene is unchanged, deg.
    pub inner_deg: f64,
    /// Radius outside which it is zero, deg. Between the two radii it falls as a raised cosine.
    pub outer_deg: f64,
}

/// A background and the shapes painted over it, later ones on top.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnalyticScene {
    /// Always `analytic`.
    kind: String,
    /// Name of the scene.
    pub name: String,
    /// Content of the scene, and the sources of its numbers.
    #[serde(default)]
    pub description: String,
    /// Background of the shapes.
    pub background: Background,
    /// Soft-edged field of view.
    pub window: Option<Window>,
    /// Shapes, painted in order.
    #[serde(default, rename = "shape")]
    pub shapes: Vec<Shape>,
}

/// Number of samples along each side of a pixel. With 4 x 4 samples an edge is wrong by at most 1/8 of its contrast in one pixel.
const SUBSAMPLES: usize = 4;

fn degrees_to_cosine(deg: f64) -> f64 {
    deg.to_radians()
}

impl AnalyticScene {
    /// Read from TOML.
    ///
    /// # Errors
    /// TOML that does not parse or has unknown keys (with the line), a number that is not finite, a negative temperature.
    pub fn from_toml(text: &str) -> Result<Self> {
        let scene: Self = toml::from_str(text)?;
        scene.check()?;
        Ok(scene)
    }

    fn check(&self) -> Result<()> {
        let b = self.background;
        let warm = b.temperature_k >= 0.0 && b.temperature_k.is_finite() && b.gradient_k_per_deg.iter().all(|g| g.is_finite());
        SceneError::unless(warm, "background", format_args!("{b:?}"), "a temperature of 0 K or more and finite gradients")?;
        if let Some(w) = self.window {
            let rising = w.inner_deg >= 0.0 && w.outer_deg > w.inner_deg && w.outer_deg.is_finite();
            SceneError::unless(rising, "window", format_args!("{w:?}"), "0 <= inner_deg < outer_deg")?;
        }
        for (i, shape) in self.shapes.iter().enumerate() {
            let what = || format!("shape {} ({})", i + 1, shape.type_name());
            shape.check().map_err(|expected| SceneError::bad_value(what(), format_args!("{shape:?}"), expected))?;
        }
        Ok(())
    }

    fn temperature(&self, l: f64, m: f64) -> f64 {
        let b = self.background;
        let per_radian = 1.0 / degrees_to_cosine(1.0);
        let base = b.temperature_k + (b.gradient_k_per_deg[0] * l + b.gradient_k_per_deg[1] * m) * per_radian;
        let painted = self.shapes.iter().fold(base, |t, s| s.paint(t, l, m));
        let taper = self.window.map_or(1.0, |w| {
            let r = l.hypot(m);
            let (inner, outer) = (degrees_to_cosine(w.inner_deg), degrees_to_cosine(w.outer_deg));
            match r {
                r if r <= inner => 1.0,
                r if r >= outer => 0.0,
                r => 0.5 * (1.0 + (std::f64::consts::PI * (r - inner) / (outer - inner)).cos()),
            }
        });
        painted * taper
    }

    /// Brightness temperature in K \[1, 1, m, l\]: the mean over each pixel of 4 x 4 samples.
    ///
    /// # Errors
    /// An invalid spectrum or grid.
    pub fn render(&self, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Image> {
        let offset = |k: usize| (k as f64 + 0.5) / SUBSAMPLES as f64 - 0.5;
        let mut data = Array4::zeros((1, 1, grid.n_m, grid.n_l));
        for ((_, _, row, column), value) in data.indexed_iter_mut() {
            let mut sum = 0.0;
            for i in 0..SUBSAMPLES {
                let m = grid.m_at(row as f64 + offset(i));
                for j in 0..SUBSAMPLES {
                    sum += self.temperature(grid.l_at(column as f64 + offset(j)), m);
                }
            }
            *value = sum / (SUBSAMPLES * SUBSAMPLES) as f64;
        }
        let band = SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?;
        let mut image = Image::new(grid.clone(), band, vec![Polarization::I], data, BrightnessUnit::Kelvin)?;
        image.object.clone_from(&self.name);
        Ok(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    const TEXT: &str = r#"
kind = "analytic"
name = "test"
background = { temperature_k = 280.0 }
[[shape]]
type = "rectangle"
center_deg = [1.0, 0.5]
size_deg = [0.4, 0.2]
temperature_k = 120.0
"#;

    #[test]
    fn a_rectangle_lies_where_it_was_put() {
        let scene = AnalyticScene::from_toml(TEXT).unwrap();
        let grid = SkyGrid::new(128, 64, 0.05_f64.to_radians(), SkyFrame::Boresight).unwrap();
        let image = scene.render(&grid, &SpectralWindow::band(94e9, 8e9, 4).unwrap()).unwrap();
        let at = |l: f64, m: f64| image.data[[0, 0, grid.row_of(l_of(m)).round() as usize, grid.column_of(l_of(l)).round() as usize]];
        fn l_of(deg: f64) -> f64 {
            deg.to_radians()
        }
        assert_eq!(at(1.0, 0.5), 120.0);
        assert_eq!(at(-1.0, 0.5), 280.0);
        // Area and contrast of the rectangle: 0.4 x 0.2 deg at -160 K.
        let deficit: f64 = image.data.iter().map(|t| 280.0 - t).sum::<f64>() * 0.05 * 0.05;
        assert!((deficit - 0.08 * 160.0).abs() < 0.3, "{deficit}");
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line() {
        let e = AnalyticScene::from_toml(&TEXT.replace("size_deg", "sise_deg")).unwrap_err().to_string();
        assert!(e.contains("sise_deg"), "{e}");
        let e = AnalyticScene::from_toml(&TEXT.replace("280.0", "nan")).unwrap_err().to_string();
        assert!(e.contains("background"), "{e}");
    }
}
