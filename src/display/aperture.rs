//! What a camera measures of a scene in the time of one frame: a filled aperture, or an interferometer in its place.

use super::interferometer::Interferometer;
use super::receiver::{ReceiverOptions, add_noise};
use crate::Result;
use crate::enhance::Psf;
use crate::sensor::{self, Sensor, SensorOptions};
use crate::values::need;
use cittert_arrays::quantity::Duration;
use cittert_arrays::{Image, SkyGrid, SpectralWindow};

/// A filled aperture, or an interferometer in its place, that makes so many frames per second.
#[derive(Debug)]
pub struct Aperture(Kind);

#[derive(Debug)]
enum Kind {
    /// One pixel of the scene is one pixel of the frame, with noise.
    Receivers {
        grid: SkyGrid,
        dwell_s: f64,
        nedt_k: f64,
    },
    Sensor(Box<Sensor>),
    Array {
        array: Box<Interferometer>,
        nedt_k: f64,
    },
}

/// The state of a run of frames.
#[derive(Debug)]
pub struct Run(State);

#[derive(Debug)]
enum State {
    Receivers {
        seed: u64,
        frames: u64,
    },
    Sensor(sensor::Run),
    /// Number of the next frame.
    Array(u64),
}

impl Aperture {
    /// A camera whose only fault is the noise of its receivers, for scenes on a grid.
    ///
    /// # Errors
    /// Receivers that cannot be.
    pub fn of_receivers(receivers: &ReceiverOptions, rate_hz: f64, grid: &SkyGrid) -> Result<Self> {
        receivers.check()?;
        need("rate", rate_hz, rate_hz > 0.0 && rate_hz.is_finite(), "frames per second above 0")?;
        let dwell_s = receivers.dwell_s(rate_hz, grid.n_l * grid.n_m);
        Ok(Self(Kind::Receivers { grid: grid.clone(), dwell_s, nedt_k: receivers.nedt_k(dwell_s) }))
    }

    /// A sensor with its optics and its scan, which takes the whole time of a frame.
    ///
    /// # Errors
    /// As [`Sensor::new`].
    pub fn of_sensor(options: &SensorOptions, rate_hz: f64, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Self> {
        need("rate", rate_hz, rate_hz > 0.0 && rate_hz.is_finite(), "frames per second above 0")?;
        let mut options = options.clone();
        options.scan.frame_time = Duration(1.0 / rate_hz);
        Ok(Self(Kind::Sensor(Box::new(Sensor::new(&options, grid, spectrum)?))))
    }

    /// An interferometer in place of the filled aperture.
    ///
    /// # Errors
    /// As [`Interferometer::nedt_k`].
    pub fn of_interferometer(array: Interferometer) -> Result<Self> {
        let nedt_k = array.nedt_k()?;
        Ok(Self(Kind::Array { array: Box::new(array), nedt_k }))
    }

    /// The grid of its frames.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        match &self.0 {
            Kind::Receivers { grid, .. } => grid,
            Kind::Sensor(sensor) => sensor.grid(),
            Kind::Array { array, .. } => array.grid(),
        }
    }

    /// Time for which a pixel is looked at in a frame, s.
    #[must_use]
    pub fn dwell_s(&self) -> f64 {
        match &self.0 {
            Kind::Receivers { dwell_s, .. } => *dwell_s,
            Kind::Sensor(sensor) => sensor.dwell_s(),
            Kind::Array { array, .. } => array.frame_s(),
        }
    }

    /// The PSF of its frames, for deconvolution. A camera without optics and an interferometer have none.
    ///
    /// # Errors
    /// Pixels that are much coarser than the optics.
    pub fn psf(&self) -> Result<Option<Psf>> {
        match &self.0 {
            Kind::Receivers { .. } | Kind::Array { .. } => Ok(None),
            Kind::Sensor(sensor) => Psf::of(&sensor.psf()?).map(Some),
        }
    }

    /// Standard deviation of the noise that is expected in a frame of a scene, K: the root of its mean square over the pixels,
    /// or of an interferometer the noise in a beam with natural weights.
    ///
    /// # Errors
    /// A scene on another grid, or one that is not in kelvin.
    pub fn nedt_k(&self, scene: &Image) -> Result<f64> {
        match &self.0 {
            Kind::Receivers { nedt_k, .. } | Kind::Array { nedt_k, .. } => Ok(*nedt_k),
            Kind::Sensor(sensor) => {
                let map = sensor.nedt(scene)?;
                Ok(map.plane(0, 0).mapv(|v| v * v).mean().unwrap_or(0.0).sqrt())
            }
        }
    }

    /// Begin a run of frames. One seed gives the same frames again.
    #[must_use]
    pub fn begin(&self, seed: u64) -> Run {
        Run(match &self.0 {
            Kind::Receivers { .. } => State::Receivers { seed, frames: 0 },
            Kind::Sensor(sensor) => State::Sensor(sensor.begin(seed)),
            Kind::Array { .. } => State::Array(seed),
        })
    }

    /// The next frame of a run that this aperture began: what is measured of a scene in kelvin.
    ///
    /// # Errors
    /// A scene on another grid than the aperture was made for, with blank pixels, or a run of another aperture.
    pub fn frame(&self, scene: &Image, run: &mut Run) -> Result<Image> {
        match (&self.0, &mut run.0) {
            (Kind::Receivers { nedt_k, .. }, State::Receivers { seed, frames }) => {
                let mut frame = scene.clone();
                let mut plane = frame.plane(0, 0).to_owned();
                add_noise(&mut plane, *nedt_k, *seed, *frames);
                frame.plane_mut(0, 0).assign(&plane);
                *frames += 1;
                Ok(frame)
            }
            (Kind::Sensor(sensor), State::Sensor(run)) => sensor.frame(scene, run),
            (Kind::Array { array, .. }, State::Array(number)) => {
                let mut frame = scene.clone();
                frame.plane_mut(0, 0).assign(&array.frame(scene, *number)?);
                *number = number.wrapping_add(1);
                Ok(frame)
            }
            _ => Err(crate::ChainError::Internal("the run of another aperture".into())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::quantity::{Frequency, Temperature};
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame};
    use ndarray::Array4;

    fn scene() -> Image {
        let grid = SkyGrid::new(64, 64, 1e-3, SkyFrame::Boresight).unwrap();
        let data =
            Array4::from_shape_fn((1, 1, 64, 64), |(_, _, m, l)| 280.0 + if m.abs_diff(32) < 9 && l.abs_diff(30) < 9 { 20.0 } else { 0.0 });
        Image::new(grid, SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
    }

    #[test]
    fn a_sensor_and_plain_receivers_have_the_noise_of_the_same_dwell() {
        let scene = scene();
        let mut options = SensorOptions::default();
        options.pupil.aperture = Some("circle=1.2m".parse().unwrap());
        options.noise.tsys = Some(Temperature(500.0));
        let sensor = Aperture::of_sensor(&options, 25.0, &scene.grid, &scene.spectrum).unwrap();
        let receivers = ReceiverOptions { tsys: Some(Temperature(500.0)), bandwidth: Frequency(1e9), detectors: None };
        let plain = Aperture::of_receivers(&receivers, 25.0, &scene.grid).unwrap();
        assert_eq!((sensor.dwell_s(), plain.dwell_s()), (0.04, 0.04));
        assert!((sensor.nedt_k(&scene).unwrap() / plain.nedt_k(&scene).unwrap() - 1.0).abs() < 1e-9);
        for camera in [sensor, plain] {
            let (mut run, mut again) = (camera.begin(3), camera.begin(3));
            let frames = [camera.frame(&scene, &mut run).unwrap(), camera.frame(&scene, &mut run).unwrap()];
            assert!(frames[0] == camera.frame(&scene, &mut again).unwrap() && frames[0] != frames[1]);
            let noise = (&frames[0].plane(0, 0) - &frames[1].plane(0, 0)).std(0.0) / 2_f64.sqrt();
            // 4096 differences are uncertain by 1.1 %.
            assert!((noise / camera.nedt_k(&scene).unwrap() - 1.0).abs() < 0.05, "{noise}");
        }
    }

    #[test]
    fn a_sensor_has_a_psf_and_refuses_no_rate() {
        let scene = scene();
        let mut options = SensorOptions::default();
        options.pupil.aperture = Some("circle=0.5m".parse().unwrap());
        let camera = |rate| Aperture::of_sensor(&options, rate, &scene.grid, &scene.spectrum);
        assert!(camera(10.0).unwrap().psf().unwrap().is_some());
        assert!(camera(0.0).unwrap_err().to_string().contains("rate is 0"));
        assert!(Aperture::of_receivers(&ReceiverOptions::default(), 10.0, &scene.grid).unwrap().psf().unwrap().is_none());
    }
}
