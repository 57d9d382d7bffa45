//! Images of maximum entropy of every output channel: gather the data, choose the prior, solve, restore, certify.

use super::beam::BeamHessian;
use super::certificate::Certificate;
use super::chi2::ChiSquared;
use super::imager::{MemImager, MemState};
use super::inside::{in_front, sum_inside};
use super::objective::{Multipliers, Objective, single};
use super::plan::{Flux, MemPlan, Prior};
use super::regulariser::{L1, Regulariser, TotalVariation, WeightedSum, check_prior};
use super::response::Response;
use super::smooth_scene::{Known, SmoothScene};
use super::solver::{MemGoals, Progress};
use super::statistics::DataSums;
use super::uncertainty::{Uncertainty, uncertainty};
use crate::imaging::{Background, Clock, Imager, Kind, PATTERN_LIMIT, ZeroSpacing, with_beam};
use crate::memory::{ImageWork, check_images};
use crate::progress::{Event, Observer};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Image, RestoringBeam, SkyGrid, VisUnit};
use ndarray::{ArcArray2, Array2, Zip};
use std::collections::BTreeMap;
use std::time::Instant;

/// Largest error of a transform beside total power, in units of the noise of a visibility. With 0.5 the gradient does not fall below its limit.
const QUIET: f64 = 0.1;

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
    /// Power pattern of the elements; `None` where they have none.
    pattern: Option<Array2<f64>>,
    residual: Array2<f64>,
    /// True if a smooth scene was expected.
    smooth: bool,
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

/// Images of maximum entropy of all output channels of an imager.
///
/// # Errors
/// No image can meet the prior, flux, noise or mask; no Gaussian fits the dirty beam; or the source cannot be read. Goals that are not met
/// are not errors: see [`Certificate::met`].
pub fn mem(imager: &mut Imager<'_>, opts: &MemPlan, observer: &dyn Observer) -> Result<MemProducts> {
    let shape = (imager.grid().n_m, imager.grid().n_l);
    check_images((shape.1, shape.0), ImageWork::Entropy)?;
    for (option, found) in [("mask", opts.mask.as_ref().map(Array2::dim)), ("prior", prior_shape(&opts.prior))] {
        let expected = format!("an image of the shape of the result, {shape:?}");
        need(option, format!("{:?}", found.unwrap_or(shape)), found.is_none_or(|f| f == shape), expected)?;
    }
    opts.options.check()?;
    // The background is a part of the model.
    imager.keep_background();
    let mut clock = Clock::default();
    let mut channels = Vec::new();
    for k in 0..imager.channels().len() {
        channels.push(channel(imager, k, opts, (observer, &mut clock))?);
    }
    products(imager, channels, clock)
}

fn prior_shape(prior: &Prior) -> Option<(usize, usize)> {
    match prior {
        Prior::Image(p) => Some(p.dim()),
        _ => None,
    }
}

fn channel(imager: &mut Imager<'_>, k: usize, opts: &MemPlan, (observer, clock): (&dyn Observer, &mut Clock)) -> Result<Channel> {
    let one = flux_of_one(imager);
    let inside = in_front(&one, opts.mask.clone());
    let pattern = imager.pattern_of(k);
    let seen_of_one = pattern.as_ref().map(|p| p * &one);
    let beam = clock.time("psf", || imager.restoring_beam(k, observer))??;
    let grid = imager.grid().clone();
    let start = Instant::now();
    let sums = DataSums::new((&mut *imager, k), observer)?;
    let factor = opts.noise.factor((&mut *imager, k), &sums, observer)?;
    let pedestal = imager.header().pedestal_k.filter(|_| imager.header().unit == VisUnit::KelvinSr);
    let offset = pedestal.map(|t| &one * t);
    let hidden = pedestal.map_or(0.0, |t| t * sum_inside(seen_of_one.as_ref().unwrap_or(&one), inside.as_ref()));
    let flux = match opts.flux {
        Flux::Free => imager.zero_spacing(k).filter(ZeroSpacing::is_sure).map(|z| z.value + hidden),
        Flux::Total(f) => Some(f),
        Flux::ZeroSpacing(v) => Some(v + hidden),
    };
    let offset = offset.map(single);
    let (mut background, mut told) = (None, None);
    let prior = match &opts.prior {
        Prior::Auto | Prior::Smoothed => {
            if let Some(seen) = &seen_of_one {
                let found = Background::of((&mut *imager, k), seen, inside.as_ref(), observer)?;
                background = found.map(|b| b.level);
                told = found.map(|b| b.level * sum_inside(seen, inside.as_ref()));
                found.iter().for_each(|b| b.say(imager, observer));
            }
            match (flux, background) {
                (None, Some(level)) => &one * level,
                (Some(flux), _) => level_prior(&one, seen_of_one.as_ref(), flux, inside.as_ref())?,
                (None, None) => {
                    let flux = sums.flux_seen((&mut *imager, k), factor, observer)? + hidden;
                    level_prior(&one, seen_of_one.as_ref(), flux, inside.as_ref())?
                }
            }
        }
        Prior::Flat(t) => &one * *t,
        Prior::Image(image) => &one * image,
    };
    if let (None, Some(seen), true) = (told, &seen_of_one, imager.header().antenna_temperature_k.is_some()) {
        let found = Background::of((&mut *imager, k), seen, inside.as_ref(), observer)?;
        told = found.and_then(|b| b.total(seen, inside.as_ref()));
    }
    let prior = single(prior).into_shared();
    let middle = one[(one.nrows() / 2, one.ncols() / 2)];
    drop((one, seen_of_one));
    *clock.0.entry("statistics").or_default() += start.elapsed().as_secs_f64();
    let hessian = clock.time("beam", || BeamHessian::in_passes((&mut *imager, k), factor, observer))?;
    // The error of a transform is a part of the whole flux, which total power counts. A part that is small beside the sources is large beside
    // the noise.
    if let Some(flux) = flux.filter(|f| *f > 0.0 && imager.zero_spacing(k).is_some_and(|z| z.is_sure())) {
        imager.refine(QUIET * (sums.used as f64 / hessian.diagonal()).sqrt() / flux);
    }
    let response = pattern.as_ref().map(Response::of).unwrap_or_default();
    let known =
        Known { beam: &hessian, response: &response, prior: &prior, one: middle, inside: inside.as_ref(), offset: offset.as_ref(), factor };
    let smooth = clock.time("smoothness", || SmoothScene::of((&mut *imager, k), &known, opts, observer))?;
    let (smoothness, smooth_lambda) = smooth.map_or((None, None), |s| (Some(s.penalty), Some(s.lambda)));
    // The links between neighbours let the mean of the scene drift, so its level is held.
    let (alone, flux) = (flux, flux.or(told.filter(|_| smoothness.is_some())));
    let chi2 = ChiSquared::in_passes((&mut *imager, k), (factor, sums.used), observer)?.through(response);
    let objective = Objective { chi2, penalty: WeightedSum::default(), smoothness, inside, offset, flux, beam: Some(hessian), unit: 1.0 };
    let mut solver = prepared(objective, prior, opts)?;
    let mut state = solver.start();
    let (goals, method) = (opts.options.goals(), opts.options.solver);
    if opts.prior == Prior::Smoothed {
        let first = MemGoals { kkt: 0.1, chi2_tolerance: 0.05, ..goals };
        clock.time("first result", || solver.solve(&mut state, &first, method, observer))?;
        let wide = RestoringBeam { bmaj_rad: 2.0 * beam.bmaj_rad, bmin_rad: 2.0 * beam.bmin_rad, ..beam };
        let smooth = with_beam(&grid, state.image.view(), &wide) * (grid.cell_sr() / wide.solid_angle_sr());
        let least = 1e-3 * smooth.iter().fold(0.0_f64, |a, v| a.max(*v));
        solver = prepared(solver.into_objective(), smooth.mapv(|v| v.max(least) as f32).into_shared(), opts)?;
        state = solver.start();
    }
    let start = Instant::now();
    let mut smooth = smooth_lambda.is_some();
    let progress = match smooth_lambda {
        None => solver.solve(&mut state, &goals, method, observer)?,
        Some(lambda) => {
            let first = solver.solve_expected(&mut state, lambda, &goals, method, observer)?;
            if first.met {
                first
            } else {
                let text = "the image of a smooth scene does not meet its constraints: made again with entropy alone (smoothness none)";
                observer.event(Event::Note(text));
                solver.with_entropy_alone(alone);
                (smooth, state) = (false, solver.start());
                first.and(&solver.solve(&mut state, &goals, method, observer)?)
            }
        }
    };
    let elapsed = start.elapsed().as_secs_f64();
    *clock.0.entry("solve").or_default() += elapsed;
    let certificate = Certificate { background, ..certify(&mut solver, &state, (&progress, elapsed))? };
    let sigma = clock.time("uncertainty", || map(&mut solver, &mut state, (opts.options.uncertainty, opts.options.seed)))?;
    let model = solver.objective().seen(state.image);
    drop(solver);
    let residual = clock.time("residual", || match &pattern {
        None => imager.residual(k, model.view(), observer),
        Some(pattern) => imager.residual(k, (&model * pattern).view(), observer),
    })?;
    Ok(Channel { model, pattern, residual: residual.image, smooth, sigma, beam, certificate })
}

/// A prior of equal brightness of which the elements see this total flux.
pub(crate) fn level_prior(
    one: &Array2<f64>,
    seen_of_one: Option<&Array2<f64>>,
    flux: f64,
    inside: Option<&Array2<bool>>,
) -> Result<Array2<f64>> {
    let Some(seen) = seen_of_one else { return flat_prior(one, flux, inside) };
    let sum = sum_inside(seen, inside);
    ensure!(sum > 0.0, ChainError::NoData("the elements see no pixel of the image: check their pattern and the mask".into()));
    Ok(one * (flux / sum))
}

/// A prior of equal brightness inside the mask with this total flux; `one` is the flux a pixel of one unit of brightness \[m, l\].
fn flat_prior(one: &Array2<f64>, flux: f64, inside: Option<&Array2<bool>>) -> Result<Array2<f64>> {
    let sum = sum_inside(one, inside);
    if sum > 0.0 {
        return Ok(one * (flux / sum));
    }
    Err(ChainError::NoData("the mask leaves no pixel in front of the horizon for the image".into()))
}

/// The penalty for a prior, and the imager around it.
pub(crate) fn prepared<'a>(mut objective: Objective<'a>, prior: ArcArray2<f32>, opts: &MemPlan) -> Result<MemImager<'a>> {
    check_prior(&prior, objective.inside.as_ref())?;
    let count = objective.inside.as_ref().map_or(prior.len(), |m| m.iter().filter(|x| **x).count());
    ensure!(count > 0, ChainError::NoData("the mask leaves no pixel for the image".into()));
    objective.unit = sum_inside(&prior, objective.inside.as_ref()) / count as f64;
    let weights = &opts.options;
    let mut penalty = WeightedSum(vec![(1.0, Box::new(weights.entropy.of(prior.clone())))]);
    if weights.total_variation != 0.0 {
        penalty.0.push((weights.total_variation, Box::new(TotalVariation::new(opts.tuning.softening * objective.unit)?)));
    }
    if weights.l1 != 0.0 {
        penalty.0.push((weights.l1, Box::new(L1)));
    }
    objective.penalty = penalty;
    Ok(MemImager::new(objective, prior)?.tuned(opts.tuning))
}

fn multipliers(solver: &MemImager<'_>, state: &MemState) -> Multipliers {
    Multipliers { lambda: state.lambda * solver.objective().unit, beta: state.beta, rho: solver.objective().rho() }
}

fn certify(solver: &mut MemImager<'_>, state: &MemState, (progress, seconds): (&Progress, f64)) -> Result<Certificate> {
    let stop_reason = match (progress.met, progress.stalled) {
        (true, _) => "converged",
        (_, true) => "stalled",
        _ => "evaluations",
    };
    let (all, spent) = solver.objective().chi2.cost();
    let o = solver.objective();
    let mut dump = (Array2::zeros(state.image.dim()), Array2::zeros(state.image.dim()));
    let penalty = o.penalty.add(&state.image, 0.0, &mut dump.0, &mut dump.1);
    let flux = o.chi2.response().total(&state.image);
    Ok(Certificate {
        met: progress.met,
        stop_reason,
        chi2_per_datum: state.chi2_per_datum,
        data: o.chi2.expected(),
        flux_error: o.flux.map_or(0.0, |f| (flux / f - 1.0).abs()),
        flux_constrained: o.flux.is_some(),
        background: None,
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

/// The map of uncertainties. The image of the state is made again from the point where the map is made.
fn map(solver: &mut MemImager<'_>, state: &mut MemState, how: (Uncertainty, u64)) -> Result<Option<Array2<f64>>> {
    if how.0 == Uncertainty::None {
        return Ok(None);
    }
    let m = multipliers(solver, state);
    let o = solver.objective_mut();
    let point = o.evaluate(o.variable(&std::mem::take(&mut state.image)))?;
    let sigma = uncertainty(o, &point, &m, how)?;
    state.image = point.image();
    Ok(sigma)
}

/// The model in the restoring beam plus the residual. Elements with a pattern dim the residual with the sky, so it is divided by the pattern. Where
/// the pattern is below [`PATTERN_LIMIT`] the residual is mostly noise, and is left out.
///
/// The model of a smooth scene is as sharp as the data allow, and its residual is noise, so it is shown as it is.
fn restored(grid: &SkyGrid, c: &Channel) -> Array2<f64> {
    if c.smooth {
        // Flux a beam.
        return &c.model * (c.beam.solid_angle_sr() / grid.cell_sr());
    }
    let mut image = with_beam(grid, c.model.view(), &c.beam);
    match &c.pattern {
        None => image += &c.residual,
        Some(pattern) => Zip::from(&mut image).and(&c.residual).and(pattern).for_each(|i, r, a| {
            if *a >= PATTERN_LIMIT {
                *i += r / a;
            }
        }),
    }
    image
}

/// Images of brightness, which contain no pattern any more.
fn of_brightness(mut image: Image) -> Image {
    image.seen_through = std::mem::take(&mut image.pattern);
    image
}

fn products(imager: &Imager<'_>, channels: Vec<Channel>, mut clock: Clock) -> Result<MemProducts> {
    let grid = imager.grid().clone();
    let beams: Vec<RestoringBeam> = channels.iter().map(|c| c.beam).collect();
    let restored = clock.time("restore", || channels.iter().map(|c| restored(&grid, c)).collect());
    let (mut models, mut residuals, mut sigmas, mut certificates) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for c in channels {
        models.push(c.model);
        residuals.push(c.residual);
        sigmas.extend(c.sigma);
        certificates.push(c.certificate);
    }
    let uncertainty = if sigmas.len() == models.len() {
        let mut image = of_brightness(imager.image(sigmas, Kind::Model, &beams)?);
        // A standard deviation has no pedestal.
        let pedestal = image.pedestal_k.take().unwrap_or(0.0);
        image.data -= pedestal;
        Some(image)
    } else {
        None
    };
    Ok(MemProducts {
        model: of_brightness(imager.image(models, Kind::Model, &beams)?),
        residual: imager.image(residuals, Kind::Residual, &beams)?,
        restored: of_brightness(imager.image(restored, Kind::Restored, &beams)?),
        uncertainty,
        certificates,
        beams,
        seconds: clock.0,
    })
}
