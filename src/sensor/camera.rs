//! The sensor: made once for scenes on one grid, then frame after frame.

use super::field::FieldOfView;
use super::noise::{Drifts, Moment, NOISE, NoisePart, Receiver};
use super::optics::{Band, Optics};
use super::options::SensorOptions;
use super::resample::Resampler;
use super::response::{Path, Response};
use super::scans::{Field, Samples};
use super::transform::back;
use crate::memory::{ImageWork, check_images};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyGrid, SpectralWindow};
use ndarray::{Array2, Array4, Axis, s};
use num_complex::Complex64;

/// A filled-aperture sensor for scenes on one grid.
#[derive(Debug)]
pub struct Sensor {
    scene: SkyGrid,
    grid: SkyGrid,
    spectrum: SpectralWindow,
    optics: Optics,
    field: FieldOfView,
    resampler: Resampler,
    samples: Samples,
    parts: Vec<(&'static str, Box<dyn NoisePart>)>,
    /// Footprint of a detector and path of a sample, rad.
    footprint: [Path; 2],
    smear: Path,
    frame_s: f64,
    start_s: f64,
}

/// State of a run of frames: time, random numbers, and drifts of the detectors.
#[derive(Debug, Clone)]
pub struct Run {
    seed: u64,
    frames: u64,
    /// Of each polarisation and part of the noise.
    drifts: Vec<Vec<Drifts>>,
}

impl Sensor {
    /// A sensor for scenes with this grid and spectrum. All that stays the same from frame to frame is computed here.
    ///
    /// # Errors
    /// An option that is outside of its range, options that do not go together, or an image that is too large or too coarse for the aperture.
    pub fn new(options: &SensorOptions, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Self> {
        let scan = &options.scan;
        check_images((2 * grid.n_l, 2 * grid.n_m), ImageWork::Entropy)?;
        need("frame_time", scan.frame_time, scan.frame_time.si() > 0.0, "a time above 0s")?;
        need("efficiency", scan.efficiency, scan.efficiency > 0.0 && scan.efficiency <= 1.0, "a fraction above 0 and at most 1")?;
        need("beams", scan.beams, scan.beams > 0, "at least 1")?;
        let optics = Optics::new(options, spectrum)?;
        let pitch = match scan.pitch {
            Some(pitch) => pitch.si(),
            None => grid.cell_rad,
        };
        let out = sampled_grid(grid, pitch, options)?;
        let (frame_s, efficiency, beams) = (scan.frame_time.si(), scan.efficiency, scan.beams);
        let covered = Field { dim: (out.n_m, out.n_l), pitch_rad: pitch, frame_s, efficiency, beams, step: scan.step, size_rad: 0.0 };
        let samples = scan.scan.samples(covered)?;
        // A horn that scans has no other footprint than its beam.
        let width = scan.footprint.map_or(if samples.detectors() > scan.beams { pitch } else { 0.0 }, |f| f.si());
        if let Some(footprint) = scan.footprint {
            need("footprint", footprint, width >= 0.0, "a width of at least 0rad")?;
        }
        let motion = scan.motion.map_or((0.0, 0.0), |motion| motion.components());
        let smear = Path(samples.moved.0 * pitch - motion.0 * samples.dwell_s, samples.moved.1 * pitch - motion.1 * samples.dwell_s);
        let footprint = [Path(width, 0.0), Path(0.0, width)];
        let widest = width.max(smear.0.hypot(smear.1));
        let side = grid.cell_rad * grid.n_l.max(grid.n_m) as f64;
        ensure!(
            widest <= side,
            ChainError::Incompatible(format!(
                "a sample is smeared over {widest:.3e} rad, more than the image, {side:.3e} rad: give a smaller footprint, a slower motion or a \
                 shorter frame time"
            ))
        );
        let paths: Vec<Path> = [footprint[0], footprint[1], smear].into_iter().filter(|p| *p != Path(0.0, 0.0)).collect();
        let field = FieldOfView::new(&optics, &paths, grid, options.aberrations.field_nodes)?;
        let scale = pitch / grid.cell_rad;
        let place = |k: f64, n_out: usize, n: usize| (k - (n_out / 2) as f64) * scale + (n / 2) as f64;
        let sag = |c: usize| samples.sag.get(c).copied().unwrap_or(0.0);
        let resampler = Resampler::new(
            (grid.n_m, grid.n_l),
            (samples.rows, samples.columns),
            |c| place(c as f64, out.n_l, grid.n_l),
            |r, c| place(r as f64 - sag(c), out.n_m, grid.n_m),
            !samples.sag.is_empty(),
        );
        let band = optics.band();
        let receiver = Receiver::new(&options.noise, &samples, band.bandwidth_hz, frame_s);
        let mut parts = Vec::new();
        for kind in NOISE {
            if let Some(part) = (kind.make)(&receiver)? {
                parts.push((kind.name, part));
            }
        }
        // One image is a typical one: it lies in the middle between two calibrations.
        let start_s = options.noise.calibration.map_or(0.0, |every| (0.5 * (every.si() - frame_s)).max(0.0));
        let width_hz = if band.bandwidth_hz > 0.0 { band.bandwidth_hz } else { spectrum.extent_hz() };
        let spectrum = SpectralWindow::band(band.freq_hz, width_hz, 1)?;
        Ok(Self { scene: grid.clone(), grid: out, spectrum, optics, field, resampler, samples, parts, footprint, smear, frame_s, start_s })
    }

    /// Begin a run of frames. One seed gives one run.
    #[must_use]
    pub fn begin(&self, seed: u64) -> Run {
        Run { seed, frames: 0, drifts: Vec::new() }
    }

    /// The next frame of a run, K. Each polarisation of the scene is seen by receivers of its own; channels are averaged.
    ///
    /// # Errors
    /// A scene on another grid, in another unit, or with blank pixels.
    pub fn frame(&self, scene: &Image, run: &mut Run) -> Result<Image> {
        let planes = self.samples_of(scene)?;
        let count = planes.len();
        for plane in run.drifts.len()..count {
            run.drifts.push(self.parts.iter().map(|(_, part)| part.begin(run.seed, plane as u64)).collect());
        }
        let moment = self.moment(run.seed, run.frames);
        let mut out = Vec::new();
        for (k, mut plane) in planes.into_iter().enumerate() {
            let moment = Moment { index: run.frames * count as u64 + k as u64, ..moment };
            for ((_, part), drifts) in self.parts.iter().zip(&mut run.drifts[k]) {
                part.add(&mut plane, drifts, moment);
            }
            out.push(self.samples.gridded(plane, self.grid.n_m));
        }
        run.frames += 1;
        self.finished(scene, out)
    }

    /// A frame without noise, K.
    ///
    /// # Errors
    /// As [`Sensor::frame`].
    pub fn noiseless(&self, scene: &Image) -> Result<Image> {
        let planes = self.samples_of(scene)?.into_iter().map(|plane| self.samples.gridded(plane, self.grid.n_m)).collect();
        self.finished(scene, planes)
    }

    /// Expected standard deviation of the noise of each pixel in the first frame of a run, K (noise-equivalent temperature difference).
    ///
    /// # Errors
    /// As [`Sensor::frame`].
    pub fn nedt(&self, scene: &Image) -> Result<Image> {
        let moment = self.moment(0, 0);
        let of = |plane: &Array2<f64>| {
            let sum = self.parts.iter().fold(Array2::zeros(plane.dim()), |sum, (_, part)| sum + part.variance(plane, moment));
            self.samples.gridded_variance(sum, self.grid.n_m).mapv(f64::sqrt)
        };
        let planes = self.samples_of(scene)?;
        self.finished(scene, planes.iter().map(of).collect())
    }

    /// Mean variance of each part of the noise in the first frame of a run, K^2, with the name of the part.
    ///
    /// # Errors
    /// As [`Sensor::frame`].
    pub fn noise_parts(&self, scene: &Image) -> Result<Vec<(&'static str, f64)>> {
        let planes = self.samples_of(scene)?;
        let Some(first) = planes.first() else { return Ok(Vec::new()) };
        let moment = self.moment(0, 0);
        Ok(self.parts.iter().map(|(name, part)| (*name, part.variance(first, moment).mean().unwrap_or(0.0))).collect())
    }

    /// Grid of the frames.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// Received band.
    #[must_use]
    pub fn band(&self) -> Band {
        self.optics.band()
    }

    /// The optics.
    #[must_use]
    pub fn optics(&self) -> &Optics {
        &self.optics
    }

    /// Time for which a detector looks at a sample, s.
    #[must_use]
    pub fn dwell_s(&self) -> f64 {
        self.samples.dwell_s
    }

    /// Number of detectors.
    #[must_use]
    pub fn detectors(&self) -> usize {
        self.samples.detectors()
    }

    /// Width of a square detector on the sky, and the path of a sample along columns and rows, rad.
    #[must_use]
    pub fn smear_rad(&self) -> (f64, (f64, f64)) {
        (self.footprint[0].0, (self.smear.0, self.smear.1))
    }

    /// Transfer functions in the middle of the field.
    pub(super) fn response(&self) -> &Response {
        self.field.middle()
    }

    pub(super) fn footprint(&self) -> [Path; 2] {
        self.footprint
    }

    pub(super) fn smear(&self) -> Path {
        self.smear
    }

    /// PSF of the whole sensor in the middle of the field, as weights of pixels of the frames with the sum 1. Its centre is the pixel n / 2.
    /// The small part beyond the weights is spread evenly over them.
    ///
    /// # Errors
    /// Pixels that are much coarser than the optics.
    pub fn psf(&self) -> Result<Image> {
        let pitch = self.grid.cell_rad;
        let response = self.response();
        let reach = 24.0 / response.optics.cutoff() + self.footprint[0].0 + self.smear.0.hypot(self.smear.1);
        let n = ((reach / pitch).ceil() as usize * 2).clamp(16, 512).min(((1.99 / pitch) as usize).max(2)) & !1;
        let sampled = response.sampled(pitch)?;
        // The wings beyond the transform wrap into it, so it is wider than what is kept.
        let wide = (4 * n).min(1024);
        let signed = |k: usize| if 2 * k > wide { k as f64 - wide as f64 } else { k as f64 };
        // A shift by half of the period turns the sign of every second frequency.
        let value = |(v, u): (usize, usize)| {
            sampled.at(signed(u) / wide as f64, signed(v) / wide as f64) * if (u + v).is_multiple_of(2) { 1.0 } else { -1.0 }
        };
        let weights = back(Array2::from_shape_fn((wide, wide), value));
        let middle = wide / 2 - n / 2..wide / 2 + n / 2;
        let weights = weights.slice(s![middle.clone(), middle]).mapv(|w: Complex64| w.re.max(0.0));
        let beyond = (1.0 - weights.sum()) / (n * n) as f64;
        let weights = (weights + beyond).mapv(|w| w.max(0.0));
        let sum = weights.sum();
        let data = (weights / sum).insert_axis(Axis(0)).insert_axis(Axis(0));
        let grid = SkyGrid::new(n, n, pitch, self.grid.frame.clone())?;
        Ok(Image::new(grid, self.spectrum.clone(), vec![Polarization::I], data, BrightnessUnit::One)?)
    }

    fn moment(&self, seed: u64, frame: u64) -> Moment {
        Moment { seed, index: frame, time_s: self.start_s + frame as f64 * self.frame_s }
    }

    /// Samples of each polarisation without noise \[row, column\].
    fn samples_of(&self, scene: &Image) -> Result<Vec<Array2<f64>>> {
        let same = scene.grid.n_l == self.scene.n_l && scene.grid.n_m == self.scene.n_m && scene.grid.cell_rad == self.scene.cell_rad;
        ensure!(same, ChainError::Incompatible("the image has another grid than the one for which the sensor was made".into()));
        let unit = scene.unit.bunit();
        ensure!(
            scene.unit == BrightnessUnit::Kelvin,
            ChainError::Incompatible(format!("the image is in {unit:?}, and a sensor needs a scene in K, as `scene render` writes it"))
        );
        let blank = scene.data.iter().filter(|v| !v.is_finite()).count();
        ensure!(
            blank == 0,
            ChainError::NoData(format!(
                "{blank} of {} pixels are blank (NaN or infinite), and optics need the values of all",
                scene.data.len()
            ))
        );
        let (channels, pols, ..) = scene.data.dim();
        let plane = |pol: usize| {
            let mean = if channels == 1 {
                scene.plane(0, pol).to_owned()
            } else {
                scene.data.slice(s![.., pol, .., ..]).mean_axis(Axis(0)).unwrap_or_default()
            };
            Ok(self.resampler.apply(self.field.image(mean.view())?.view()))
        };
        (0..pols).map(plane).collect()
    }

    fn finished(&self, scene: &Image, planes: Vec<Array2<f64>>) -> Result<Image> {
        let mut data = Array4::zeros((1, planes.len(), self.grid.n_m, self.grid.n_l));
        for (k, plane) in planes.iter().enumerate() {
            data.slice_mut(s![0, k, .., ..]).assign(plane);
        }
        let mut out = Image::new(self.grid.clone(), self.spectrum.clone(), scene.polarizations.clone(), data, BrightnessUnit::Kelvin)?;
        (out.object, out.time_jd, out.history) = (scene.object.clone(), scene.time_jd, scene.history.clone());
        Ok(out)
    }
}

/// The grid of the samples: as many as fit into the scene, around the same direction.
fn sampled_grid(scene: &SkyGrid, pitch: f64, options: &SensorOptions) -> Result<SkyGrid> {
    let Some(asked) = options.scan.pitch else { return Ok(scene.clone()) };
    let side = scene.cell_rad * scene.n_l.min(scene.n_m) as f64;
    let good = pitch > 0.0 && 2.0 * pitch <= side && side / pitch <= 32_768.0;
    need("pitch", asked, good, format!("an angle above 0 with 2 to 32768 samples across the image, which is {side:.4e} rad wide"))?;
    let count = |n: usize| (n as f64 * scene.cell_rad / pitch + 1e-6).floor() as usize;
    Ok(SkyGrid::new(count(scene.n_l), count(scene.n_m), pitch, scene.frame.clone())?)
}
