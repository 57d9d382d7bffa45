//! From a layout to the error of the image of a scene: simulate, deconvolve, compare.

use super::objective::LayoutFigure;
use crate::fidelity::{CompareOptions, compare};
use crate::imaging::{ImageSize, Imager, ImagingOptions, clean};
use crate::mem::{MemInputs, MemOptions, Uncertainty, mem};
use crate::progress::Silent;
use crate::simulate::{Element, ElementPattern, SimulateOptions, SkyModel, TrackOptions, simulate_set};
use crate::values::{bad_value, need};
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::{Angle, Duration, Temperature};
use cittert_arrays::{Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, SpectralWindow, VisUnit};
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the image of a scene is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", value(rename_all = "lower"))]
pub enum Deconvolver {
    /// Maximum entropy.
    Mem,
    /// CLEAN.
    Clean,
}

impl std::fmt::Display for Deconvolver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if *self == Self::Mem { "mem" } else { "clean" })
    }
}

/// The observation and the image that the objective `scene` judges a layout by. The band is that of the design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct SceneTestOptions {
    /// How the objective scene makes images: mem or clean.
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "mem|clean", value_enum, hide_possible_values = true, default_value_t = SceneTestOptions::default().deconvolver))]
    pub deconvolver: Deconvolver,
    /// Number of pixels along each side of the image of the objective scene.
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "N", default_value_t = SceneTestOptions::default().image_size))]
    pub image_size: usize,
    /// Size of a pixel of that image [default: that of the scene].
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "ANGLE"))]
    pub image_cell: Option<Angle>,
    /// Power pattern of each element: none, airy (of the diameter in the layout), gaussian (of the given width) or cos^N.
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "KIND", default_value_t = SceneTestOptions::default().element))]
    pub element: Element,
    /// Full width at half maximum of a gaussian element.
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "ANGLE"))]
    pub element_width: Option<Angle>,
    /// System temperature of every new element, written into the layout; noise of the objective scene [default: no noise].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub tsys: Option<Temperature>,
    /// Length of the integration.
    #[cfg_attr(feature = "cli", arg(long, requires = "scene", value_name = "TIME", default_value_t = SceneTestOptions::default().integration))]
    pub integration: Duration,
    /// Diameter of every new element, written into the layout.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub diameter: Option<cittert_arrays::quantity::Length>,
}

impl Default for SceneTestOptions {
    fn default() -> Self {
        Self {
            deconvolver: Deconvolver::Mem,
            image_size: 128,
            image_cell: None,
            element: Element::None,
            element_width: None,
            tsys: None,
            integration: Duration(1.0),
            diameter: None,
        }
    }
}

/// A scene and how it is observed.
pub struct SceneChain {
    sky: SkyModel,
    /// The scene times the pattern of the elements.
    truth: Image,
    unit: VisUnit,
    spectrum: SpectralWindow,
    simulate: SimulateOptions,
    imaging: ImagingOptions,
    options: SceneTestOptions,
    aperture_m: f64,
}

impl SceneChain {
    /// For a scene that is one image.
    ///
    /// # Errors
    /// A source list, an element pattern that lacks its width or diameter, a wrong size.
    pub fn new(sky: SkyModel, spectrum: SpectralWindow, options: SceneTestOptions, aperture_m: f64) -> Result<Self> {
        let text = "the objective scene compares images: give a scene that is one image, not a list of sources";
        ensure!(sky.images.len() == 1 && sky.sources.is_empty(), ChainError::Incompatible(text.into()));
        let mut truth = sky.images[0].clone();
        need("image-size", options.image_size, (16..=4096).contains(&options.image_size), "16 to 4096")?;
        need("integration", options.integration, options.integration.si() > 0.0, "a positive time")?;
        let simulate = SimulateOptions {
            element: options.element,
            element_width: options.element_width,
            element_diameter: if options.element == Element::Airy { options.diameter } else { None },
            tsys: options.tsys,
            ..SimulateOptions::default()
        };
        if options.tsys.is_some() && options.diameter.is_none() {
            return bad_value("diameter", "missing", "the diameter of the elements, which noise from a system temperature needs");
        }
        let imaging = ImagingOptions {
            size: Some(ImageSize { columns: options.image_size, rows: options.image_size }),
            cell: Some(options.image_cell.unwrap_or(Angle(truth.grid.cell_rad))),
            ..ImagingOptions::default()
        };
        let unit = if truth.unit == BrightnessUnit::Kelvin { VisUnit::KelvinSr } else { VisUnit::Jy };
        let chain = |truth| Self { sky, truth, unit, spectrum, simulate, imaging, options, aperture_m };
        let empty = truth.clone();
        let mut chain = chain(empty);
        let pattern = chain.simulate.pattern(&chain.layout(&[[0.0, 0.0], [0.5, 0.0]])?)?;
        if pattern != ElementPattern::None {
            let (grid, freq) = (truth.grid.clone(), chain.spectrum.mean_hz());
            for ((_, _, m, l), value) in truth.data.indexed_iter_mut() {
                *value *= pattern.power(grid.l_at(l as f64), grid.m_at(m as f64), freq);
            }
            truth.pattern = pattern;
        }
        chain.truth = truth;
        Ok(chain)
    }

    /// The same as a function for the objective.
    #[must_use]
    pub fn error(self) -> LayoutFigure {
        LayoutFigure(Arc::new(move |xy: &[[f64; 2]]| self.image_error(xy)))
    }

    fn layout(&self, xy: &[[f64; 2]]) -> Result<ArrayLayout> {
        let antenna = |(k, p): (usize, &[f64; 2])| {
            let mut a = Antenna::new(format!("E{k}"), k as u32, [p[0] * self.aperture_m, p[1] * self.aperture_m, 0.0]);
            a.diameter_m = self.options.diameter.map(|d| d.si());
            a
        };
        Ok(ArrayLayout::new("candidate", LayoutFrame::Boresight, xy.iter().enumerate().map(antenna).collect())?)
    }

    /// The rms difference of image and scene over the rms of the scene, each about its mean: 0 for a perfect image, 1 for a grey card.
    ///
    /// # Errors
    /// A step of the chain fails.
    pub fn image_error(&self, xy: &[[f64; 2]]) -> Result<f64> {
        let layout = self.layout(xy)?;
        let track = TrackOptions { integration: self.options.integration, ..TrackOptions::default() }.plan(&layout)?;
        let coverage = track.plan.coverage()?;
        let header = self.simulate.header(layout, self.spectrum.clone(), track.center, self.unit);
        let mut set = simulate_set(header, &coverage, &self.sky, &self.simulate, &Silent)?;
        let options = MemOptions { uncertainty: Uncertainty::None, ..MemOptions::default() };
        // Data without noise have weights without scale, for which maximum entropy takes a small noise.
        let noise = if self.options.deconvolver == Deconvolver::Mem { Some(options.believed_noise(&mut set, &Silent)?) } else { None };
        let mut imager = Imager::new(&mut set, self.imaging.clone(), &Silent)?;
        let image = match noise {
            None => clean(&mut imager, &crate::deconvolve::CleanOptions::default(), &Silent)?.restored,
            Some(noise) => {
                let plan = options.plan(&imager, MemInputs::default(), noise)?;
                mem(&mut imager, &plan, &Silent)?.model
            }
        };
        let c = compare(&image, &self.truth, &CompareOptions::default())?;
        Ok(error_about_the_mean(&c.image, &c.truth))
    }
}

/// The rms of I - T over that of T, each about its mean, over the pixels with a value in both. Baselines do not measure the mean of a scene.
fn error_about_the_mean(image: &Array2<f64>, truth: &Array2<f64>) -> f64 {
    let pairs = || image.iter().zip(truth).filter(|(i, t)| i.is_finite() && t.is_finite());
    let n = pairs().count() as f64;
    let scatter = |f: &dyn Fn(f64, f64) -> f64| {
        let mean = pairs().map(|(i, t)| f(*i, *t)).sum::<f64>() / n;
        pairs().map(|(i, t)| (f(*i, *t) - mean).powi(2)).sum::<f64>()
    };
    (scatter(&|i, t| i - t) / scatter(&|_, t| t)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyFrame, SkyGrid};
    use ndarray::Array4;

    fn golden(n: usize) -> Vec<[f64; 2]> {
        let place = |k: usize| {
            let (radius, (s, c)) = (0.5 * ((k as f64 + 0.5) / n as f64).sqrt(), (2.399_963 * k as f64).sin_cos());
            [radius * c, radius * s]
        };
        (0..n).map(place).collect()
    }

    /// A bump of 100 K on a constant background, at 94 GHz.
    fn chain(background: f64, deconvolver: Deconvolver) -> SceneChain {
        let spectrum = SpectralWindow::band(94e9, 1e9, 1).unwrap();
        let grid = SkyGrid::new(64, 64, 2e-3, SkyFrame::Boresight).unwrap();
        let bump = |i: usize, k: usize| (-((i as f64 - 30.0).powi(2) + (k as f64 - 36.0).powi(2)) / 80.0).exp();
        let data = Array4::from_shape_fn((1, 1, 64, 64), |(_, _, m, l)| background + 100.0 * bump(m, l));
        let truth = Image::new(grid, spectrum.clone(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
        let options = SceneTestOptions { image_size: 64, deconvolver, ..SceneTestOptions::default() };
        SceneChain::new(SkyModel::of_image(truth), spectrum, options, 0.3).unwrap()
    }

    #[test]
    fn more_elements_make_a_better_image() {
        for (background, deconvolver) in [(0.0, Deconvolver::Clean), (200.0, Deconvolver::Mem)] {
            let chain = chain(background, deconvolver);
            let (few, many) = (chain.image_error(&golden(7)).unwrap(), chain.image_error(&golden(40)).unwrap());
            // A grey card has 1.
            assert!(many < 0.8 * few && many < 1.0, "{deconvolver}: {few} {many}");
        }
    }

    #[test]
    fn a_list_of_sources_and_noise_without_a_diameter_are_refused() {
        let band = || SpectralWindow::band(94e9, 1e9, 1).unwrap();
        let list = SkyModel::of_sources(Vec::new());
        let message = SceneChain::new(list, band(), SceneTestOptions::default(), 1.0).err().unwrap().to_string();
        assert!(message.contains("one image"), "{message}");
        let noisy = SceneTestOptions { tsys: Some(Temperature(500.0)), ..SceneTestOptions::default() };
        let sky = chain(0.0, Deconvolver::Mem).sky;
        let message = SceneChain::new(sky, band(), noisy, 1.0).err().unwrap().to_string();
        assert!(message.contains("diameter"), "{message}");
    }
}
