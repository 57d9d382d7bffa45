//! A filled-aperture sensor: a scene in kelvin through diffraction, detectors that scan or stare, and noise.
//!
//! The transfer function of the optics is the autocorrelation of the pupil, averaged over the band. Footprint and motion of a sample multiply it.
//! Samples are taken where the scan pattern has them, and each part of the noise adds to them what its detector and its time have. A [`Sensor`]
//! is made once and takes any number of frames; the bytes of a frame do not depend on the number of threads.
//!
//! ```
//! use cittert::arrays::quantity::{Duration, Temperature};
//! use cittert::arrays::{BrightnessUnit, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow};
//! use cittert::sensor::{Sensor, SensorOptions};
//! use ndarray::Array4;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let grid = SkyGrid::new(64, 48, 1e-3, SkyFrame::Boresight)?;
//! let band = SpectralWindow::band(94e9, 8e9, 1)?;
//! let scene = Image::new(grid.clone(), band.clone(), vec![Polarization::I], Array4::from_elem((1, 1, 48, 64), 280.0), BrightnessUnit::Kelvin)?;
//!
//! let mut options = SensorOptions::default();
//! options.pupil.aperture = Some("circle=1.2m".parse()?);
//! options.noise.tsys = Some(Temperature(1000.0));
//! options.scan.frame_time = Duration(0.1);
//! let sensor = Sensor::new(&options, &grid, &band)?;
//! let mut run = sensor.begin(1);
//! let frame = sensor.frame(&scene, &mut run)?;
//! let noise = sensor.nedt(&scene)?;
//! assert!((frame.data[[0, 0, 20, 30]] - 280.0).abs() < 5.0 * noise.data[[0, 0, 20, 30]]);
//! # Ok(())
//! # }
//! ```

mod aberrations;
mod camera;
mod coefficients;
mod field;
mod figures;
mod intervals;
mod motion;
mod noise;
mod optics;
mod options;
#[cfg(test)]
mod oracle_tests;
mod pupil;
mod resample;
mod response;
mod scans;
mod shapes;
mod struts;
mod taper;
#[cfg(test)]
mod tests;
mod transfer;
mod transform;
mod zernike;

pub use camera::{Run, Sensor};
pub use coefficients::ZernikeList;
pub use figures::{Ensquared, Modulation};
pub use motion::Motion;
pub use noise::{NOISE, NoiseKind, RADIOMETERS, Radiometer, RadiometerKind};
pub use optics::{Band, Optics};
pub use options::{AberrationOptions, BandOptions, NoiseOptions, PupilOptions, ScanOptions, SensorOptions};
pub use scans::{SCANS, ScanKind, ScanPattern};
pub use shapes::{Aperture, MadeShape, SHAPES, Shape, ShapeKind};
pub use taper::{TAPERS, Taper, TaperKind};
pub use zernike::{degree, zernike};
