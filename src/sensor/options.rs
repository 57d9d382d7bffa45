//! Options of the sensor: one type for the library, the command line and its files.

use super::coefficients::ZernikeList;
use super::motion::Motion;
use super::noise::Radiometer;
use super::scans::ScanPattern;
use super::shapes::Aperture;
use super::taper::Taper;
use cittert_arrays::quantity::{Angle, Duration, Frequency, Length, Temperature};
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Options of the sensor. A file has a table for each group.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct SensorOptions {
    /// Where light enters.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub pupil: PupilOptions,
    /// Errors of the wavefront.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub aberrations: AberrationOptions,
    /// Received frequencies.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub band: BandOptions,
    /// Detectors and the order in which they see the scene.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub scan: ScanOptions,
    /// Noise.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub noise: NoiseOptions,
}

/// Where light enters.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Pupil"))]
pub struct PupilOptions {
    /// Shape of the aperture with its lengths: circle=1.2m, rectangle=1.2m:0.8m, hexagon=1.2m, polygon=X:Y:X:Y:X:Y...
    #[cfg_attr(feature = "cli", arg(long, value_name = "SHAPE"))]
    pub aperture: Option<Aperture>,
    /// Shape of a central blockage, as that of the aperture.
    #[cfg_attr(feature = "cli", arg(long, value_name = "SHAPE"))]
    pub blockage: Option<Aperture>,
    /// Number of struts, evenly spaced from the axis to the rim.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 0))]
    pub struts: usize,
    /// Width of each strut.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub strut_width: Option<Length>,
    /// Direction of the first strut, from the columns of the image (x) towards its rows (y) [default: 0deg].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true))]
    pub strut_angle: Option<Angle>,
    /// Fall of the illumination towards the rim: uniform, gaussian=EDGE_DB, parabola=EDGE_DB:POWER.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TAPER", default_value_t = Taper::default()))]
    pub taper: Taper,
    /// FITS picture of the open parts of the aperture, from 0 (closed) to 1 (open). It fills the box around the aperture.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS"))]
    pub aperture_mask: Option<PathBuf>,
    /// The picture of `aperture_mask`, once it is loaded \[y, x\].
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub mask: Option<Array2<f64>>,
}

/// Errors of the wavefront.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Aberrations"))]
pub struct AberrationOptions {
    /// Zernike coefficients by Noll index, in waves rms at the centre of the band: 4:0.1,7:-0.05.
    #[cfg_attr(feature = "cli", arg(long, value_name = "INDEX:WAVES,...", allow_hyphen_values = true))]
    pub zernike: Option<ZernikeList>,
    /// Distance of the scene. With --focus it gives the defocus [default: the distance of the focus].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub range: Option<Length>,
    /// Distance to which the optics are focused [default: infinity].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub focus: Option<Length>,
    /// Coma in waves rms at the nearer edge of the field. It grows in proportion to the distance from the centre and points away from it.
    #[cfg_attr(feature = "cli", arg(long, value_name = "WAVES", default_value_t = 0.0, allow_hyphen_values = true))]
    pub coma: f64,
    /// Astigmatism in waves rms at the nearer edge of the field. It grows with the square of the distance from the centre.
    #[cfg_attr(feature = "cli", arg(long, value_name = "WAVES", default_value_t = 0.0, allow_hyphen_values = true))]
    pub astigmatism: f64,
    /// Number of places along each axis of the field at which the PSF is computed, where it depends on the place.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = AberrationOptions::default().field_nodes))]
    pub field_nodes: usize,
}

impl Default for AberrationOptions {
    fn default() -> Self {
        Self { zernike: None, range: None, focus: None, coma: 0.0, astigmatism: 0.0, field_nodes: 5 }
    }
}

/// Received frequencies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Band"))]
pub struct BandOptions {
    /// Centre of the band [default: that of the image].
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub freq: Option<Frequency>,
    /// Width of the band [default: that of the image].
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub bandwidth: Option<Frequency>,
    /// Number of frequencies over which the PSF is averaged.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = BandOptions::default().frequencies))]
    pub frequencies: usize,
}

impl Default for BandOptions {
    fn default() -> Self {
        Self { freq: None, bandwidth: None, frequencies: 5 }
    }
}

/// Detectors and the order in which they see the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Detectors and scan"))]
pub struct ScanOptions {
    /// How the samples are taken: array, raster, conical=RADIUS, pushbroom.
    #[cfg_attr(feature = "cli", arg(long, value_name = "PATTERN", default_value_t = ScanPattern::default()))]
    pub scan: ScanPattern,
    /// Distance of neighbouring samples [default: the cell of the image].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub pitch: Option<Angle>,
    /// Width on the sky of a square detector [default: the pitch for array and pushbroom, 0 for a horn that scans].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub footprint: Option<Angle>,
    /// Time in which the whole image is taken.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = ScanOptions::default().frame_time))]
    pub frame_time: Duration,
    /// Part of the time in which detectors look at the scene.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = ScanOptions::default().efficiency))]
    pub efficiency: f64,
    /// Number of lines that raster and conical scans take at once, with a detector each.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = ScanOptions::default().beams))]
    pub beams: usize,
    /// The scan stands still during a sample, so that it does not blur it.
    #[cfg_attr(feature = "cli", arg(long))]
    pub step: bool,
    /// Motion of the scene: angle a second, and direction from the columns of the image towards its rows: 2mrad/s:90deg.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE/s[:ANGLE]"))]
    pub motion: Option<Motion>,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            scan: ScanPattern::default(),
            pitch: None,
            footprint: None,
            frame_time: Duration(1.0),
            efficiency: 1.0,
            beams: 1,
            step: false,
            motion: None,
        }
    }
}

/// Noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Noise"))]
pub struct NoiseOptions {
    /// System temperature. Without it and --receiver there is no thermal noise.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMPERATURE", conflicts_with = "receiver"))]
    pub tsys: Option<Temperature>,
    /// Noise temperature of the receiver, to which the temperature of each pixel is added.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMPERATURE"))]
    pub receiver: Option<Temperature>,
    /// Kind of radiometer: total-power, dicke, correlation.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND", default_value_t = Radiometer::default()))]
    pub radiometer: Radiometer,
    /// Frequency at which 1/f noise is as strong as thermal noise [default: no 1/f noise].
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub knee: Option<Frequency>,
    /// Exponent a of 1/f noise, whose power falls as f^-a.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = NoiseOptions::default().slope))]
    pub slope: f64,
    /// Fraction by which the gain of a detector wanders in a second; it grows with the square root of time.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = 0.0))]
    pub gain_drift: f64,
    /// Time between calibrations, which reset gain and 1/f noise [default: one calibration before the first frame].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME"))]
    pub calibration: Option<Duration>,
    /// Standard deviation of the offsets of detectors, which stay the same.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMPERATURE"))]
    pub offset_pattern: Option<Temperature>,
    /// Standard deviation of the relative gains of detectors, which stay the same.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = 0.0))]
    pub gain_pattern: f64,
    /// Bits of the digitiser, from 1 to 24 [default: no quantisation].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub bits: Option<u32>,
    /// Temperature of the lowest level of the digitiser.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMPERATURE", default_value_t = NoiseOptions::default().lowest, allow_hyphen_values = true))]
    pub lowest: Temperature,
    /// Temperature of its highest level.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMPERATURE", default_value_t = NoiseOptions::default().highest))]
    pub highest: Temperature,
    /// Seed of the random numbers.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = NoiseOptions::default().seed))]
    pub seed: u64,
}

impl Default for NoiseOptions {
    fn default() -> Self {
        Self {
            tsys: None,
            receiver: None,
            radiometer: Radiometer::default(),
            knee: None,
            slope: 1.0,
            gain_drift: 0.0,
            calibration: None,
            offset_pattern: None,
            gain_pattern: 0.0,
            bits: None,
            lowest: Temperature(0.0),
            highest: Temperature(400.0),
            seed: 1,
        }
    }
}
