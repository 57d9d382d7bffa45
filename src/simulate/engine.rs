//! The simulation of a set, block by block.

use super::analytic::{Seen, seen_from, sources_dft};
use super::degrid::DegridPlane;
use super::dft::{image_dft, n_minus_1};
use super::mask::MaskPlane;
use super::method::Method;
use super::near::{Near, surface_of};
use super::noise::NoiseModel;
use super::options::check;
use super::pedestal::{self, Chosen};
use super::sky::{SkyModel, apparent_plane, check_image, from_jy, holds_intensity, nearest_channels, stokes_coefficient, unit_factor};
use super::{ElementPattern, SimulateOptions};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{
    BrightnessUnit, Image, Polarization, SPEED_OF_LIGHT_M_S, SkyGrid, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader,
    VisibilitySet, VisibilitySink,
};
use ndarray::{Array2, Array3, ArrayView2, Axis, s};
use num_complex::{Complex, Complex64};

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

/// The numbers of rows and visibilities of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Rows written.
    pub rows: u64,
    /// Visibilities written.
    pub visibilities: u64,
    /// Visibilities among these that are flagged because they lie outside the grid of the mask.
    pub flagged: u64,
}

/// Computes the visibilities of one scene for rows of coverage.
pub struct Simulator<'a> {
    pub(super) header: VisibilityHeader,
    pub(super) sky: &'a SkyModel,
    pub(super) options: SimulateOptions,
    pub(super) pattern: ElementPattern,
    pub(super) pedestal_k: f64,
    /// The sources relative to each phase centre \[phase centre\]\[source\].
    pub(super) sources: Vec<Vec<Seen>>,
    pub(super) planes: Vec<Plane>,
    kept_bytes: usize,
    noise: Option<NoiseModel>,
    /// The visibilities of every pair of antennas, if the scene lies on a surface.
    near: Option<Near>,
    /// Frequencies within each channel, Hz \[chan\]\[sub-channel\].
    pub(super) freq_hz: Vec<Vec<f64>>,
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
        let Chosen { pedestal_k, scene_pedestal_k } = pedestal::choose(options.pedestal, sky, header.unit, &pattern)?;
        if let Some(t) = pedestal_k {
            observer.event(Event::Note(&format!("removed a pedestal of {t:.3} K from the scene; images add it back")));
            if !pattern.is_none() {
                let text = "the pedestal was removed before the pattern of the elements: no instrument measures such visibilities; leave the pedestal out";
                observer.event(Event::Warning(text));
            }
        }
        let noise = options.noise_options()?.map(|n| NoiseModel::new(&header, &n, &pattern)).transpose()?;
        let mut simulator = Self {
            planes: list_planes(&header, sky, &pattern),
            pattern,
            freq_hz: frequencies(&header, options.subchannels),
            header,
            sky,
            options: options.clone(),
            pedestal_k: pedestal_k.unwrap_or(0.0),
            sources,
            kept_bytes: 0,
            noise,
            near: None,
            warned_coarse: false,
            n_vis: None,
            memory: MemoryBudget::default(),
        };
        simulator.header.layout.pattern.clone_from(&simulator.pattern);
        simulator.header.pedestal_k = pedestal_k;
        simulator.header.scene_pedestal_k = scene_pedestal_k;
        simulator.header.scene_width_rad = sky.width_rad();
        simulator.header.antenna_temperature_k = simulator.antenna_temperature_k();
        if let Some(surface) = surface_of(sky, options)? {
            simulator.near = Some(simulator.near_field(&surface, observer)?);
            simulator.header.near_field.scene = Some(surface.scene_range());
        }
        let line = simulator.history();
        simulator.header.history.push(line);
        Ok(simulator)
    }

    /// Header of the output.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    /// The temperature that one element sees in the middle of the band, if a warm scene is observed in K sr through a pattern: its zero spacing
    /// over the solid angle of the pattern, as an ideal measurement of total power gives it.
    fn antenna_temperature_k(&self) -> Option<f64> {
        let freq = self.header.spectrum.mean_hz();
        let solid_angle = self.pattern.solid_angle_sr(freq)?;
        let thermal = self.header.unit == VisUnit::KelvinSr && self.header.pedestal_k.is_none() && self.sky.sources.is_empty();
        let intensity = |image: &Image| image.polarizations.iter().position(|p| holds_intensity(*p));
        let images: Option<Vec<(&Image, usize)>> = self.sky.images.iter().map(|i| Some((i, intensity(i)?))).collect();
        let images = images.filter(|i| thermal && !i.is_empty() && i.iter().all(|(i, _)| i.unit == BrightnessUnit::Kelvin))?;
        let seen = images.into_iter().map(|(image, pol)| {
            let chan = image.spectrum.n_chan() / 2;
            apparent_plane(image, (chan, pol), &self.pattern, freq, 0.0, self.options.one_over_n).sum()
        });
        Some(seen.sum::<f64>() / solid_angle)
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
        line += &if self.noise.is_some() { format!(", noise seed {}", o.seed) } else { ", no noise".to_owned() };
        line
    }

    /// Simulate all rows of an iterator and write them to a sink. The caller opens the sink with [`Simulator::header`] and finishes it. The
    /// observer receives `total_rows` for its estimate of the remaining time.
    ///
    /// # Errors
    /// As [`Simulator::block`]; also if the iterator or the sink fails, or the observer asks to stop.
    pub fn run(
        &mut self,
        rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
        total_rows: Option<u64>,
        sink: &mut dyn VisibilitySink,
        observer: &dyn Observer,
    ) -> Result<Summary> {
        let per_row = (self.header.spectrum.n_chan() * self.header.polarizations.len()) as u64;
        observer.event(Event::Phase { name: "simulating", total: total_rows.map(|n| n * per_row), unit: "vis" });
        let mut summary = Summary::default();
        for coverage in rows {
            let coverage = coverage?;
            let step = self.rows_in_a_pass();
            let mut start = 0;
            while start < coverage.n_rows() {
                ensure!(!observer.cancelled(), ChainError::Cancelled);
                let end = (start + step).min(coverage.n_rows());
                let block = self.block(coverage.rows(start..end)?, summary.rows, observer)?;
                sink.write_block(&block)?;
                summary.rows += (end - start) as u64;
                summary.visibilities += block.vis.len() as u64;
                summary.flagged += block.flags.iter().filter(|f| **f).count() as u64;
                observer.event(Event::Advance(block.vis.len() as u64));
                start = end;
            }
        }
        observer.event(Event::Done);
        if summary.flagged > 0 {
            observer.event(Event::Warning(&format!(
                "{} of {} visibilities lie outside the Fourier grid of the scene and are flagged: use smaller cells",
                summary.flagged, summary.visibilities
            )));
        }
        Ok(summary)
    }

    fn rows_in_a_pass(&self) -> usize {
        let values: usize =
            self.freq_hz.iter().map(Vec::len).sum::<usize>() + 2 * self.header.spectrum.n_chan() * self.header.polarizations.len();
        (self.memory.simulated_block() / (16 * values)).max(1)
    }

    /// Simulate the rows of one block. `first_row` is the index of its first row in the set.
    ///
    /// # Errors
    /// A row has an antenna or a phase centre that the header does not have, or noise is requested and an integration time is not positive.
    pub fn block(&mut self, coverage: UvCoverage, first_row: u64, observer: &dyn Observer) -> Result<VisibilityBlock> {
        self.check_rows(&coverage, observer)?;
        let (n_rows, n_chan, n_pol) = self.header.shape(coverage.n_rows());
        let mut sum = Array3::<Complex64>::zeros((n_rows, n_chan, n_pol));
        let mut outside = Array2::from_elem((n_rows, n_chan), false);
        if let Some(near) = &self.near {
            near.add_to(&coverage, &mut sum);
        } else {
            for k in 0..self.planes.len() {
                self.add_plane(k, coverage.uvw_m.view(), &mut sum, &mut outside)?;
            }
            if !self.sky.sources.is_empty() {
                self.add_sources(&coverage, &mut sum);
            }
            self.turn_to_focus(&coverage, &mut sum);
        }
        if sum.iter().any(|v| !(v.re.abs() <= LARGEST && v.im.abs() <= LARGEST)) {
            let text = format!(
                "the scene has visibilities above {LARGEST:e} {}, which imaging does not use: its fluxes or temperatures are wrong",
                self.header.unit.name()
            );
            return Err(ChainError::Incompatible(text));
        }
        let mut block = VisibilityBlock::zeros(coverage, n_chan, n_pol);
        block.vis.assign(&sum.mapv(|v| Complex::new(v.re as f32, v.im as f32)));
        if let Some(noise) = &self.noise {
            noise.apply(&mut block, first_row)?;
        }
        for ((row, chan), _) in outside.indexed_iter().filter(|(_, o)| **o) {
            block.flags.slice_mut(s![row, chan, ..]).fill(true);
            block.weights.slice_mut(s![row, chan, ..]).fill(0.0);
            block.vis.slice_mut(s![row, chan, ..]).fill(Complex::new(0.0, 0.0));
        }
        Ok(block)
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

    fn add_plane(&mut self, k: usize, uvw: ArrayView2<'_, f64>, sum: &mut Array3<Complex64>, outside: &mut Array2<bool>) -> Result<()> {
        let mut transform = match self.planes[k].ready.take() {
            Some(t) => t,
            None => {
                let t = self.transform(k)?;
                self.kept_bytes += t.bytes();
                t
            }
        };
        let before = transform.bytes();
        let plane = &self.planes[k];
        let image = &self.sky.images[plane.image];
        let freqs: Vec<f64> = plane.chans.iter().flat_map(|c| self.freq_hz[*c].iter().copied()).collect();
        let sub = self.options.subchannels;
        let vis = match &mut transform {
            Transform::Exact { plane } => Some(image_dft(&image.grid, plane.view(), uvw, &freqs, !self.options.no_w)?),
            Transform::Degrid(degridder) => Some(degridder.predict(uvw)?),
            Transform::Mask(mask) => Some(mask.predict(uvw, &freqs, |row, f| outside[[row, plane.chans[f / sub]]] = true)),
            Transform::Empty => None,
        };
        if let Some(vis) = vis {
            let terms = products(image.polarizations[plane.pol], &self.header.polarizations);
            for (i, chan) in plane.chans.iter().enumerate() {
                let factor: Vec<f64> =
                    self.freq_hz[*chan].iter().map(|f| unit_factor(image.unit, self.header.unit, *f) / sub as f64).collect();
                for (mut out, vis) in sum.slice_mut(s![.., *chan, ..]).axis_iter_mut(Axis(0)).zip(vis.axis_iter(Axis(0))) {
                    let mean: Complex64 = factor.iter().enumerate().map(|(j, f)| vis[i * sub + j] * *f).sum();
                    for (pol, coefficient) in &terms {
                        out[*pol] += mean * coefficient;
                    }
                }
            }
        }
        // The degridder grows with the range of w of the rows.
        self.kept_bytes += transform.bytes() - before;
        // A transform that does not fit into the budget is made again for every block.
        if self.kept_bytes <= self.memory.kept_scenes() {
            self.planes[k].ready = Some(transform);
        } else {
            self.kept_bytes -= transform.bytes();
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
        let seen = apparent_plane(image, (plane.image_chan, plane.pol), &self.pattern, freq, pedestal, self.options.one_over_n);
        if seen.iter().all(|v| *v == 0.0) && self.options.method != Method::Mask {
            return Ok(Transform::Empty);
        }
        Ok(match self.options.method {
            Method::Dft => Transform::Exact { plane: seen },
            Method::Degrid => {
                let freqs = plane.chans.iter().flat_map(|c| self.freq_hz[*c].iter().copied()).collect();
                let accuracy = (self.options.epsilon, !self.options.no_w);
                Transform::Degrid(Box::new(DegridPlane::new(&image.grid, seen, freqs, accuracy, self.n_vis)))
            }
            Method::Mask => Transform::Mask(MaskPlane::new(&image.grid, &seen)?),
        })
    }

    fn add_sources(&self, coverage: &UvCoverage, sum: &mut Array3<Complex64>) {
        let (unit, pattern, sub) = (self.header.unit, &self.pattern, self.options.subchannels);
        let freqs: Vec<f64> = self.freq_hz.iter().flatten().copied().collect();
        let terms = products(Polarization::I, &self.header.polarizations);
        // In method mask the sources are sampled like the image: at the centre of the cell and without w.
        let snap = (self.options.method == Method::Mask).then(|| &self.sky.images[0].grid);
        for (center, sources) in self.sources.iter().enumerate() {
            let rows: Vec<usize> = (0..coverage.n_rows()).filter(|r| usize::from(coverage.phase_center[*r]) == center).collect();
            let uvw = coverage.uvw_m.select(Axis(0), &rows);
            let amplitude = |s: &Seen, f: f64| s.source.flux_at(f) * from_jy(unit, f) * pattern.power(s.l, s.m, f);
            let vis = match snap {
                None => sources_dft(sources, uvw.view(), &freqs, !self.options.no_w, amplitude),
                Some(grid) => snapped_sources(grid, sources, uvw.view(), &freqs, amplitude),
            };
            for (row, vis) in rows.iter().zip(vis.axis_iter(Axis(0))) {
                for chan in 0..self.freq_hz.len() {
                    let mean = vis.slice(s![chan * sub..(chan + 1) * sub]).sum() / sub as f64;
                    for (pol, coefficient) in &terms {
                        sum[[*row, chan, *pol]] += mean * coefficient;
                    }
                }
            }
        }
    }
}

/// Visibilities of sources at the centres of the cells of the Fourier grid. The cells differ from channel to channel.
fn snapped_sources(
    grid: &SkyGrid,
    sources: &[Seen],
    uvw: ArrayView2<'_, f64>,
    freqs: &[f64],
    amplitude: impl Fn(&Seen, f64) -> f64 + Sync,
) -> Array2<Complex64> {
    let mut vis = Array2::zeros((uvw.nrows(), freqs.len()));
    for (c, freq) in freqs.iter().enumerate() {
        let cells = [1.0 / (grid.n_l as f64 * grid.cell_rad), 1.0 / (grid.n_m as f64 * grid.cell_rad)];
        let per_metre = freq / SPEED_OF_LIGHT_M_S;
        let snapped = Array2::from_shape_fn((uvw.nrows(), 3), |(row, axis)| match axis {
            2 => 0.0,
            axis => (uvw[[row, axis]] * per_metre / cells[axis]).round() * cells[axis] / per_metre,
        });
        vis.slice_mut(s![.., c..=c]).assign(&sources_dft(sources, snapped.view(), &[*freq], false, &amplitude));
    }
    vis
}

fn warn_beyond_horizon(image: &Image, observer: &dyn Observer) {
    let grid = &image.grid;
    let hidden =
        image.data.indexed_iter().filter(|((_, _, r, c), v)| **v != 0.0 && n_minus_1(grid.l_at(*c as f64), grid.m_at(*r as f64)).is_none());
    let count = hidden.count();
    if count > 0 {
        observer.event(Event::Warning(&format!(
            "{count} pixels of scene {:?} lie behind the horizon (l^2 + m^2 > 1) and do not contribute",
            image.object
        )));
    }
}

/// The products of the set to which a Stokes plane contributes, with their coefficients.
pub(super) fn products(scene: Polarization, set: &[Polarization]) -> Vec<(usize, Complex64)> {
    set.iter().enumerate().map(|(k, p)| (k, stokes_coefficient(scene, *p))).filter(|(_, c)| *c != Complex64::ZERO).collect()
}

/// The planes of the images, with the channels that use each of them. There is one plane for each different pattern.
fn list_planes(header: &VisibilityHeader, sky: &SkyModel, pattern: &ElementPattern) -> Vec<Plane> {
    let mut planes = Vec::new();
    for (index, image) in sky.images.iter().enumerate() {
        let nearest = nearest_channels(&image.spectrum, &header.spectrum);
        for (pol, name) in image.polarizations.iter().enumerate() {
            if products(*name, &header.polarizations).is_empty() {
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

/// Simulate a whole set in memory.
///
/// # Errors
/// As [`Simulator::new`] and [`Simulator::run`].
pub fn simulate_set(
    header: VisibilityHeader,
    coverage: &UvCoverage,
    sky: &SkyModel,
    options: &SimulateOptions,
    observer: &dyn Observer,
) -> Result<VisibilitySet> {
    let mut simulator = Simulator::new(header, sky, options, observer)?;
    let header = simulator.header().clone();
    let empty = VisibilityBlock::zeros(UvCoverage::empty(), header.spectrum.n_chan(), header.polarizations.len());
    let mut set = VisibilitySet::new(header, empty)?;
    simulator.run(&mut std::iter::once(Ok(coverage.clone())), Some(coverage.n_rows() as u64), &mut set, observer)?;
    Ok(set)
}
