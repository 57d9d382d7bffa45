//! Major cycles: minor cycles on the image, then the residual anew from the visibilities.
//!
//! A minor cycle stops where its approximations would begin to show: at (1 - mgain) of the peak, and not below the side lobes of the beam
//! times `cyclefactor`, within limits. The run stops at a threshold, at a multiple of the noise, when the iterations are used up, or when the
//! residual grows; the best state is kept, and the reason is always said.
//!
//! # Reference
//! Schwab 1984, AJ 89, 1076 (Cotton-Schwab).

use super::components::merged;
use super::continued::{Continue, Tool, Tools};
use super::output::Kind;
use super::restore::with_beam;
use super::{Imager, Residual};
use crate::deconvolve::{Component, Minor, MinorLimits, MinorReport, MinorStop, peak_of};
use crate::fidelity::robust_rms;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{Image, RestoringBeam, VisUnit};
use ndarray::Array2;
use std::collections::BTreeMap;
use std::time::Instant;

pub use super::components::CleanComponent;
pub use crate::deconvolve::CleanOptions;

/// Times the largest side lobe of the brightest residual below which a mask that makes itself does not grow.
const SIDE_LOBES: f64 = 1.2;

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The peak is at or below the threshold.
    Threshold,
    /// The peak is at or below the multiple of the noise.
    Noise,
    /// All iterations are used.
    Iterations,
    /// The most major cycles were made.
    MajorCycles,
    /// The residual grew; the best state was kept.
    Diverged,
    /// The residual stopped coming down.
    Stalled,
    /// Nothing is left that a component could take.
    Nothing,
}

impl StopReason {
    /// A short name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Threshold => "threshold",
            Self::Noise => "nsigma",
            Self::Iterations => "niter",
            Self::MajorCycles => "major cycles",
            Self::Diverged => "diverged",
            Self::Stalled => "stalled",
            Self::Nothing => "nothing left",
        }
    }
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub struct CleanStatistics {
    /// Why each output channel stopped.
    pub stop: Vec<StopReason>,
    /// Components in all output channels.
    pub iterations: usize,
    /// Major cycles in all output channels.
    pub major_cycles: usize,
    /// Rms of the residual, in the unit of the residual image.
    pub residual_rms: f64,
    /// Largest absolute residual.
    pub residual_peak: f64,
    /// Sum of the model over pixels and the mean over output channels: Jy, or K sr.
    pub model_flux: f64,
    /// Largest value of the restored image over the rms of the residual.
    pub dynamic_range: f64,
    /// Chi squared over the real numbers measured, mean over output channels.
    pub chi2_per_datum: f64,
    /// Wall-clock seconds by stage.
    pub seconds: BTreeMap<&'static str, f64>,
}

/// Images and facts of a run.
#[derive(Debug, Clone)]
pub struct CleanProducts {
    /// Dirty beam.
    pub psf: Image,
    /// Dirty image.
    pub dirty: Image,
    /// Model, flux a pixel or kelvin.
    pub model: Image,
    /// Residual.
    pub residual: Image,
    /// Model seen with the restoring beam, plus the residual.
    pub restored: Image,
    /// Components, merged by place and scale, brightest first.
    pub components: Vec<CleanComponent>,
    /// What happened.
    pub statistics: CleanStatistics,
    /// Restoring beam of each output channel.
    pub beams: Vec<RestoringBeam>,
}

/// Seconds by stage.
#[derive(Default)]
struct Clock(BTreeMap<&'static str, f64>);

impl Clock {
    fn time<R>(&mut self, stage: &'static str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        *self.0.entry(stage).or_default() += start.elapsed().as_secs_f64();
        result
    }
}

/// One output channel on its way.
struct Channel {
    psf: Array2<f64>,
    beam: RestoringBeam,
    dirty: Array2<f64>,
    model: Array2<f64>,
    residual: Residual,
    components: Vec<Component>,
    /// Given back where the model had come below its floor \[m, l\].
    given_back: Array2<f64>,
    stop: StopReason,
    major: usize,
}

/// Clean all output channels of an imager.
///
/// # Errors
/// Options out of range, a mask of another shape, a beam that no Gaussian fits, whatever the source says.
pub fn clean(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<CleanProducts> {
    clean_from(imager, opts, &mut None, Continue::default(), observer)
}

/// As [`clean`], from an earlier model. `tools` are made where there are none or where they no longer fit, and stay for the next time.
/// The components of the products are those of this run alone.
///
/// # Errors
/// As [`clean`]; models of another shape than the image's.
pub fn clean_from(
    imager: &mut Imager<'_>,
    opts: &CleanOptions,
    tools: &mut Option<Tools>,
    from: Continue<'_>,
    observer: &dyn Observer,
) -> Result<CleanProducts> {
    check(imager, opts)?;
    let mut clock = Clock::default();
    let n = imager.channels().len();
    if !from.models.is_empty() && (from.models.len() != n || from.models.iter().any(|m| m.dim() != (imager.grid().n_m, imager.grid().n_l)))
    {
        return Err(ChainError::Incompatible("the model to go on from has another shape than the image".into()));
    }
    let tools = match tools {
        Some(made) if made.fit(imager) => made,
        other => other.insert(clock.time("psf", || Tools::new(imager, opts, observer))?),
    };
    let channels = tools.all.iter_mut().enumerate();
    let channels = channels.map(|(k, tool)| clean_channel((imager, k), opts, (tool, from), (observer, &mut clock)));
    let channels = channels.collect::<Result<Vec<_>>>()?;
    products(imager, channels, clock)
}

fn check(imager: &Imager<'_>, o: &CleanOptions) -> Result<()> {
    let bad = |option, value: String, expected: &str| Err(ChainError::BadOption { option, value, expected: expected.into() });
    if !(o.gain > 0.0 && o.gain <= 1.0) {
        return bad("gain", o.gain.to_string(), "above 0, at most 1");
    }
    if !(o.mgain > 0.0 && o.mgain <= 1.0) {
        return bad("mgain", o.mgain.to_string(), "above 0, at most 1");
    }
    for (option, value) in [("threshold", threshold(imager, o)?), ("nsigma", o.nsigma), ("cyclefactor", o.cyclefactor)] {
        if !(value >= 0.0 && value.is_finite()) {
            return bad(option, value.to_string(), "a number of 0 or more");
        }
    }
    if let Some(a) = o.auto_mask
        && !(a > 0.0 && a.is_finite())
    {
        return bad("auto-mask", a.to_string(), "a positive multiple of the noise");
    }
    let shape = (imager.grid().n_m, imager.grid().n_l);
    if let Some(mask) = &o.region
        && mask.dim() != shape
    {
        return bad("mask", format!("{:?}", mask.dim()), &format!("a mask of the shape of the image, {shape:?}"));
    }
    Ok(())
}

/// The threshold in the unit of the images; 0 where none is given.
fn threshold(imager: &Imager<'_>, opts: &CleanOptions) -> Result<f64> {
    opts.threshold.map_or(Ok(0.0), |level| level.in_unit("threshold", imager.header().unit))
}

fn clean_channel(
    (imager, k): (&mut Imager<'_>, usize),
    opts: &CleanOptions,
    (tool, from): (&mut Tool, Continue<'_>),
    (observer, clock): (&dyn Observer, &mut Clock),
) -> Result<Channel> {
    let dirty = clock.time("dirty", || imager.dirty(k, observer))?;
    let kelvin = imager.header().unit == VisUnit::KelvinSr;
    let start = from.models.get(k);
    let run = Run {
        opts,
        side_lobe: tool.side_lobe,
        threshold: threshold(imager, opts)? * if kelvin { tool.beam.solid_angle_sr() } else { 1.0 },
        beam_px: tool.beam.bmaj_rad / imager.grid().cell_rad,
        taken: start.filter(|_| from.subtracted),
        from,
    };
    let mut state = Channel {
        model: start.cloned().unwrap_or_else(|| Array2::zeros(dirty.dim())),
        residual: Residual { image: dirty.clone(), chi2_per_datum: f64::NAN },
        components: Vec::new(),
        given_back: Array2::zeros(dirty.dim()),
        stop: StopReason::MajorCycles,
        major: 0,
        psf: tool.psf.clone(),
        beam: tool.beam,
        dirty,
    };
    if start.is_some() && !from.subtracted {
        state.residual = clock.time("major", || run.residual(imager, k, &state.model, observer))?;
    }
    run.cycles(imager, k, &mut *tool.deconvolver, &mut state, (observer, clock))?;
    if state.residual.chi2_per_datum.is_nan() && from.exact {
        state.residual = clock.time("major", || run.residual(imager, k, &state.model, observer))?;
    }
    Ok(state)
}

/// Largest absolute value of the beam outside its main lobe.
pub(super) fn side_lobe(imager: &Imager<'_>, psf: &Array2<f64>, beam: &RestoringBeam) -> f64 {
    let grid = imager.grid();
    let (sin, cos) = beam.bpa_rad.sin_cos();
    let outside = |i: usize, j: usize| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        // The first null of a lobe lies near one width from its centre.
        ((l * sin + m * cos) / beam.bmaj_rad).powi(2) + ((l * cos - m * sin) / beam.bmin_rad).powi(2) > 1.2
    };
    psf.indexed_iter().filter(|((i, j), _)| outside(*i, *j)).map(|(_, v)| v.abs()).fold(0.0, f64::max)
}

struct Run<'a> {
    opts: &'a CleanOptions,
    side_lobe: f64,
    threshold: f64,
    beam_px: f64,
    /// Part of the model that is not in the data any more.
    taken: Option<&'a Array2<f64>>,
    from: Continue<'a>,
}

impl Run<'_> {
    fn residual(&self, imager: &mut Imager<'_>, k: usize, model: &Array2<f64>, observer: &dyn Observer) -> Result<Residual> {
        match self.taken {
            Some(taken) => imager.residual(k, (model - taken).view(), observer),
            None => imager.residual(k, model.view(), observer),
        }
    }

    /// Bring the model up to its floor.
    fn lift(&self, state: &mut Channel) {
        let Some(floor) = self.from.floor else { return };
        for (value, back) in state.model.iter_mut().zip(&mut state.given_back).filter(|(v, _)| **v < floor) {
            *back += floor - *value;
            *value = floor;
        }
    }

    fn cycles(
        &self,
        imager: &mut Imager<'_>,
        k: usize,
        deconvolver: &mut dyn crate::deconvolve::Deconvolver,
        state: &mut Channel,
        (observer, clock): (&dyn Observer, &mut Clock),
    ) -> Result<()> {
        let o = self.opts;
        let mut auto = o.auto_mask.map(|_| Array2::from_elem(state.dirty.dim(), false));
        let mut least = f64::INFINITY;
        let mut best: Option<(Array2<f64>, Residual, usize, Array2<f64>)> = None;
        loop {
            let rms = robust_rms(state.residual.image.view());
            if let (Some(mask), Some(sigmas)) = (&mut auto, o.auto_mask) {
                let top = peak_of(state.residual.image.view(), o.region.as_ref(), !o.no_negative).map_or(0.0, |p| p.0.abs());
                // The side lobes of what is still there stand above the noise too, and are no source.
                self.grow(mask, &state.residual.image, (sigmas * rms).max(SIDE_LOBES * self.side_lobe * top));
                if let Some(fixed) = &o.region {
                    ndarray::Zip::from(mask).and(fixed).for_each(|m, f| *m &= *f);
                }
            }
            let mask = auto.as_ref().or(o.region.as_ref());
            let peak = peak_of(state.residual.image.view(), mask, !o.no_negative).map_or(0.0, |p| p.0.abs());
            let (number, iterations) = (state.major, state.components.len());
            observer.event(Event::Cycle { number: number + 1, iterations, peak, flux: state.model.sum(), rms });
            if observer.cancelled() {
                return Err(ChainError::Cancelled);
            }
            // Grown by a factor over the best: what was done since does harm.
            if number > 0 && !(peak <= 1.5 * least) {
                if let Some((model, residual, n, given_back)) = best.take() {
                    (state.model, state.residual, state.given_back) = (model, residual, given_back);
                    state.components.truncate(n);
                }
                return self.stop(state, StopReason::Diverged, observer);
            }
            if peak < least {
                least = peak;
                match &mut best {
                    Some((model, residual, n, given_back)) => {
                        model.assign(&state.model);
                        residual.image.assign(&state.residual.image);
                        given_back.assign(&state.given_back);
                        (residual.chi2_per_datum, *n) = (state.residual.chi2_per_datum, iterations);
                    }
                    None => best = Some((state.model.clone(), state.residual.clone(), iterations, state.given_back.clone())),
                }
            }
            let level = self.threshold.max(o.nsigma * rms);
            if let Some(reason) = self.reason(peak, level, state) {
                return self.stop(state, reason, observer);
            }
            let part = (o.cyclefactor * self.side_lobe).clamp(o.psf_fraction.0, o.psf_fraction.1.max(o.psf_fraction.0)).max(1.0 - o.mgain);
            let limits =
                MinorLimits { gain: o.gain, level: level.max(part * peak), iterations: o.niter - iterations, negative: !o.no_negative };
            let Channel { residual, model, .. } = state;
            let cycle = Minor { residual: &mut residual.image, model, mask, limits };
            let report: MinorReport = clock.time("minor", || deconvolver.minor(cycle))?;
            state.major += 1;
            let took = report.iterations;
            state.components.extend(report.components);
            self.lift(state);
            if !self.from.exact && state.major >= o.max_major {
                state.residual.chi2_per_datum = f64::NAN;
                return self.stop(state, StopReason::MajorCycles, observer);
            }
            state.residual = clock.time("major", || self.residual(imager, k, &state.model, observer))?;
            if took == 0 {
                let reason = if report.stop == MinorStop::Diverged { StopReason::Diverged } else { StopReason::Nothing };
                return self.stop(state, reason, observer);
            }
        }
    }

    fn reason(&self, peak: f64, level: f64, state: &Channel) -> Option<StopReason> {
        if peak == 0.0 {
            return Some(StopReason::Nothing);
        }
        if peak <= self.threshold {
            return Some(StopReason::Threshold);
        }
        if peak <= level {
            return Some(StopReason::Noise);
        }
        if state.components.len() >= self.opts.niter {
            return Some(StopReason::Iterations);
        }
        (state.major >= self.opts.max_major).then_some(StopReason::MajorCycles)
    }

    fn stop(&self, state: &mut Channel, reason: StopReason, observer: &dyn Observer) -> Result<()> {
        state.stop = reason;
        let (n, m) = (state.components.len(), state.major);
        observer.event(Event::Note(&format!("stopped after {n} components in {m} major cycles: {}", reason.name())));
        Ok(())
    }

    /// Add to the mask what stands above the level, widened by half a main lobe.
    fn grow(&self, mask: &mut Array2<bool>, residual: &Array2<f64>, level: f64) {
        let reach = (0.5 * self.beam_px).ceil().max(1.0) as usize;
        let (n_m, n_l) = residual.dim();
        for ((i, j), v) in residual.indexed_iter() {
            let stands = if !self.opts.no_negative { v.abs() > level } else { *v > level };
            if stands {
                let rows = i.saturating_sub(reach)..(i + reach + 1).min(n_m);
                let columns = j.saturating_sub(reach)..(j + reach + 1).min(n_l);
                mask.slice_mut(ndarray::s![rows, columns]).fill(true);
            }
        }
    }
}

fn products(imager: &Imager<'_>, channels: Vec<Channel>, mut clock: Clock) -> Result<CleanProducts> {
    let grid = imager.grid().clone();
    let beams: Vec<RestoringBeam> = channels.iter().map(|c| c.beam).collect();
    let restored: Vec<Array2<f64>> =
        clock.time("restore", || channels.iter().map(|c| with_beam(&grid, c.model.view(), &c.beam) + &c.residual.image).collect());
    let mut statistics = CleanStatistics {
        stop: channels.iter().map(|c| c.stop).collect(),
        iterations: channels.iter().map(|c| c.components.len()).sum(),
        major_cycles: channels.iter().map(|c| c.major).sum(),
        residual_rms: 0.0,
        residual_peak: 0.0,
        model_flux: channels.iter().map(|c| c.model.sum()).sum::<f64>() / channels.len() as f64,
        dynamic_range: 0.0,
        chi2_per_datum: channels.iter().map(|c| c.residual.chi2_per_datum).sum::<f64>() / channels.len() as f64,
        seconds: clock.0,
    };
    let mut components = Vec::new();
    let (mut psfs, mut dirties, mut models, mut residuals) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (channel, c) in channels.into_iter().enumerate() {
        let back = c.given_back.indexed_iter().filter(|(_, f)| **f != 0.0);
        let back = back.map(|((row, column), flux)| Component { row, column, flux: *flux, scale_px: 0.0 });
        components.extend(merged(&grid, channel, c.components.into_iter().chain(back)));
        psfs.push(c.psf);
        dirties.push(c.dirty);
        models.push(c.model);
        residuals.push(c.residual.image);
    }
    components.sort_by(|a, b| b.flux.abs().total_cmp(&a.flux.abs()));
    let residual = imager.image(residuals, Kind::Residual, &beams)?;
    let restored = imager.image(restored, Kind::Restored, &beams)?;
    statistics.residual_rms = (residual.data.iter().map(|v| v * v).sum::<f64>() / residual.data.len() as f64).sqrt();
    statistics.residual_peak = residual.data.iter().fold(0.0, |a, v| a.max(v.abs()));
    let top = restored.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - restored.pedestal_k.unwrap_or(0.0);
    statistics.dynamic_range = top / statistics.residual_rms.max(f64::MIN_POSITIVE);
    Ok(CleanProducts {
        psf: imager.image(psfs, Kind::Psf, &beams)?,
        dirty: imager.image(dirties, Kind::Dirty, &beams)?,
        model: imager.image(models, Kind::Model, &beams)?,
        residual,
        restored,
        components,
        statistics,
        beams,
    })
}
