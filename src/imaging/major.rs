//! Major cycles: a minor cycle on the image, followed by the exact residual from the visibilities.
//!
//! A minor cycle works on an approximate residual. It stops before the errors of the approximation become visible: at (1 - mgain) times the
//! peak, or at `cyclefactor` times the largest side lobe of the beam times the peak, within limits. The run stops at a threshold, at a multiple
//! of the noise, when all iterations are used, or when the residual grows. In the last case the best state is kept. The reason is always
//! reported.
//!
//! # Reference
//! Schwab 1984, AJ 89, 1076 (Cotton-Schwab).

use super::auto_mask::AutoMask;
use super::cleaned::{Channel, Cleaned};
use super::clock::Clock;
use super::continued::{Continue, Tool, Tools};
use super::imager::{Imager, Residual};
use super::trust::Trust;
use crate::deconvolve::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, peak_size};
use crate::fidelity::robust_rms;
use crate::memory::{ImageWork, check_images};
use crate::progress::{Event, Observer};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::VisUnit;
use ndarray::Array2;

pub use super::cleaned::{CleanProducts, CleanStatistics, StopReason};
pub use super::components::CleanComponent;
pub use crate::deconvolve::CleanOptions;

/// Clean all output channels of an imager.
///
/// # Errors
/// An option is out of range, the mask has another shape than the image, no Gaussian fits the beam, or the source fails.
pub fn clean(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<CleanProducts> {
    clean_from(imager, opts, &mut None, Continue::default(), observer)
}

/// As [`clean`], but starting from an earlier model. `tools` are kept for the next call. They are made if there are none, or if the data have
/// other weights than before. The products contain only the components of this run.
///
/// # Errors
/// As [`clean`]; also if a model has another shape than the image.
pub fn clean_from(
    imager: &mut Imager<'_>,
    opts: &CleanOptions,
    tools: &mut Option<Tools>,
    from: Continue<'_>,
    observer: &dyn Observer,
) -> Result<CleanProducts> {
    let (channels, clock) = channels_from(imager, opts, tools, from, observer)?;
    CleanProducts::of(Cleaned { channels, clock }, imager)
}

/// [`clean`] up to the last residual. Its images are made one after the other by [`Cleaned::deliver`].
///
/// # Errors
/// As [`clean`].
pub(crate) fn cleaned(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<Cleaned> {
    let (channels, clock) = channels_from(imager, opts, &mut None, Continue::default(), observer)?;
    Ok(Cleaned { channels, clock })
}

fn channels_from(
    imager: &mut Imager<'_>,
    opts: &CleanOptions,
    tools: &mut Option<Tools>,
    from: Continue<'_>,
    observer: &dyn Observer,
) -> Result<(Vec<Channel>, Clock)> {
    check(imager, opts)?;
    let mut clock = Clock::default();
    let n = imager.channels().len();
    if !from.models.is_empty() && (from.models.len() != n || from.models.iter().any(|m| m.dim() != (imager.grid().n_m, imager.grid().n_l)))
    {
        return Err(ChainError::Incompatible("the model to continue from has another shape than the image".into()));
    }
    let tools = match tools {
        Some(made) if made.fit(imager) => made,
        other => other.insert(clock.time("psf", || Tools::new(imager, opts, observer))?),
    };
    let channels = tools.all.iter_mut().enumerate();
    let channels = channels.map(|(k, tool)| clean_channel((imager, k), opts, (tool, from), (observer, &mut clock)));
    Ok((channels.collect::<Result<Vec<_>>>()?, clock))
}

fn check(imager: &Imager<'_>, o: &CleanOptions) -> Result<()> {
    o.check()?;
    check_images((imager.grid().n_l, imager.grid().n_m), ImageWork::Clean)?;
    let level = threshold(imager, o)?;
    need("threshold", level, level >= 0.0 && level.is_finite(), "a level of 0 or more")?;
    let loaded = o.region.is_some() || (o.mask.is_none() && o.boxes.is_empty());
    ensure!(loaded, ChainError::Incompatible("the mask and the boxes of CLEAN must be loaded for the grid of the image first".into()));
    let shape = (imager.grid().n_m, imager.grid().n_l);
    let mask = o.region.as_ref().map_or(shape, Array2::dim);
    need("mask", format!("{mask:?}"), mask == shape, format!("a mask of the shape of the image, {shape:?}"))
}

/// The threshold in the unit of the images; 0 if there is none.
fn threshold(imager: &Imager<'_>, opts: &CleanOptions) -> Result<f64> {
    opts.threshold.map_or(Ok(0.0), |level| level.in_unit("threshold", imager.header().unit))
}

fn clean_channel(
    (imager, k): (&mut Imager<'_>, usize),
    opts: &CleanOptions,
    (tool, from): (&mut Tool, Continue<'_>),
    (observer, clock): (&dyn Observer, &mut Clock),
) -> Result<Channel> {
    let dirty = clock.time("dirty", || imager.dirty_in::<f32>(k, observer))?;
    let kelvin = imager.header().unit == VisUnit::KelvinSr;
    let start = from.models.get(k);
    let run = Run {
        opts,
        side_lobe: tool.side_lobe,
        threshold: threshold(imager, opts)? * if kelvin { tool.beam.solid_angle_sr() } else { 1.0 },
        beam_px: tool.beam.bmaj_rad / imager.grid().cell_rad,
        start,
        from,
    };
    let mut state = Channel {
        model: Array2::zeros((0, 0)),
        residual: Residual { image: dirty.clone(), chi2_per_datum: f64::NAN },
        components: Vec::new(),
        given_back: Vec::new(),
        stop: StopReason::MajorCycles,
        major: 0,
        psf: tool.psf.clone(),
        beam: tool.beam,
        dirty,
    };
    let deconvolver = &mut *tool.deconvolver;
    if start.is_some() && !from.subtracted {
        clock.time("major", || run.renew((imager, k), &*deconvolver, &mut state, observer))?;
    }
    run.cycles(imager, k, deconvolver, &mut state, (observer, clock))?;
    if state.residual.chi2_per_datum.is_nan() && from.exact {
        clock.time("major", || run.renew((imager, k), &*deconvolver, &mut state, observer))?;
    }
    state.model = run.lifted(&*deconvolver, &mut state);
    Ok(state)
}

/// The state with the lowest peak, as the number of its components and of the corrections to the floor. Its model and its residual are made
/// from them again, because copies of images that are hardly ever needed would take much memory.
#[derive(Clone, Copy)]
struct Best {
    components: usize,
    given_back: usize,
}

impl Best {
    fn of(state: &Channel) -> Self {
        Self { components: state.components.len(), given_back: state.given_back.len() }
    }

    fn restore(self, state: &mut Channel) {
        state.components.truncate(self.components);
        state.given_back.truncate(self.given_back);
    }
}

/// A minor cycle follows another without the visibilities between them if it can lower the peak to this fraction.
const WORTH: f64 = 0.5;

/// What a residual tells about itself: its noise, and its peak within the mask.
#[derive(Clone, Copy)]
struct Sight {
    rms: f64,
    peak: f64,
}

/// The major cycles of one output channel.
struct Run<'a> {
    opts: &'a CleanOptions,
    side_lobe: f64,
    threshold: f64,
    beam_px: f64,
    /// The model to begin with.
    start: Option<&'a Array2<f64>>,
    from: Continue<'a>,
}

impl Run<'_> {
    /// The model, from the components. It is made where it is needed, and not kept.
    fn model(&self, deconvolver: &dyn Deconvolver, state: &Channel) -> Array2<f64> {
        let mut model = self.start.cloned().unwrap_or_else(|| Array2::zeros(state.dirty.dim()));
        deconvolver.draw(&state.components, &mut model);
        state.given_back.iter().for_each(|c| model[(c.row, c.column)] += c.flux);
        model
    }

    /// Raise the model to its floor, and make its exact residual.
    fn renew(
        &self,
        (imager, k): (&mut Imager<'_>, usize),
        deconvolver: &dyn Deconvolver,
        state: &mut Channel,
        observer: &dyn Observer,
    ) -> Result<()> {
        let mut model = self.lifted(deconvolver, state);
        // The new residual replaces the old one, which is not needed for it.
        state.residual.image = Array2::zeros((0, 0));
        if let Some(taken) = self.start.filter(|_| self.from.subtracted) {
            model -= taken;
        }
        state.residual = imager.residual_in(k, model.into(), observer)?;
        Ok(())
    }

    /// The model, raised to its floor. What was added is noted.
    fn lifted(&self, deconvolver: &dyn Deconvolver, state: &mut Channel) -> Array2<f64> {
        let mut model = self.model(deconvolver, state);
        if let Some(floor) = self.from.floor {
            for ((row, column), v) in model.indexed_iter_mut().filter(|(_, v)| **v < floor) {
                state.given_back.push(Component::point(row, column, floor - *v));
                *v = floor;
            }
        }
        model
    }

    fn cycles(
        &self,
        imager: &mut Imager<'_>,
        k: usize,
        deconvolver: &mut dyn Deconvolver,
        state: &mut Channel,
        (observer, clock): (&dyn Observer, &mut Clock),
    ) -> Result<()> {
        let o = self.opts;
        let mut auto = o.auto_mask.map(|sigmas| AutoMask::new(state.dirty.dim(), sigmas, self.beam_px, !o.no_negative, &o.tuning));
        let mut trust = Trust::new(state.psf.view(), self.beam_px, &o.tuning);
        let start_flux = self.start.map_or(0.0, |m| m.sum());
        let mut best = Best::of(state);
        let mut least = f64::INFINITY;
        loop {
            let Sight { rms, peak } = self.look(&state.residual.image, auto.as_mut());
            let (number, iterations) = (state.major, state.components.len());
            let flux = start_flux + state.components.iter().chain(&state.given_back).map(|c| c.flux).sum::<f64>();
            observer.event(Event::Cycle { number: number + 1, iterations, peak, flux, rms });
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            // The peak is much higher than in the best state: the cycles since then have made the model worse.
            if number > 0 && !(peak <= o.tuning.major_divergence * least) {
                best.restore(state);
                clock.time("major", || self.renew((imager, k), &*deconvolver, state, observer))?;
                return self.stop(state, StopReason::Diverged, observer);
            }
            if peak < least {
                least = peak;
                if number > 0 {
                    best = Best::of(state);
                }
            }
            if let Some(reason) = self.reason(peak, self.threshold.max(o.nsigma * rms), state) {
                return self.stop(state, reason, observer);
            }
            let stop = clock.time("minor", || self.descend(deconvolver, state, auto.as_ref(), (Sight { rms, peak }, &mut trust)))?;
            state.major += 1;
            if !self.from.exact && state.major >= o.max_major {
                state.residual.chi2_per_datum = f64::NAN;
                return self.stop(state, StopReason::MajorCycles, observer);
            }
            clock.time("major", || self.renew((imager, k), &*deconvolver, state, observer))?;
            trust.measure(&state.residual.image);
            if state.components.len() == iterations {
                let reason = if stop == MinorStop::Diverged { StopReason::Diverged } else { StopReason::Nothing };
                return self.stop(state, reason, observer);
            }
        }
    }

    /// Measure a residual, and let an automatic mask grow.
    fn look(&self, residual: &Array2<f32>, mut auto: Option<&mut AutoMask>) -> Sight {
        let o = self.opts;
        let rms = robust_rms(residual.view());
        if let Some(auto) = &mut auto {
            let top = peak_size(residual.view(), o.region.as_ref(), !o.no_negative);
            // The side lobes of the sources in the residual are above the noise too, but they are not sources.
            let level = (auto.sigmas * rms).max(o.tuning.side_lobe_margin * self.side_lobe * top);
            auto.grow(residual, level, o.region.as_ref());
        }
        let mask = auto.as_ref().map(|a| &a.mask).or(o.region.as_ref());
        Sight { rms, peak: peak_size(residual.view(), mask, !o.no_negative) }
    }

    /// Lower the residual by minor cycles, the first one from an exact residual, as far as its error allows. Says why the last one stopped.
    fn descend(
        &self,
        deconvolver: &mut dyn Deconvolver,
        state: &mut Channel,
        auto: Option<&AutoMask>,
        (mut sight, trust): (Sight, &mut Trust),
    ) -> Result<MinorStop> {
        let o = self.opts;
        let first = state.components.len();
        let part = (o.cyclefactor * self.side_lobe).clamp(o.psf_fraction.0, o.psf_fraction.1).max(1.0 - o.mgain);
        // An automatic mask must grow before CLEAN goes deeper: what is not in it yet has side lobes in it. A floor changes the model after the
        // cycle, and a short update has no exact residual to learn from.
        let may_go_on = auto.is_none() && self.from.floor.is_none() && self.from.exact;
        let mut trusted = 0.0;
        loop {
            let lowest = self.threshold.max(o.nsigma * sight.rms).max(trusted);
            let limits = MinorLimits {
                gain: o.gain,
                level: lowest.max(part * sight.peak),
                iterations: o.niter - state.components.len(),
                negative: !o.no_negative,
            };
            let mask = auto.map(|a| &a.mask).or(o.region.as_ref());
            let MinorReport { stop, components } = deconvolver.minor(Minor { residual: &mut state.residual.image, mask, limits })?;
            let whole = stop == MinorStop::Level && !components.is_empty();
            state.components.extend(components);
            if !may_go_on {
                return Ok(stop);
            }
            let norm = trust.norm(&*deconvolver, &state.components[first..], state.dirty.dim());
            if let Some(level) = trust.level(norm).filter(|_| whole && state.components.len() < o.niter) {
                sight = self.look(&state.residual.image, None);
                trusted = level;
                if self.threshold.max(o.nsigma * sight.rms).max(trusted) <= WORTH * sight.peak {
                    continue;
                }
            }
            trust.expect(&state.residual.image, norm);
            return Ok(stop);
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
}
