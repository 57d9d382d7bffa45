//! The simulation of a set, block by block.

use super::analytic::{Seen, seen_from};
use super::band::BandNodes;
use super::degrid::DegridPlane;
use super::dft::image_dft;
use super::mask::MaskPlane;
use super::method::Method;
use super::near::{Near, surface_of};
use super::noise::{NoiseModel, receivers};
use super::options::check;
use super::pedestal::{self, Chosen};
use super::polarized::{received, sky_basis};
use super::scene_noise::SceneNoise;
use super::sky::{SkyModel, apparent_plane, check_image, nearest_channels, stokes_coefficient, unit_factor, warn_beyond_horizon};
use super::through::{AntennaPatterns, image_through};
use super::total_power;
use super::{ElementPattern, SimulateOptions};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::feeds::Feeds;
use cittert_arrays::{BrightnessUnit, Polarization, SPEED_OF_LIGHT_M_S, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader};
use ndarray::{Array2, Array3, Axis, s};
use num_complex::{Complex, Complex64};
use rayon::prelude::*;

/// One image plane that is used for some channels of the set.
pub(super) struct Plane {
    pub(super) image: usize,
    pub(super) image_chan: usize,
    pub(super) pol: usize,
    /// The channels of the set that use this plane.
    pub(super) chans: Vec<usize>,
    /// Its transform, if it was made and fits into the memory budget.
    ready: Option<Transform>,
}

/// A transformed plane, from which visibilities are sampled.
enum Transform {
    Exact {
        plane: Array2<f64>,
    },
    Degrid(Box<DegridPlane>),
    Mask(MaskPlane),
    /// All pixels are 0.
    Empty,
}

impl Transform {
    fn bytes(&self) -> usize {
        match self {
            Self::Exact { plane } => 8 * plane.len(),
            Self::Degrid(d) => d.bytes(),
            Self::Mask(m) => m.bytes(),
            Self::Empty => 0,
        }
    }
}

/// Computes the visibilities of one scene for rows of coverage.
pub struct Simulator<'a> {
    pub(super) header: VisibilityHeader,
    pub(super) sky: &'a SkyModel,
    pub(super) options: SimulateOptions,
    pub(super) pattern: ElementPattern,
    pub(super) pedestal_k: f64,
    feeds: Feeds,
    /// The products that are summed: those of the set, or Stokes parameters from which turning feeds make them.
    pub(super) basis: Vec<Polarization>,
    /// The sources relative to each phase centre \[phase centre\]\[source\].
    pub(super) sources: Vec<Vec<Seen>>,
    pub(super) planes: Vec<Plane>,
    kept_bytes: usize,
    noise: Option<NoiseModel>,
    /// The visibilities of every pair of antennas, if the scene lies on a surface.
    near: Option<Near>,
    /// Draws the noise of all baselines of an integration together, where it depends on the scene.
    pub(super) scene_noise: Option<SceneNoise>,
    /// The zero spacing \[chan, pol\] of the phase centre of this index, where it is known.
    pub(super) zero: Option<(u16, Array2<Complex64>)>,
    /// Frequencies within each channel, Hz \[chan\]\[sub-channel\].
    pub(super) freq_hz: Vec<Vec<f64>>,
    /// Weights of these frequencies, where they are not equal.
    pub(super) band: Option<BandNodes>,
    /// The patterns of the antennas, where they differ.
    pub(super) through: Option<AntennaPatterns>,
    warned_coarse: bool,
    n_vis: Option<u64>,
    pub(super) memory: MemoryBudget,
}

/// Largest part of a visibility that is simulated. Imaging uses none above 1e19, whose squares 32-bit numbers cannot hold.
const LARGEST: f64 = 1e19;

impl<'a> Simulator<'a> {
    /// Check the header, the scene and the options. [`Simulator::header`] is then the header of the output: the given header with the
    /// pattern of the elements, the pedestal and a line of history.
    ///
    /// # Errors
    /// The scene is empty, an image has another frame than the set, a NaN or an unknown unit, a source is behind the horizon, an option is
    /// outside its range, or noise is requested for antennas without SEFD or Tsys.
    pub fn new(header: VisibilityHeader, sky: &'a SkyModel, options: &SimulateOptions, observer: &dyn Observer) -> Result<Self> {
        check(options)?;
        let pattern = options.pattern(&header.layout)?;
        pattern.check_band(header.spectrum.range_hz())?;
        if sky.images.is_empty() && sky.sources.is_empty() {
            return Err(ChainError::NoData("the scene holds neither an image nor a source".into()));
        }
        if header.unit == VisUnit::Uncalibrated {
            return Err(ChainError::Incompatible("visibilities can be simulated in Jy or K sr, not in correlator units".into()));
        }
        if options.method == Method::Mask && sky.images.is_empty() {
            return Err(ChainError::Incompatible(
                "method mask samples the FFT of an image, but the scene has only sources: use dft".into(),
            ));
        }
        for image in &sky.images {
            check_image(image, &header.phase_centers)?;
            warn_beyond_horizon(image, observer);
        }
        let sources = header
            .phase_centers
            .iter()
            .map(|c| sky.sources.iter().enumerate().map(|(k, s)| seen_from(s, k + 1, c)).collect())
            .collect::<Result<Vec<Vec<Seen>>>>()?;
        if options.autos {
            total_power::check(options)?;
        }
        let whole = options.autos || options.scene_noise || !pattern.is_none();
        let Chosen { pedestal_k, scene_pedestal_k } = pedestal::choose(options.pedestal, sky, header.unit, whole)?;
        if let Some(t) = pedestal_k {
            observer.event(Event::Note(&format!("removed a pedestal of {t:.3} K from the scene; images add it back")));
            if !pattern.is_none() {
                let text = "the pedestal was removed before the pattern of the elements: no instrument measures such visibilities; leave the pedestal out";
                observer.event(Event::Warning(text));
            }
        }
        let feeds = Feeds::of(&header)?;
        let basis = sky_basis(&header, &feeds, sky, options.feed_basis)?;
        let noise_options = options.noise_options()?;
        let noise = noise_options.as_ref().map(|n| NoiseModel::new(&header, n, &pattern)).transpose()?;
        let scene_noise = options.scene_noise.then(|| SceneNoise::new(&header.polarizations, options.seed)).transpose()?;
        ensure!(
            scene_noise.is_none() || pedestal_k.is_none(),
            ChainError::bad_option("pedestal", "removed", "none with scene-noise, which depends on the whole scene")
        );
        let text = "noise of the scene is known for feeds that do not turn on the sky: leave out scene-noise, or the mount";
        ensure!(scene_noise.is_none() || basis == header.polarizations, ChainError::Incompatible(text.into()));
        let mut simulator = Self {
            planes: list_planes(&header, &basis, sky, &pattern),
            feeds,
            basis,
            pattern,
            freq_hz: frequencies(&header, options.subchannels),
            band: None,
            through: None,
            header,
            sky,
            options: options.clone(),
            pedestal_k: pedestal_k.unwrap_or(0.0),
            sources,
            kept_bytes: 0,
            noise,
            near: None,
            scene_noise,
            zero: None,
            warned_coarse: false,
            n_vis: None,
            memory: MemoryBudget::default(),
        };
        simulator.header.layout.pattern.clone_from(&simulator.pattern);
        simulator.header.pedestal_k = pedestal_k;
        simulator.header.scene_pedestal_k = scene_pedestal_k;
        simulator.header.scene_width_rad = sky.width_rad();
        if options.autos {
            let receivers = receivers(&simulator.header.layout, noise_options.as_ref());
            simulator.header.layout = simulator.header.layout.with_receivers(&receivers);
        }
        if !options.no_antenna_temperature {
            simulator.header.antenna_temperature_k = simulator.antenna_temperature_k();
        }
        if let Some(surface) = surface_of(sky, options)? {
            let text = "noise of the scene is known for the far field only: leave out the range, or scene-noise";
            ensure!(simulator.scene_noise.is_none(), ChainError::Incompatible(text.into()));
            simulator.near = Some(simulator.near_field(&surface, observer)?);
            simulator.header.near_field.scene = Some(surface.scene_range());
        }
        let line = simulator.history();
        simulator.header.history.push(line);
        Ok(simulator)
    }

    /// True if the scene lies near the array.
    pub(super) fn is_near(&self) -> bool {
        self.near.is_some()
    }

    /// Header of the output.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn history(&self) -> String {
        let o = &self.options;
        let mut line = format!("simulate: method {}", o.method.name());
        if self.near.is_some() {
            let range = self.header.near_field.scene.as_ref().map_or(String::new(), ToString::to_string);
            line = format!("simulate: exact sum over spherical waves, scene range {range}");
        } else if o.method == Method::Degrid {
            line += &format!(", epsilon {:e}", o.epsilon);
        }
        line += &format!(", w term {}, pattern {}, {} sub-channels", !o.no_w && o.method != Method::Mask, self.pattern, o.subchannels);
        line += &self.header.pedestal_k.map_or(", no pedestal".to_owned(), |t| format!(", pedestal {t} K"));
        line += if self.options.autos { ", autocorrelations with the power of the receivers" } else { "" };
        line += &if self.noise.is_some() {
            format!(", noise{} seed {}", if o.scene_noise { " of scene and receivers," } else { "" }, o.seed)
        } else {
            ", no noise".to_owned()
        };
        line
    }

    /// Simulate the rows of one block. `first_row` is the index of its first row in the set.
    ///
    /// # Errors
    /// A row has an antenna or a phase centre that the header does not have, or noise is requested and an integration time is not positive.
    pub fn block(&mut self, coverage: UvCoverage, first_row: u64, observer: &dyn Observer) -> Result<VisibilityBlock> {
        self.check_rows(&coverage, observer)?;
        let (_, n_chan, n_pol) = self.header.shape(coverage.n_rows());
        let (mut sum, outside) = self.expected(&coverage)?;
        if sum.iter().any(|v| !(v.re.abs() <= LARGEST && v.im.abs() <= LARGEST)) {
            let text = format!(
                "the scene has visibilities above {LARGEST:e} {}, which imaging does not use: its fluxes or temperatures are wrong",
                self.header.unit.name()
            );
            return Err(ChainError::Incompatible(text));
        }
        if self.options.autos {
            total_power::add_receivers(&self.header, &coverage, &mut sum);
        }
        let mut block = VisibilityBlock::zeros(coverage, n_chan, n_pol);
        block.vis.zip_mut_with(&sum, |out, v| *out = Complex::new(v.re as f32, v.im as f32));
        drop(sum);
        if let Some(noise) = &self.noise {
            if let Some(scene_noise) = self.scene_noise.clone() {
                let receivers = noise.receivers().to_owned();
                let zero = self.zero_spacing(&block.coverage)?;
                scene_noise.apply(&self.header, &mut block, (zero.view(), receivers.view()), first_row)?;
            } else {
                noise.apply(&mut block, first_row)?;
            }
        }
        for ((row, chan), _) in outside.indexed_iter().filter(|(_, o)| **o) {
            block.flags.slice_mut(s![row, chan, ..]).fill(true);
            block.weights.slice_mut(s![row, chan, ..]).fill(0.0);
            block.vis.slice_mut(s![row, chan, ..]).fill(Complex::new(0.0, 0.0));
        }
        Ok(block)
    }

    /// The expected visibilities of the scene \[row, chan, pol\], and which of them lie outside the grid of the mask \[row, chan\].
    pub(super) fn expected(&mut self, coverage: &UvCoverage) -> Result<(Array3<Complex64>, Array2<bool>)> {
        let (n_rows, n_chan, _) = self.header.shape(coverage.n_rows());
        let mut sum = Array3::<Complex64>::zeros((n_rows, n_chan, self.basis.len()));
        let mut outside = Array2::from_elem((n_rows, n_chan), false);
        if let Some(near) = &self.near {
            near.add_to(coverage, &mut sum);
        } else {
            for k in 0..self.planes.len() {
                self.add_plane(k, coverage, &mut sum, &mut outside)?;
            }
            if !self.sky.sources.is_empty() {
                self.add_sources(coverage, &mut sum)?;
            }
            self.turn_to_focus(coverage, &mut sum);
        }
        if self.basis != self.header.polarizations {
            sum = received(&sum, coverage, &self.feeds, (self.options.feed_basis, &self.header.polarizations))?;
        }
        Ok((sum, outside))
    }

    fn check_rows(&mut self, coverage: &UvCoverage, observer: &dyn Observer) -> Result<()> {
        let (n_ant, n_centers) = (self.header.layout.n_ant(), self.header.phase_centers.len());
        let antenna = coverage.ant1.iter().chain(&coverage.ant2).map(|a| *a as usize).find(|a| *a >= n_ant);
        let center = coverage.phase_center.iter().map(|p| usize::from(*p)).find(|p| *p >= n_centers);
        for (what, index, len) in [("antenna", antenna, n_ant), ("phase centre", center, n_centers)] {
            if let Some(index) = index {
                return Err(cittert_arrays::ArrayError::OutOfRange { what, index, len }.into());
            }
        }
        if let Some(bad) = coverage.uvw_m.iter().find(|x| !x.is_finite()) {
            return Err(ChainError::Incompatible(format!("the coverage holds a baseline of {bad} m")));
        }
        let longest = coverage.longest_uv_m() * self.header.spectrum.range_hz().1 / SPEED_OF_LIGHT_M_S;
        for image in &self.sky.images {
            let limit = 0.5 / image.grid.cell_rad;
            if longest > limit && !self.warned_coarse && self.options.method != Method::Mask {
                self.warned_coarse = true;
                observer.event(Event::Warning(&format!(
                    "the longest baseline is {longest:.4e} wavelengths, but cells of {:.4} arcsec hold structure only up to {limit:.4e}: visibilities beyond are an alias of the scene; use cells below {:.4} arcsec",
                    image.grid.cell_rad.to_degrees() * 3600.0,
                    (0.5 / longest).to_degrees() * 3600.0
                )));
            }
        }
        Ok(())
    }

    fn add_plane(&mut self, k: usize, coverage: &UvCoverage, sum: &mut Array3<Complex64>, outside: &mut Array2<bool>) -> Result<()> {
        let uvw = coverage.uvw_m.view();
        let mut transform = self.take_transform(k)?;
        let before = transform.bytes();
        let plane = &self.planes[k];
        let image = &self.sky.images[plane.image];
        let freqs: Vec<f64> = plane.chans.iter().flat_map(|c| self.freq_hz[*c].iter().copied()).collect();
        let of: Vec<usize> = plane.chans.iter().flat_map(|c| self.freq_hz[*c].iter().map(|_| *c)).collect();
        let vis = match &mut transform {
            Transform::Exact { plane: seen } if self.through.is_some() => {
                let pattern_hz = self.header.spectrum.freq_hz()[plane.chans[0]];
                let scene = (&image.grid, seen.view());
                self.through.as_ref().map(|t| image_through(t, scene, coverage, (&freqs, pattern_hz), !self.options.no_w)).transpose()?
            }
            Transform::Exact { plane } => Some(image_dft(&image.grid, plane.view(), uvw, &freqs, !self.options.no_w)?),
            Transform::Degrid(degridder) => Some(degridder.predict(uvw)?),
            Transform::Mask(mask) => Some(mask.predict(uvw, &freqs, |row, f| outside[[row, of[f]]] = true)),
            Transform::Empty => None,
        };
        if let Some(vis) = vis {
            let terms = products(image.polarizations[plane.pol], &self.basis);
            // The factors of the frequencies within each channel, and the index of the first of them.
            let mut first = 0;
            let factors = plane.chans.iter().map(|chan| {
                let freq_hz = &self.freq_hz[*chan];
                let share = if self.band.is_some() { 1.0 } else { freq_hz.len() as f64 };
                let factors: Vec<f64> = freq_hz.iter().map(|f| unit_factor(image.unit, self.header.unit, *f) / share).collect();
                first += freq_hz.len();
                (*chan, first - freq_hz.len(), factors)
            });
            let factors: Vec<(usize, usize, Vec<f64>)> = factors.collect();
            let band = self.band.as_ref();
            sum.outer_iter_mut().into_par_iter().zip(vis.axis_iter(Axis(0))).enumerate().for_each(|(row, (mut out, vis))| {
                let pair = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
                for (chan, first, factors) in &factors {
                    let parts = factors.iter().enumerate();
                    let mean: Complex64 = match band {
                        None => parts.map(|(j, f)| vis[first + j] * *f).sum(),
                        Some(band) => parts.map(|(j, f)| vis[first + j] * *f * band.weight(pair, *chan, j)).sum(),
                    };
                    for (pol, coefficient) in &terms {
                        out[(*chan, *pol)] += mean * coefficient;
                    }
                }
            });
        }
        self.keep_transform(k, transform, before);
        Ok(())
    }

    fn take_transform(&mut self, k: usize) -> Result<Transform> {
        Ok(match self.planes[k].ready.take() {
            Some(t) => t,
            None => {
                let t = self.transform(k)?;
                self.kept_bytes += t.bytes();
                t
            }
        })
    }

    /// Keep a transform that had `before` bytes.
    fn keep_transform(&mut self, k: usize, transform: Transform, before: usize) {
        // The degridder grows with the range of w of the rows.
        self.kept_bytes += transform.bytes() - before;
        // A transform that does not fit into the budget is made again for every block.
        if self.kept_bytes <= self.memory.kept_scenes() {
            self.planes[k].ready = Some(transform);
        } else {
            self.kept_bytes -= transform.bytes();
        }
    }

    /// Prepare for rows some of which another process simulates, so that the others are simulated to the same bits as all in one process.
    pub(crate) fn cover(&mut self, coverage: &UvCoverage, observer: &dyn Observer) -> Result<()> {
        self.check_rows(coverage, observer)?;
        for k in 0..if self.is_near() { 0 } else { self.planes.len() } {
            let mut transform = self.take_transform(k)?;
            let before = transform.bytes();
            if let Transform::Degrid(degridder) = &mut transform {
                degridder.cover(coverage.uvw_m.view());
            }
            self.keep_transform(k, transform, before);
        }
        Ok(())
    }

    /// Expect about so many visibilities in all: the transforms of a large image then take less memory for a small set.
    #[must_use]
    pub(crate) fn expecting(mut self, n_vis: u64) -> Self {
        self.n_vis = Some(n_vis);
        self
    }

    fn transform(&self, k: usize) -> Result<Transform> {
        let plane = &self.planes[k];
        let image = &self.sky.images[plane.image];
        let freq = self.header.spectrum.freq_hz()[plane.chans[0]];
        let pedestal = if self.header.pedestal_k.is_some() && image.unit == BrightnessUnit::Kelvin { self.pedestal_k } else { 0.0 };
        let pattern = if self.through.is_some() { &ElementPattern::None } else { &self.pattern };
        let seen = apparent_plane(image, (plane.image_chan, plane.pol), pattern, freq, pedestal, self.options.one_over_n);
        if seen.iter().all(|v| *v == 0.0) && self.options.method != Method::Mask {
            return Ok(Transform::Empty);
        }
        Ok(match self.options.method {
            _ if self.through.is_some() => Transform::Exact { plane: seen },
            Method::Dft => Transform::Exact { plane: seen },
            Method::Degrid => {
                let freqs = plane.chans.iter().flat_map(|c| self.freq_hz[*c].iter().copied()).collect();
                let accuracy = (self.options.epsilon, !self.options.no_w);
                Transform::Degrid(Box::new(DegridPlane::new(&image.grid, seen, freqs, accuracy, self.n_vis)))
            }
            Method::Mask => Transform::Mask(MaskPlane::new(&image.grid, &seen)?),
        })
    }
}

/// The products of the set to which a Stokes plane contributes, with their coefficients.
pub(super) fn products(scene: Polarization, set: &[Polarization]) -> Vec<(usize, Complex64)> {
    set.iter().enumerate().map(|(k, p)| (k, stokes_coefficient(scene, *p))).filter(|(_, c)| *c != Complex64::ZERO).collect()
}

/// The planes of the images, with the channels that use each of them. There is one plane for each different pattern.
fn list_planes(header: &VisibilityHeader, basis: &[Polarization], sky: &SkyModel, pattern: &ElementPattern) -> Vec<Plane> {
    let mut planes = Vec::new();
    for (index, image) in sky.images.iter().enumerate() {
        let nearest = nearest_channels(&image.spectrum, &header.spectrum);
        for (pol, name) in image.polarizations.iter().enumerate() {
            if products(*name, basis).is_empty() {
                continue;
            }
            let plane = |image_chan, chans| Plane { image: index, image_chan, pol, chans, ready: None };
            if pattern.varies_with_frequency() {
                planes.extend(nearest.iter().enumerate().map(|(chan, image_chan)| plane(*image_chan, vec![chan])));
            } else {
                for image_chan in 0..image.spectrum.n_chan() {
                    let chans: Vec<usize> = (0..nearest.len()).filter(|c| nearest[*c] == image_chan).collect();
                    if !chans.is_empty() {
                        planes.push(plane(image_chan, chans));
                    }
                }
            }
        }
    }
    planes
}

/// Centres of equal sub-channels in each channel, Hz.
fn frequencies(header: &VisibilityHeader, subchannels: usize) -> Vec<Vec<f64>> {
    let spectrum = &header.spectrum;
    let offset = |k: usize| (k as f64 + 0.5) / subchannels as f64 - 0.5;
    spectrum.freq_hz().iter().zip(spectrum.width_hz()).map(|(f, w)| (0..subchannels).map(|k| f + w * offset(k)).collect()).collect()
}
