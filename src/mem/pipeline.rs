//! Images of maximum entropy of every output channel: gather the data, choose the prior, solve, restore, certify.

use super::beam::BeamHessian;
use super::certificate::Certificate;
use super::chi2::ChiSquared;
use super::gather::Gathered;
use super::imager::{MemGoals, MemImager, MemState, Method, Progress};
use super::noise::Noise;
use super::objective::{Multipliers, Objective};
use super::regulariser::{ENTROPIES, Entry, L1, Regulariser, TotalVariation, WeightedSum, check_prior};
use super::tuning::MemTuning;
use super::uncertainty::{Uncertainty, uncertainty};
use crate::imaging::{Imager, Kind, with_beam};
use crate::misfit::Visibilities;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{Image, RestoringBeam, VisUnit};
use ndarray::{Array2, Zip};
use std::collections::BTreeMap;
use std::time::Instant;

/// Where the prior comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Prior {
    /// Flat, with the given flux, or with the flux that the shortest baselines measure.
    Auto,
    /// Flat, in K for a set in K sr, and in Jy/pixel for a set in Jy.
    Flat(f64),
    /// An image \[m, l\] in that unit.
    Image(Array2<f64>),
    /// A first result with a flat prior, smoothed with twice the restoring beam.
    Smoothed,
}

/// The constraint on the total flux.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flux {
    /// No constraint.
    Free,
    /// This total flux of the image, Jy or K sr.
    Total(f64),
    /// This visibility at zero spacing, in the unit of the data: the total flux without that of the pedestal.
    ZeroSpacing(f64),
}

/// The plan for an image of maximum entropy, in the units and on the grid of an imager.
#[derive(Debug, Clone)]
pub struct MemPlan {
    /// The solver.
    pub method: Method,
    /// The entropy.
    pub entropy: &'static Entry,
    /// The prior.
    pub prior: Prior,
    /// The total flux.
    pub flux: Flux,
    /// When to stop.
    pub goals: MemGoals,
    /// Where the image may be bright \[m, l\].
    pub mask: Option<Array2<bool>>,
    /// The noise of the data.
    pub noise: Noise,
    /// Weight of the total variation against the entropy.
    pub total_variation: f64,
    /// Weight of the l1 norm against the entropy.
    pub l1: f64,
    /// The map of uncertainties.
    pub uncertainty: Uncertainty,
    /// Constants of the solvers.
    pub tuning: MemTuning,
}

impl Default for MemPlan {
    fn default() -> Self {
        Self {
            method: Method::QuasiNewton,
            entropy: &ENTROPIES[0],
            prior: Prior::Auto,
            flux: Flux::Free,
            goals: MemGoals::default(),
            mask: None,
            noise: Noise::Weights,
            total_variation: 0.0,
            l1: 0.0,
            uncertainty: Uncertainty::Circulant,
            tuning: MemTuning::default(),
        }
    }
}

/// The images with their certificates.
#[derive(Debug, Clone)]
pub struct MemProducts {
    /// The image itself, unconvolved: K or Jy/pixel.
    pub model: Image,
    /// Residual image: the dirty image of the data minus the model.
    pub residual: Image,
    /// The image convolved with the restoring beam, plus the residual.
    pub restored: Image,
    /// Standard deviation of the image, in its unit.
    pub uncertainty: Option<Image>,
    /// One for each output channel.
    pub certificates: Vec<Certificate>,
    /// Restoring beam of each output channel.
    pub beams: Vec<RestoringBeam>,
    /// Wall-clock seconds by stage.
    pub seconds: BTreeMap<&'static str, f64>,
}

struct Channel {
    /// Flux a pixel, without the pedestal.
    model: Array2<f64>,
    residual: Array2<f64>,
    sigma: Option<Array2<f64>>,
    beam: RestoringBeam,
    certificate: Certificate,
}

/// Flux per pixel of one unit of brightness \[m, l\]: the solid angle of a cell for K, and 1 for Jy/pixel.
#[must_use]
pub fn flux_of_one(imager: &Imager<'_>) -> Array2<f64> {
    let grid = imager.grid();
    let kelvin = imager.header().unit == VisUnit::KelvinSr;
    Array2::from_shape_fn((grid.n_m, grid.n_l), |(i, j)| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let n2 = 1.0 - l * l - m * m;
        match kelvin {
            true if n2 > 0.0 => grid.cell_sr() / n2.sqrt(),
            true => 0.0,
            false => 1.0,
        }
    })
}

/// The mask without pixels behind the horizon; `one` is 0 there \[m, l\].
pub(crate) fn in_front(one: &Array2<f64>, mut mask: Option<Array2<bool>>) -> Option<Array2<bool>> {
    if one.iter().any(|v| *v == 0.0) {
        let all = mask.get_or_insert_with(|| Array2::from_elem(one.dim(), true));
        Zip::from(all).and(one).for_each(|m, v| *m &= *v > 0.0);
    }
    mask
}

/// Images of maximum entropy of all output channels of an imager.
///
/// # Errors
/// No image can meet the prior, flux, noise or mask; no Gaussian fits the dirty beam; or the source cannot be read. Goals that are not met
/// are not errors: see [`Certificate::met`].
pub fn mem(imager: &mut Imager<'_>, opts: &MemPlan, observer: &dyn Observer) -> Result<MemProducts> {
    let shape = (imager.grid().n_m, imager.grid().n_l);
    for (option, found) in [("mask", opts.mask.as_ref().map(Array2::dim)), ("prior", prior_shape(&opts.prior))] {
        if let Some(found) = found.filter(|f| *f != shape) {
            let expected = format!("an image of the shape of the result, {shape:?}");
            return Err(ChainError::BadOption { option, value: format!("{found:?}"), expected });
        }
    }
    let mut seconds = BTreeMap::new();
    let mut channels = Vec::new();
    for k in 0..imager.channels().len() {
        channels.push(channel(imager, k, opts, (observer, &mut seconds))?);
    }
    products(imager, channels, seconds)
}

fn prior_shape(prior: &Prior) -> Option<(usize, usize)> {
    match prior {
        Prior::Image(p) => Some(p.dim()),
        _ => None,
    }
}

type Seconds = BTreeMap<&'static str, f64>;

fn time<R>(seconds: &mut Seconds, stage: &'static str, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = work();
    *seconds.entry(stage).or_default() += start.elapsed().as_secs_f64();
    result
}

fn channel(imager: &mut Imager<'_>, k: usize, opts: &MemPlan, (observer, seconds): (&dyn Observer, &mut Seconds)) -> Result<Channel> {
    let one = flux_of_one(imager);
    let inside = in_front(&one, opts.mask.clone());
    let psf = time(seconds, "psf", || imager.psf_core(k, observer))?;
    let beam = imager.beam_of(&psf)?;
    let mut data = time(seconds, "gather", || Gathered::new(imager, k, observer))?;
    opts.noise.apply(&mut data)?;
    let pedestal = imager.header().pedestal_k.filter(|_| imager.header().unit == VisUnit::KelvinSr);
    let offset = pedestal.map(|t| &one * t);
    let hidden = offset.as_ref().map_or(0.0, |o| sum_inside(o, inside.as_ref()));
    let flux = match opts.flux {
        Flux::Free => None,
        Flux::Total(f) => Some(f),
        Flux::ZeroSpacing(v) => Some(v + hidden),
    };
    let seen = flux.map_or_else(|| Ok(data.flux_seen()? + hidden), Ok::<f64, ChainError>)?;
    let prior = match &opts.prior {
        Prior::Auto | Prior::Smoothed => flat_prior(&one, seen, inside.as_ref())?,
        Prior::Flat(t) => &one * *t,
        Prior::Image(image) => &one * image,
    };
    let hessian = time(seconds, "beam", || BeamHessian::new(imager.grid(), &data.freq_hz, data.uvw_m.view(), &data.weight))?;
    let term = Visibilities::new(data.vis, data.weight)?;
    let grid_options = imager.options().grid_options();
    let chi2 = ChiSquared::new(imager.grid(), &data.freq_hz, data.uvw_m.view(), &grid_options, vec![(1.0, Box::new(term))])?;
    let objective =
        Objective { chi2, penalty: WeightedSum::default(), inside: inside.clone(), offset, flux, beam: Some(hessian), unit: 1.0 };
    let mut solver = prepared(objective, prior, opts)?;
    let mut state = solver.start();
    if opts.prior == Prior::Smoothed {
        let first = MemGoals { kkt: 0.1, chi2_tolerance: 0.05, ..opts.goals };
        time(seconds, "first result", || solver.solve(&mut state, &first, opts.method, observer))?;
        let wide = RestoringBeam { bmaj_rad: 2.0 * beam.bmaj_rad, bmin_rad: 2.0 * beam.bmin_rad, ..beam };
        let smooth = with_beam(imager.grid(), state.image.view(), &wide) * (imager.grid().cell_sr() / wide.solid_angle_sr());
        let least = 1e-3 * smooth.iter().fold(0.0_f64, |a, v| a.max(*v));
        solver = prepared(solver.into_objective(), smooth.mapv(|v| v.max(least)), opts)?;
        state = solver.start();
    }
    let start = Instant::now();
    let progress = solver.solve(&mut state, &opts.goals, opts.method, observer)?;
    let elapsed = start.elapsed().as_secs_f64();
    *seconds.entry("solve").or_default() += elapsed;
    let certificate = certify(&mut solver, &state, (&progress, elapsed))?;
    let sigma = time(seconds, "uncertainty", || map(&mut solver, &state, opts.uncertainty))?;
    let mut model = state.image;
    if let Some(offset) = &solver.objective().offset {
        Zip::from(&mut model).and(offset).for_each(|v, o| *v -= o);
    }
    drop(solver);
    let residual = time(seconds, "residual", || imager.residual(k, model.view(), observer))?;
    Ok(Channel { model, residual: residual.image, sigma, beam, certificate })
}

/// A prior of equal brightness inside the mask with this total flux; `one` is the flux a pixel of one unit of brightness \[m, l\].
pub(crate) fn flat_prior(one: &Array2<f64>, flux: f64, inside: Option<&Array2<bool>>) -> Result<Array2<f64>> {
    let sum = sum_inside(one, inside);
    if sum > 0.0 {
        return Ok(one * (flux / sum));
    }
    Err(ChainError::NoData("the mask leaves no pixel in front of the horizon for the image".into()))
}

/// Sum over the pixels of a mask, or over all.
pub(crate) fn sum_inside(image: &Array2<f64>, inside: Option<&Array2<bool>>) -> f64 {
    inside.map_or_else(|| image.sum(), |m| image.iter().zip(m).filter(|(_, m)| **m).map(|(v, _)| v).sum())
}

/// The penalty for a prior, and the imager around it.
pub(crate) fn prepared(mut objective: Objective, prior: Array2<f64>, opts: &MemPlan) -> Result<MemImager> {
    check_prior(&prior, objective.inside.as_ref())?;
    let count = objective.inside.as_ref().map_or(prior.len(), |m| m.iter().filter(|x| **x).count());
    if count == 0 {
        return Err(ChainError::NoData("the mask leaves no pixel for the image".into()));
    }
    objective.unit = sum_inside(&prior, objective.inside.as_ref()) / count as f64;
    let mut penalty = WeightedSum::of((opts.entropy.make)(prior.clone()));
    if opts.total_variation != 0.0 {
        penalty = penalty.and(opts.total_variation, Box::new(TotalVariation::new(opts.tuning.softening * objective.unit)?))?;
    }
    if opts.l1 != 0.0 {
        penalty = penalty.and(opts.l1, Box::new(L1))?;
    }
    objective.penalty = penalty;
    Ok(MemImager::new(objective, prior)?.tuned(opts.tuning))
}

fn multipliers(solver: &MemImager, state: &MemState) -> Multipliers {
    Multipliers { lambda: state.lambda * solver.objective().unit, beta: state.beta, rho: solver.objective().rho() }
}

fn certify(solver: &mut MemImager, state: &MemState, (progress, seconds): (&Progress, f64)) -> Result<Certificate> {
    let stop_reason = match (progress.met, progress.stalled) {
        (true, _) => "converged",
        (_, true) => "stalled",
        _ => "evaluations",
    };
    let (all, spent) = solver.objective().chi2.cost();
    let o = solver.objective();
    let mut dump = (Array2::zeros(state.image.dim()), Array2::zeros(state.image.dim()));
    let penalty = o.penalty.add(&state.image, 0.0, &mut dump.0, &mut dump.1);
    let flux = state.image.sum();
    Ok(Certificate {
        met: progress.met,
        stop_reason,
        chi2_per_datum: state.chi2_per_datum,
        data: o.chi2.expected(),
        flux_error: o.flux.map_or(0.0, |f| (flux / f - 1.0).abs()),
        flux_constrained: o.flux.is_some(),
        model_flux: flux,
        entropy: -penalty,
        kkt_residual: state.kkt,
        lambda: state.lambda,
        iterations: progress.iterations,
        evaluations: progress.evaluations,
        convolutions: progress.convolutions,
        seconds,
        seconds_per_evaluation: spent / all.max(1) as f64,
    })
}

fn map(solver: &mut MemImager, state: &MemState, how: Uncertainty) -> Result<Option<Array2<f64>>> {
    if how == Uncertainty::None {
        return Ok(None);
    }
    let m = multipliers(solver, state);
    let o = solver.objective_mut();
    let point = o.evaluate(o.variable(&state.image))?;
    uncertainty(o, &point, &m, how)
}

fn products(imager: &Imager<'_>, channels: Vec<Channel>, mut seconds: Seconds) -> Result<MemProducts> {
    let grid = imager.grid().clone();
    let beams: Vec<RestoringBeam> = channels.iter().map(|c| c.beam).collect();
    let restored =
        time(&mut seconds, "restore", || channels.iter().map(|c| with_beam(&grid, c.model.view(), &c.beam) + &c.residual).collect());
    let (mut models, mut residuals, mut sigmas, mut certificates) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for c in channels {
        models.push(c.model);
        residuals.push(c.residual);
        sigmas.extend(c.sigma);
        certificates.push(c.certificate);
    }
    let uncertainty = if sigmas.len() == models.len() {
        let mut image = imager.image(sigmas, Kind::Model, &beams)?;
        // A standard deviation has no pedestal.
        let pedestal = image.pedestal_k.take().unwrap_or(0.0);
        image.data -= pedestal;
        Some(image)
    } else {
        None
    };
    Ok(MemProducts {
        model: imager.image(models, Kind::Model, &beams)?,
        residual: imager.image(residuals, Kind::Residual, &beams)?,
        restored: imager.image(restored, Kind::Restored, &beams)?,
        uncertainty,
        certificates,
        beams,
        seconds,
    })
}

/// Report where the noise is taken from, if it is not the weights.
pub fn announce_noise(noise: Noise, observer: &dyn Observer) {
    if let Noise::Factor(f) = noise {
        let text = format!(
            "the weights are counts of samples, not 1/sigma^2: the difference of the two hands gives a variance of {f:.4e} a count (the option noise overrides it)"
        );
        observer.event(Event::Note(&text));
    }
}
