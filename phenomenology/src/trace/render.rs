//! Pictures of a scene of solids.

use super::options::RenderOptions;
use super::picture::{Picture, ProgressFn};
use super::tracer::Tracer;
use crate::camera::View;
use crate::error::Result;
use crate::solids::SolidScene;
use cittert_arrays::{Image, SkyGrid, SpectralWindow};

impl SolidScene {
    /// Brightness temperature in K on a grid of direction cosines around the axis of the camera \[chan = 1, pol = I, m, l\]. Visibilities
    /// can be computed from this grid without resampling.
    ///
    /// # Errors
    /// No camera, or a surface or sky that cannot be computed at this frequency.
    pub fn render(&self, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Image> {
        let view = View::on_grid(self.camera()?, grid)?;
        Ok(self.picture(&view, spectrum, &RenderOptions::default())?.temperature)
    }

    /// A picture of a view, with maps of range, incidence and material.
    ///
    /// # Errors
    /// As [`SolidScene::render`], and options out of range.
    pub fn picture(&self, view: &View, spectrum: &SpectralWindow, options: &RenderOptions) -> Result<Picture> {
        self.picture_observed(view, spectrum, options, None)
    }

    /// As [`SolidScene::picture`], with reports of the number of rows done.
    ///
    /// # Errors
    /// As [`SolidScene::picture`].
    pub fn picture_observed(
        &self,
        view: &View,
        spectrum: &SpectralWindow,
        options: &RenderOptions,
        progress: Option<ProgressFn<'_>>,
    ) -> Result<Picture> {
        let (tracer, band) = self.tracer_for(view, spectrum, options)?;
        let mut picture = tracer.picture(view, &band, progress)?;
        picture.temperature.object.clone_from(&self.file.name);
        Ok(picture)
    }

    /// The tracer of the pictures of a view, and their channels: those of the spectrum, or one over its whole band.
    ///
    /// # Errors
    /// As [`SolidScene::picture`].
    pub fn tracer_for(&self, view: &View, spectrum: &SpectralWindow, options: &RenderOptions) -> Result<(Tracer<'_>, SpectralWindow)> {
        self.check_position(view.position)?;
        let freqs: Vec<f64> = if options.per_channel { spectrum.freq_hz().to_vec() } else { vec![spectrum.mean_hz()] };
        let options = RenderOptions { highest_m: options.highest_m.max(view.position.z), ..options.clone() };
        let band =
            if options.per_channel { spectrum.clone() } else { SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])? };
        Ok((Tracer::new(self, &freqs, &options)?, band))
    }
}
