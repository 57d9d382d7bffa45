//! The part of the error of a picture that comes from models of permittivity outside of their range.
//!
//! A model is used at a frequency that it does not cover only on request (`extrapolate`), and its permittivity is uncertain there. The picture is
//! made again with the permittivity a standard uncertainty above and below, for one material after the other; half of the difference is the
//! error of that material. Errors of materials are independent and add in quadrature. All that a picture holds is in it: roughness, films,
//! reflections from one object to the next.

use super::options::RenderOptions;
use super::picture::Picture;
use crate::camera::View;
use crate::dielectrics::Extrapolation;
use crate::error::Result;
use crate::solids::SolidScene;
use crate::surfaces::Substance;
use cittert_arrays::SpectralWindow;
use ndarray::{Array2, Zip};

/// A material that is used outside the range of its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Extended {
    /// Name of the material.
    pub material: &'static str,
    /// Name of the model.
    pub model: &'static str,
    /// Relative standard uncertainty of its permittivity there.
    pub uncertainty: f64,
}

/// The error of a picture by its extended models.
#[derive(Debug, Clone)]
pub struct ModelError {
    /// Standard error, K; of the first plane at the middle of the band \[m, l\].
    pub map_k: Array2<f64>,
    /// The materials, each with its rms and its largest error in the picture, K.
    pub parts: Vec<(Extended, f64, f64)>,
}

impl SolidScene {
    /// The materials that are used outside the range of their models at a frequency, without repetition.
    #[must_use]
    pub fn extended(&self, freq_hz: f64) -> Vec<Extended> {
        let mut found: Vec<Extended> = Vec::new();
        for layer in self.surfaces.iter().flat_map(|s| &s.stack.layers) {
            let Substance::Material { material, state, model } = &layer.substance else { continue };
            // What cannot be evaluated is an error of the rendering, which names its line.
            let Ok(eps) = material.evaluate(*model, state, freq_hz, Extrapolation::Documented) else { continue };
            if eps.extended && !found.iter().any(|f| (f.material, f.model) == (material.name, eps.model.name)) {
                found.push(Extended { material: material.name, model: eps.model.name, uncertainty: eps.uncertainty() });
            }
        }
        found
    }

    /// The same scene with the permittivity of one extended material multiplied by a factor.
    fn scaled(&self, which: &Extended, factor: f64, freq_hz: f64) -> Result<Self> {
        let mut scene = self.clone();
        for layer in scene.surfaces.iter_mut().flat_map(|s| &mut s.stack.layers) {
            let Substance::Material { material, state, model } = &layer.substance else { continue };
            let Ok(eps) = material.evaluate(*model, state, freq_hz, Extrapolation::Documented) else { continue };
            if eps.extended && (material.name, eps.model.name) == (which.material, which.model) {
                // Nothing is thinner than vacuum.
                let mut scaled = eps.eps * factor;
                scaled.re = scaled.re.max(1.0);
                layer.substance = Substance::Fixed(scaled);
            }
        }
        Ok(scene)
    }

    /// The error of a picture by models outside of their range, from two more pictures for each such material. Without any it is 0.
    ///
    /// # Errors
    /// As [`SolidScene::picture`].
    pub fn model_error(&self, view: &View, spectrum: &SpectralWindow, options: &RenderOptions) -> Result<ModelError> {
        let freq_hz = spectrum.mean_hz();
        let band = SpectralWindow::new(vec![freq_hz], vec![spectrum.extent_hz()])?;
        let options = RenderOptions { per_channel: false, polarizations: options.polarizations[..1].to_vec(), ..options.clone() };
        let picture =
            |which: &Extended, factor: f64| -> Result<Picture> { self.scaled(which, factor, freq_hz)?.picture(view, &band, &options) };
        let mut squares = Array2::zeros((view.grid().n_m, view.grid().n_l));
        let mut parts = Vec::new();
        for which in self.extended(freq_hz) {
            let (above, below) = (picture(&which, 1.0 + which.uncertainty)?, picture(&which, 1.0 - which.uncertainty)?);
            let (mut sum, mut largest) = (0.0, 0.0_f64);
            Zip::from(&mut squares).and(above.temperature.plane(0, 0)).and(below.temperature.plane(0, 0)).for_each(|square, a, b| {
                let error = 0.5 * (a - b);
                *square += error * error;
                sum += error * error;
                largest = largest.max(error.abs());
            });
            parts.push((which, (sum / squares.len() as f64).sqrt(), largest));
        }
        Ok(ModelError { map_k: squares.mapv_into(f64::sqrt), parts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dielectrics::Material;
    use crate::surfaces::fresnel;
    use num_complex::Complex64;

    /// Asphalt under a cold background, with a slab of brick over a part of it; straight from above.
    const ROAD: &str = r#"
kind = "solids"
name = "road"
extrapolate = true
camera = { position_m = [0, 0, 20], pitch_deg = -90, size_px = [8, 4], fov_deg = 10 }
atmosphere = { vacuum = true, background_k = 10 }
[surface.asphalt]
layer = [{ material = "asphalt", temperature_k = 300 }]
[surface.brick]
layer = [{ material = "brick", temperature_k = 280 }]
[surface.glass]
layer = [{ material = "glass", temperature_k = 280 }]
[ground]
surface = "asphalt"
patch = [{ surface = "brick", polygon_m = [[0, -9], [9, -9], [9, 9], [0, 9]] }]
"#;

    fn error(text: &str, freq_hz: f64) -> (SolidScene, ModelError) {
        let scene = SolidScene::from_toml(text).unwrap();
        let view = View::of_camera(scene.camera().unwrap()).unwrap();
        let band = SpectralWindow::band(freq_hz, 1e9, 1).unwrap();
        let error = scene.model_error(&view, &band, &RenderOptions::default()).unwrap();
        (scene, error)
    }

    // Above a plane, half the difference of two Fresnel reflectivities times the contrast to the background.
    #[test]
    fn the_error_of_a_plane_is_that_of_its_reflectivity() {
        let (scene, error) = error(ROAD, 94e9);
        let names: Vec<_> = error.parts.iter().map(|(e, _, _)| (e.material, e.model, e.uncertainty)).collect();
        assert_eq!(names, [("asphalt", "p2040", 0.133), ("brick", "p2040", 0.133)]);
        let expect = |name: &str, contrast_k: f64| {
            let material = Material::by_name(name).unwrap();
            let eps = material.evaluate(None, &material.state(), 94e9, Extrapolation::Documented).unwrap().eps;
            let emissivity = |factor: f64| fresnel(Complex64::new(eps.re * factor, eps.im * factor), 0.0).unwrap().emissivities()[0];
            0.5 * contrast_k * (emissivity(0.867) - emissivity(1.133))
        };
        let (asphalt, brick) = (expect("asphalt", 290.0), expect("brick", 270.0));
        let (left, right) = (error.map_k[[2, 1]], error.map_k[[2, 6]]);
        // Within 5 degrees of the vertical the unpolarised reflectivity is that of the vertical to 1e-4.
        assert!((left / asphalt - 1.0).abs() < 2e-3 && (right / brick - 1.0).abs() < 2e-3, "{left} {asphalt}, {right} {brick}");
        println!("asphalt {asphalt:.2} K, brick {brick:.2} K");
        // Four of the eight columns show asphalt, and the fifth has the seam in its middle.
        let (_, rms_k, largest_k) = error.parts[0];
        assert!((0.5..0.625).contains(&(rms_k / asphalt).powi(2)) && (largest_k / asphalt - 1.0).abs() < 5e-3, "{rms_k} {largest_k}");
        // The picture itself is not touched.
        assert_eq!(scene.extended(94e9).len(), 2);
    }

    #[test]
    fn a_scene_within_the_ranges_of_its_models_has_no_error() {
        let (_, error) = error(ROAD, 30e9);
        assert!(error.parts.is_empty() && error.map_k.iter().all(|e| *e == 0.0) && error.map_k.dim() == (4, 8));
    }

    // What is seen in two reflections has the errors of both materials, and the square is the sum of their squares.
    #[test]
    fn errors_add_in_quadrature() {
        let wall = ROAD.replace("pitch_deg = -90", "pitch_deg = -45, heading_deg = 90").replace("patch", "#patch")
            + "[[body]]\nname = \"wall\"\ntype = \"RPP\"\ndata = [30, 31, -200, 200, 0, 200]\nsurface = \"brick\"\n";
        let (_, both) = error(&wall, 94e9);
        let (_, first) = error(&wall.replace("material = \"brick\"", "eps = [3.91, 0.1]"), 94e9);
        let (_, second) = error(&wall.replace("material = \"asphalt\"", "eps = [4.83, 0.1]"), 94e9);
        assert_eq!((both.parts.len(), first.parts.len(), second.parts.len()), (2, 1, 1));
        assert!(both.parts.iter().all(|(_, rms, _)| *rms > 0.01), "{:?}", both.parts);
        for (part, alone) in both.parts.iter().zip([&first.parts[0], &second.parts[0]]) {
            // The other material has nearly the same permittivity when it is a number.
            assert!((part.1 / alone.1 - 1.0).abs() < 0.05, "{part:?} {alone:?}");
        }
        let squares: f64 = both.map_k.iter().map(|e| e * e).sum::<f64>() / both.map_k.len() as f64;
        let sum: f64 = both.parts.iter().map(|(_, rms, _)| rms * rms).sum();
        assert!((squares / sum - 1.0).abs() < 1e-9, "{squares} {sum}");
    }
}
