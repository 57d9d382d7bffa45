//! The scene that the cameras of a film look at, and the cameras themselves.

use super::args::FilmArgs;
use crate::ChainError;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::numbers;
use crate::cli::options::load_array;
use crate::cli::scene::{Flown, Mode};
use crate::display::{Aperture, Interferometer, Marked, PanelKind};
use crate::enhance::{Psf, StepList, Target};
use crate::sensor::SensorOptions;
use crate::simulate::SimulateOptions;
use cittert_arrays::quantity::Duration;
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyGrid, SpectralWindow};
use cittert_formats::{open_image, read_text};
use cittert_phenomenology::Tracer;
use ndarray::{Array2, Axis};
use std::path::Path;

/// The scene from the places of a flight.
pub(super) struct Scenery<'a> {
    flown: &'a Flown,
    tracer: Tracer<'a>,
    pub(super) grid: SkyGrid,
    pub(super) spectrum: SpectralWindow,
    /// Whether every pixel is traced.
    full: bool,
    /// The sensor, and the name of its file.
    sensor: Option<(SensorOptions, String)>,
}

impl<'a> Scenery<'a> {
    /// The scene of a flight, in the band of the receivers.
    ///
    /// # Errors
    /// A band that reaches below 0 Hz, a frequency outside of the tables, or a file that describes no sensor.
    pub(super) fn new(flown: &'a Flown, args: &FilmArgs) -> Result<Self> {
        let band = SpectralWindow::band(flown.freq.si(), args.camera.receivers.bandwidth.si(), 1).context("--freq and --bandwidth")?;
        let read = |path: &Path| sensor(path).map(|options| (options, path.display().to_string()));
        let sensor = args.camera.sensor.as_deref().map(read).transpose()?;
        Ok(Self { flown, tracer: flown.tracer()?, grid: flown.base.grid()?, spectrum: band, full: args.mode == Mode::Full, sensor })
    }

    /// The scene at a time, in kelvin.
    ///
    /// # Errors
    /// A camera inside of a solid, or a ray that leaves the tables.
    pub(super) fn at(&self, time_s: f64) -> crate::Result<Image> {
        let other = |e: cittert_phenomenology::SceneError| crate::ChainError::Other(format!("at {time_s} s: {e}").into());
        let camera = self.flown.flight.camera_at(&self.flown.base, time_s).map_err(other)?;
        self.flown.check(&camera).map_err(other)?;
        if self.full {
            let picture = self.flown.picture(&self.tracer, &camera, &self.spectrum).map_err(other)?;
            return self.image(picture.temperature.plane(0, 0).to_owned());
        }
        let frame = self.flown.frame(&self.tracer, &camera).map_err(other)?;
        self.image(frame.temperature_k)
    }

    /// The pixels that show a surface at a time, of these the ones in a disc if one is given.
    ///
    /// # Errors
    /// A surface that the scene does not have or that no pixel shows.
    pub(super) fn marked(&self, surface: &str, disc: Option<&Target>, time_s: f64) -> Result<Marked> {
        let camera = self.flown.flight.camera_at(&self.flown.base, time_s)?;
        let (numbers, names) = self.flown.surfaces(&self.tracer, &camera, &self.spectrum)?;
        let expected = || Failure::usage(format!("--target-surface is {surface:?}, expected a surface of the scene: {}", names.join(", ")));
        let number = names.iter().position(|name| name == surface).ok_or_else(expected)? as u32 + 1;
        Marked::pixels(&numbers.mapv(|n| n == number), disc).context(format!("--target-surface {surface} at {time_s} s"))
    }

    /// A plane as an image on the grid of the scene.
    ///
    /// # Errors
    /// A plane of another size.
    pub(super) fn image(&self, plane: Array2<f64>) -> crate::Result<Image> {
        let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        Ok(Image::new(self.grid.clone(), self.spectrum.clone(), vec![Polarization::I], data, BrightnessUnit::Kelvin)?)
    }

    /// The filled aperture at a frame rate.
    ///
    /// # Errors
    /// Receivers or a sensor that cannot be.
    pub(super) fn aperture(&self, args: &FilmArgs, rate_hz: f64) -> crate::Result<Aperture> {
        match &self.sensor {
            None => Aperture::of_receivers(&args.camera.receivers, rate_hz, &self.grid),
            Some((options, named)) => Aperture::of_sensor(options, rate_hz, &self.grid, &self.spectrum)
                // The names of options are keys of the file.
                .map_err(|e| ChainError::Other(format!("{named}: {e}").into())),
        }
    }

    /// Whether the filled aperture has noise of its own.
    pub(super) fn has_noise(&self, args: &FilmArgs) -> bool {
        let of_sensor = self.sensor.as_ref().is_some_and(|(s, _)| s.noise.tsys.is_some() || s.noise.receiver.is_some());
        of_sensor || args.camera.receivers.tsys.is_some()
    }

    /// The interferometer at a frame rate, if it is shown.
    ///
    /// # Errors
    /// No layout, or one that is wrong.
    pub(super) fn interferometer(&self, args: &FilmArgs, rate_hz: f64) -> Result<Option<Interferometer>> {
        let Some(name) = &args.array.layout else {
            let missing = args.film.shows(PanelKind::Array);
            ensure!(!missing, Failure::usage("--show array needs the interferometer: give its --layout"));
            return Ok(None);
        };
        ensure!(args.film.shows(PanelKind::Array), Failure::usage("--layout is the interferometer: add array to --show, or leave it out"));
        let layout = load_array(name)?;
        let receivers = &args.camera.receivers;
        let tsys = self.sensor.as_ref().map_or(receivers.tsys, |(sensor, _)| sensor.noise.tsys);
        let spectrum =
            SpectralWindow::band(self.spectrum.mean_hz(), receivers.bandwidth.si(), args.array.channels).context("--channels")?;
        let simulate = SimulateOptions {
            noise: !args.array.array_without_noise,
            tsys: tsys.filter(|_| !args.array.array_without_noise),
            seed: args.camera.seed,
            ..SimulateOptions::default()
        };
        let frame = Duration(1.0 / rate_hz);
        Interferometer::new(layout, spectrum, &self.grid, args.film.array_image, frame, simulate).map(Some).map_err(Failure::call)
    }
}

/// The sensor of a file, whose paths start from its folder.
fn sensor(path: &Path) -> Result<SensorOptions> {
    let mut options: SensorOptions = numbers::read(&read_text(path)?, path)?;
    if let Some(mask) = &options.pupil.aperture_mask {
        let mask = path.parent().unwrap_or(Path::new("")).join(mask);
        options.pupil.mask = Some(open_image(&mask)?.plane(0, 0).to_owned());
    }
    Ok(options)
}

/// The PSF of a file, where the steps need one. A sensor has its own.
///
/// # Errors
/// A PSF that is missing or that no step needs, or a file that is no PSF.
pub(super) fn psf(args: &FilmArgs) -> Result<Option<Psf>> {
    let camera = &args.camera;
    match (camera.steps.as_ref().is_some_and(StepList::needs_psf), camera.psf.as_deref()) {
        (true, None) if camera.sensor.is_some() => Ok(None),
        (true, None) => Err(Failure::usage("a deconvolution needs the PSF of the camera: give its FITS image as --psf, or a --sensor")),
        (false, Some(path)) => {
            Err(Failure::usage(format!("--psf {}: no step uses a PSF; wiener-deconvolution and richardson-lucy do", path.display())))
        }
        (true, Some(path)) => Ok(Some(Psf::of(&open_image(path)?).context(path.display())?)),
        (false, None) => Ok(None),
    }
}
