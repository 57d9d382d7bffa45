//! One output channel between its dirty image and its last residual.
//!
//! A minor cycle works on an approximate residual. It stops before the errors of the approximation become visible: at (1 - mgain) times the
//! peak, or at `cyclefactor` times the largest side lobe of the beam times the peak, within limits. The run stops at a threshold, at a multiple
//! of the noise, when all iterations are used, or when the residual grows. In the last case the best state is kept. The reason is always
//! reported.

use super::auto_mask::AutoMask;
use super::cleaned::{Channel, StopReason};
use super::clock::Clock;
use super::continued::{Continue, Tool};
use super::imager::{Imager, Residual};
use super::trust::Trust;
use crate::deconvolve::{CleanOptions, Component, Minor, MinorLimits, MinorReport, MinorStop, peak_size};
use crate::fidelity::robust_rms;
use crate::pages::{copied, zeros};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::VisUnit;
use ndarray::Array2;

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

/// What a channel needs besides its own state: the imager, who is told of its cycles, and the clock of their stages.
pub(super) struct With<'c, 's> {
    pub(super) imager: &'c mut Imager<'s>,
    pub(super) observer: &'c dyn Observer,
    pub(super) clock: &'c mut Clock,
}

/// The major cycles of one output channel.
pub(super) struct ChannelRun<'a> {
    /// Number of the channel.
    k: usize,
    opts: &'a CleanOptions,
    tool: &'a mut Tool,
    threshold: f64,
    from: Continue<'a>,
    state: Channel,
    auto: Option<AutoMask>,
    trust: Trust,
    best: Best,
    /// The lowest peak so far.
    least: f64,
    sight: Sight,
}

impl<'a> ChannelRun<'a> {
    /// Begin channel `k` with its dirty image, or with the residual of the model to continue from.
    pub(super) fn begin(
        k: usize,
        opts: &'a CleanOptions,
        (tool, from): (&'a mut Tool, Continue<'a>),
        threshold: f64,
        with: &mut With<'_, '_>,
    ) -> Result<Self> {
        let dirty = with.clock.time("dirty", || with.imager.dirty_in::<f32>(k, with.observer))?;
        let kelvin = with.imager.header().unit == VisUnit::KelvinSr;
        let beam_px = tool.beam.bmaj_rad / with.imager.grid().cell_rad;
        let state = Channel {
            model: Array2::zeros((0, 0)),
            residual: Residual { image: copied(dirty.view()), chi2_per_datum: f64::NAN },
            components: Vec::new(),
            given_back: Vec::new(),
            stop: StopReason::MajorCycles,
            major: 0,
            psf: tool.psf.clone(),
            beam: tool.beam,
            dirty,
        };
        let mut run = Self {
            k,
            opts,
            threshold: threshold * if kelvin { tool.beam.solid_angle_sr() } else { 1.0 },
            from,
            auto: opts.auto_mask.map(|sigmas| AutoMask::new(state.dirty.dim(), sigmas, beam_px, !opts.no_negative, &opts.tuning)),
            trust: Trust::new(state.psf.view(), beam_px, &opts.tuning),
            best: Best::of(&state),
            least: f64::INFINITY,
            sight: Sight { rms: 0.0, peak: 0.0 },
            tool,
            state,
        };
        if run.start().is_some() && !from.subtracted {
            run.renew(with)?;
        }
        Ok(run)
    }

    /// The model to begin with.
    fn start(&self) -> Option<&'a Array2<f64>> {
        self.from.models.get(self.k)
    }

    /// The model, from the components. It is made where it is needed, and not kept.
    fn model(&self) -> Array2<f64> {
        let mut model = self.start().map(|model| copied(model.view())).unwrap_or_else(|| zeros(self.state.dirty.dim()));
        self.tool.deconvolver.draw(&self.state.components, &mut model);
        self.state.given_back.iter().for_each(|c| model[(c.row, c.column)] += c.flux);
        model
    }

    /// Raise the model to its floor, and make its exact residual.
    fn renew(&mut self, with: &mut With<'_, '_>) -> Result<()> {
        with.clock.time("major", || {
            let mut model = self.lifted();
            // The new residual replaces the old one, which is not needed for it.
            self.state.residual.image = Array2::zeros((0, 0));
            if let Some(taken) = self.start().filter(|_| self.from.subtracted) {
                model -= taken;
            }
            self.state.residual = with.imager.residual_in(self.k, model.into(), with.observer)?;
            Ok(())
        })
    }

    /// The model, raised to its floor. What was added is noted.
    fn lifted(&mut self) -> Array2<f64> {
        let mut model = self.model();
        if let Some(floor) = self.from.floor {
            for ((row, column), v) in model.indexed_iter_mut().filter(|(_, v)| **v < floor) {
                self.state.given_back.push(Component::point(row, column, floor - *v));
                *v = floor;
            }
        }
        model
    }

    /// Look at the residual. Gives whether another cycle follows.
    pub(super) fn goes_on(&mut self, with: &mut With<'_, '_>) -> Result<bool> {
        let o = self.opts;
        self.sight = self.look(true);
        let Sight { rms, peak } = self.sight;
        let (number, iterations) = (self.state.major, self.state.components.len());
        let of_components = self.state.components.iter().chain(&self.state.given_back).map(|c| c.flux).sum::<f64>();
        let flux = self.start().map_or(0.0, |m| m.sum()) + of_components;
        let channel = (with.imager.channels().len() > 1).then_some(self.k);
        with.observer.event(Event::Cycle { channel, number: number + 1, iterations, peak, flux, rms });
        ensure!(!with.observer.cancelled(), ChainError::Cancelled);
        // The peak is much higher than in the best state: the cycles since then have made the model worse.
        if number > 0 && !(peak <= o.tuning.major_divergence * self.least) {
            self.best.restore(&mut self.state);
            self.renew(with)?;
            self.stop(StopReason::Diverged, with);
            return Ok(false);
        }
        if peak < self.least {
            self.least = peak;
            if number > 0 {
                self.best = Best::of(&self.state);
            }
        }
        let reason = self.reason(peak, self.threshold.max(o.nsigma * rms));
        reason.inspect(|reason| self.stop(*reason, with));
        Ok(reason.is_none())
    }

    /// Measure the residual, and let an automatic mask grow.
    fn look(&mut self, grow: bool) -> Sight {
        let (o, residual) = (self.opts, &self.state.residual.image);
        let rms = robust_rms(residual.view());
        if let Some(auto) = self.auto.as_mut().filter(|_| grow) {
            let top = peak_size(residual.view(), o.region.as_ref(), !o.no_negative);
            // The side lobes of the sources in the residual are above the noise too, but they are not sources.
            let level = (auto.sigmas * rms).max(o.tuning.side_lobe_margin * self.tool.side_lobe * top);
            auto.grow(residual, level, o.region.as_ref());
        }
        let mask = self.auto.as_ref().map(|a| &a.mask).or(o.region.as_ref());
        Sight { rms, peak: peak_size(residual.view(), mask, !o.no_negative) }
    }

    /// Lower the residual by minor cycles, the first one from an exact residual, as far as its error allows. Says why the last one stopped.
    pub(super) fn descend(&mut self) -> Result<MinorStop> {
        let o = self.opts;
        let first = self.n_components();
        let part = (o.cyclefactor * self.tool.side_lobe).clamp(o.psf_fraction.0, o.psf_fraction.1).max(1.0 - o.mgain);
        // An automatic mask must grow before CLEAN goes deeper: what is not in it yet has side lobes in it. A floor changes the model after the
        // cycle, and a short update has no exact residual to learn from.
        let may_go_on = self.auto.is_none() && self.from.floor.is_none() && self.from.exact;
        let (mut sight, mut trusted) = (self.sight, 0.0);
        loop {
            let lowest = self.threshold.max(o.nsigma * sight.rms).max(trusted);
            let limits = MinorLimits {
                gain: o.gain,
                level: lowest.max(part * sight.peak),
                iterations: o.niter - self.n_components(),
                negative: !o.no_negative,
            };
            let mask = self.auto.as_ref().map(|a| &a.mask).or(o.region.as_ref());
            let cycle = Minor { residual: &mut self.state.residual.image, mask, limits };
            let MinorReport { stop, components } = self.tool.deconvolver.minor(cycle)?;
            let whole = stop == MinorStop::Level && !components.is_empty();
            self.state.components.extend(components);
            if !may_go_on {
                return Ok(stop);
            }
            let norm = self.trust.norm(&*self.tool.deconvolver, &self.state.components[first..], self.state.dirty.dim());
            if let Some(level) = self.trust.level(norm).filter(|_| whole && self.n_components() < o.niter) {
                sight = self.look(false);
                trusted = level;
                if self.threshold.max(o.nsigma * sight.rms).max(trusted) <= WORTH * sight.peak {
                    continue;
                }
            }
            self.trust.expect(&self.state.residual.image, norm);
            return Ok(stop);
        }
    }

    /// Make the exact residual after a minor cycle that began with `before` components. Gives whether another look is worth it.
    pub(super) fn after(&mut self, (before, stop): (usize, MinorStop), with: &mut With<'_, '_>) -> Result<bool> {
        self.state.major += 1;
        if !self.from.exact && self.state.major >= self.opts.max_major {
            self.state.residual.chi2_per_datum = f64::NAN;
            self.stop(StopReason::MajorCycles, with);
            return Ok(false);
        }
        self.renew(with)?;
        self.trust.measure(&self.state.residual.image);
        let found = self.n_components() > before;
        if !found {
            self.stop(if stop == MinorStop::Diverged { StopReason::Diverged } else { StopReason::Nothing }, with);
        }
        Ok(found)
    }

    /// The channel with its last residual and its model.
    pub(super) fn finish(mut self, with: &mut With<'_, '_>) -> Result<Channel> {
        if self.state.residual.chi2_per_datum.is_nan() && self.from.exact {
            self.renew(with)?;
        }
        self.state.model = self.lifted();
        Ok(self.state)
    }

    /// Number of the channel.
    pub(super) fn channel(&self) -> usize {
        self.k
    }

    /// Number of components so far.
    pub(super) fn n_components(&self) -> usize {
        self.state.components.len()
    }

    /// The components from this one on.
    pub(super) fn components_from(&self, first: usize) -> &[Component] {
        &self.state.components[first..]
    }

    /// Take the components of a minor cycle that another process has made.
    pub(super) fn take(&mut self, components: Vec<Component>) {
        self.state.components.extend(components);
    }

    fn reason(&self, peak: f64, level: f64) -> Option<StopReason> {
        if peak == 0.0 {
            return Some(StopReason::Nothing);
        }
        if peak <= self.threshold {
            return Some(StopReason::Threshold);
        }
        if peak <= level {
            return Some(StopReason::Noise);
        }
        if self.n_components() >= self.opts.niter {
            return Some(StopReason::Iterations);
        }
        (self.state.major >= self.opts.max_major).then_some(StopReason::MajorCycles)
    }

    fn stop(&mut self, reason: StopReason, with: &With<'_, '_>) {
        self.state.stop = reason;
        let (n, m) = (self.n_components(), self.state.major);
        let channel = if with.imager.channels().len() > 1 { format!("channel {}: ", self.k) } else { String::new() };
        with.observer.event(Event::Note(&format!("{channel}stopped after {n} components in {m} major cycles: {}", reason.name())));
    }
}
