//! The joint solution of image and gains as a model maker of self-calibration.
//!
//! The first call makes an image together with its own gains, from data whose gains are unknown. The loop of self-calibration then
//! solves the gains against that image as against any other model. Later calls image the calibrated data only to show the residuals.

use super::clean_model::CleanMaker;
use super::joint_pattern::ThroughPattern;
use super::joint_solution::{FROZEN, Joint, JointGoals, Lattice, faint, joint, joint_from, joint_near_unity};
use super::joint_tuning::JointSchedule;
use super::model::ModelVisibilities;
use super::options::SolveOptions;
use super::over_ranks::of_all;
use super::rounds::{ModelMaker, ModelMetrics, RoundPlan};
use super::row_averages::Averages;
use super::unknown_gains::UnknownGains;
use super::unknown_gains_builder::UnknownGainsBuilder;
use crate::fourier::GridOptions;
use crate::imaging::major::CleanOptions;
use crate::imaging::{Background, CleanProducts, Imager, ImagingOptions};
use crate::mem::regulariser::WeightedSum;
use crate::mem::{
    BeamHessian, ChiSquared, DataSums, Known, MemImager, MemPlan, MemState, Objective, Prior, Response, SmoothScene, flux_of_one, in_front,
    level_prior, noise_from_hands, prepared, single, sum_inside,
};
use crate::memory::check_joint;
use crate::misfit::VisibilityTerm;
use crate::progress::{Event, Observer, Quiet};
use crate::{ChainError, Result};
use cittert_arrays::{
    Polarization, SPEED_OF_LIGHT_M_S, SkyGrid, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block,
};
use ndarray::{Array2, Array3};
use num_complex::Complex;
use std::sync::Arc;
use std::time::Instant;

/// Memory that the joint solution takes for a visibility: the visibility, its weight, its model, its slope and its place on the grid.
const BYTES_OF_DATUM: usize = 48;

/// How the joint solution is made.
#[derive(Debug, Clone)]
pub struct JointOptions {
    /// Mode, interval, channels and feeds of the gains.
    pub solve: SolveOptions,
    /// The prior.
    pub prior: Prior,
    /// Where the image may be bright \[m, l\].
    pub mask: Option<Array2<bool>>,
    /// The goals at which the solution ends. If the weights are counts of samples, the noise is always estimated.
    pub goals: JointGoals,
}

/// Makes image and gains together from the first data, and shows the residuals of the image in the data that follow.
pub struct JointMaker {
    imaging: ImagingOptions,
    options: JointOptions,
    /// The solution, and its image as a model of the data (flux a pixel).
    found: Option<(Joint, Array2<f64>)>,
    /// The image of data whose gains are taken to be 1, between two steps.
    as_they_are: Option<(Problem, MemState)>,
    /// Shows the model and predicts from it.
    shown: CleanMaker,
}

impl JointMaker {
    /// A maker with these options.
    #[must_use]
    pub fn new(imaging: ImagingOptions, options: JointOptions) -> Self {
        let shown = CleanMaker::new(imaging.clone(), CleanOptions::default());
        Self { imaging, options, found: None, as_they_are: None, shown }
    }

    /// The problem of these data.
    fn problem(&self, data: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<Problem> {
        let counts = noise_from_hands(data)?.weights_are_counts;
        let freq_hz = data.header().spectrum.freq_hz().to_vec();
        let mut imager = Imager::new(data, self.imaging.clone(), observer)?;
        let one = flux_of_one(&imager);
        let pedestal = imager.header().pedestal_k.filter(|_| imager.header().unit == VisUnit::KelvinSr);
        let offset = pedestal.map(|t| &one * t);
        let inside = in_front(&one, self.options.mask.clone());
        let pattern = imager.pattern_of(0);
        let seen_of_one = pattern.as_ref().map(|p| p * &one);
        let (prior, known) = match &self.options.prior {
            Prior::Flat(t) => (&one * *t, true),
            Prior::Image(image) => (&one * image, true),
            Prior::Auto | Prior::Smoothed => {
                // Total power does not depend on the phases, but a fit to the visibilities does.
                let told = imager.header().antenna_temperature_k.is_some() || imager.zero_spacing(0).is_some();
                let background = match &seen_of_one {
                    Some(seen) if told => Background::of((&mut imager, 0), seen, inside.as_ref(), observer)?,
                    _ => None,
                };
                if let Some(background) = background {
                    background.say(&imager, observer);
                    (&one * background.level, true)
                } else {
                    let hidden = pedestal.map_or(0.0, |t| t * sum_inside(seen_of_one.as_ref().unwrap_or(&one), inside.as_ref()));
                    // Amplitudes on the shortest baselines give at least a part of the flux. They do not depend on the phases.
                    let seen = DataSums::new((&mut imager, 0), observer)?.flux_seen((&mut imager, 0), 1.0, observer)? + hidden;
                    (level_prior(&one, seen_of_one.as_ref(), seen, inside.as_ref())?, false)
                }
            }
        };
        let response = pattern.as_ref().map(Response::of).unwrap_or_default();
        let (prior, offset) = (single(prior).into_shared(), offset.map(single));
        let grid = imager.grid().clone();
        // Only a scene whose level is known is expected to be smooth around it.
        let mut smooth = None;
        if known && !counts && pattern.is_some() {
            let beam = BeamHessian::in_passes((&mut imager, 0), 1.0, observer)?;
            let about = Known {
                beam: &beam,
                response: &response,
                prior: &prior,
                one: one[(one.nrows() / 2, one.ncols() / 2)],
                inside: inside.as_ref(),
                offset: offset.as_ref(),
                factor: 1.0,
            };
            let scene = SmoothScene::of((&mut imager, 0), &about, &MemPlan::default(), observer)?;
            // The links between neighbours let the mean of the scene drift, so what the elements see in all is held.
            let mut seen = prior.mapv(f64::from);
            response.multiply(&mut seen);
            let flux = sum_inside(&seen, inside.as_ref());
            smooth = scene.map(|scene| (scene, beam, flux));
        }
        drop(imager);
        let (gains, uvw_m) = self.gathered(data, &grid, observer)?;
        let asked_for = self.imaging.grid_options();
        let grid_options = GridOptions { epsilon: asked_for.relaxed_to(self.options.goals.tuning.epsilon), ..asked_for };
        let term: Box<dyn VisibilityTerm> = Box::new(Arc::clone(&gains));
        let chi2 = ChiSquared::new(&grid, &freq_hz, uvw_m.view(), &grid_options, term)?.through(response);
        let (smoothness, beam, lambda, flux) = match smooth {
            Some((scene, beam, flux)) => (Some(scene.penalty), Some(beam), Some(scene.lambda), Some(flux)),
            None => (None, None, None, None),
        };
        let objective = Objective { chi2, penalty: WeightedSum::default(), smoothness, inside, offset, flux, beam, unit: 1.0 };
        let mut solver = prepared(objective, prior, &MemPlan::default())?;
        if !known {
            solver = of_its_flux(solver, &gains, &self.options.goals.tuning, observer)?;
        }
        let goals = JointGoals { find_noise: counts, ..self.options.goals };
        Ok(Problem { solver, gains, uvw_m, freq_hz, goals, lambda })
    }

    /// The data with unknown gains, and their uvw in m \[row, 3\]. A set that is too large for the memory is averaged over time, as far as no pixel
    /// of `grid` can tell.
    fn gathered(
        &self,
        data: &mut dyn VisibilitySource,
        grid: &SkyGrid,
        observer: &dyn Observer,
    ) -> Result<(Arc<UnknownGains>, Array2<f64>)> {
        let memory = self.imaging.memory;
        let ranks = data.ranks();
        let mut builder = UnknownGainsBuilder::new(data.header(), &self.options.solve)?.shared_by(ranks.clone());
        let mut places: Vec<f64> = Vec::new();
        let mut gather = |block: VisibilityBlock| -> Result<()> {
            for row in builder.add(&block)? {
                places.extend(block.coverage.uvw_m.row(row));
            }
            Ok(())
        };
        let of_row = data.header().spectrum.n_chan() * data.header().polarizations.len() * BYTES_OF_DATUM;
        // All processes average if one must.
        let mut too_many = [data.n_rows() as f64 * of_row as f64 - memory.joint_data() as f64];
        ranks.largest(&mut too_many);
        let read = if too_many[0] > 0.0 {
            observer.event(Event::Note("the data of the joint solution are averaged over time, as far as no pixel of the image can tell"));
            let averages = Averages::new(data.header(), grid, self.options.solve.solint);
            let mut rows = 0;
            averages.for_each(data, memory.block(), |block| {
                rows += block.n_rows();
                check_joint(rows.saturating_mul(of_row))?;
                gather(block)
            })
        } else {
            for_each_block(data, memory.block(), |_, block| gather(block))
        };
        of_all(&*ranks, read.map(|()| Vec::new()))?;
        let gains = Arc::new(builder.finish()?);
        let uvw_m = Array2::from_shape_fn((places.len() / 3, 3), |(r, k)| places[3 * r + k]);
        Ok((gains, uvw_m))
    }

    /// Solve image and gains from uncalibrated data. If gains near 1 do not fit, nothing is taken to be known of them.
    fn find(&mut self, data: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<(Joint, Array2<f64>)> {
        let mut problem = self.problem(data, observer)?;
        let begun = Instant::now();
        if let Some(found) = problem.smooth(None, observer)? {
            say(&found, begun, observer);
            let model = problem.model(&found.state);
            return Ok((found, model));
        }
        let Problem { solver, gains, goals, .. } = &mut problem;
        let near = joint_near_unity(solver, gains, goals, observer)?;
        let fits = |j: &Joint, goals: &JointGoals| j.misfit() <= goals.tuning.near_enough * goals.chi2.0;
        let (goals, rms) = (*goals, gains.rms_from_unity());
        let found = if fits(&near, &goals) && rms <= goals.tuning.near_rms {
            near
        } else {
            let blind = problem.solved(observer)?;
            if fits(&blind, &goals) || blind.misfit() < near.misfit() { blind } else { near }
        };
        say(&found, begun, observer);
        let model = problem.model(&found.state);
        Ok((found, model))
    }
}

/// Image and gains of one set of data.
struct Problem {
    solver: MemImager<'static>,
    gains: Arc<UnknownGains>,
    uvw_m: Array2<f64>,
    freq_hz: Vec<f64>,
    goals: JointGoals,
    /// Multiplier of chi squared, in units of the mean prior, that belongs to a smooth scene behind the pattern of the elements, if one is expected.
    lambda: Option<f64>,
}

impl Problem {
    /// Coordinates u and v of all visibilities, wavelengths.
    fn lattice(&self) -> (Vec<f64>, Vec<f64>) {
        let axis = |axis: usize| -> Vec<f64> {
            let column = self.uvw_m.column(axis);
            column.iter().flat_map(|x| self.freq_hz.iter().map(move |f| x * f / SPEED_OF_LIGHT_M_S)).collect()
        };
        (axis(0), axis(1))
    }

    /// The solution of a smooth scene behind a pattern: from the data alone, or from an image of most of them. `None` if no such scene is expected.
    fn smooth(&mut self, from: Option<&Array2<f64>>, observer: &dyn Observer) -> Result<Option<Joint>> {
        let Some(lambda) = self.lambda else { return Ok(None) };
        let (u, v) = self.lattice();
        let at = Lattice { u: &u, v: &v };
        let mut way = ThroughPattern::new(&mut self.solver, &self.gains, at, (lambda, 1.0, self.goals), observer);
        let found = match from {
            Some(image) => way.again(image)?,
            None => way.solve()?,
        };
        Ok(Some(found))
    }

    /// The solution if nothing is known of the gains.
    fn solved(&mut self, observer: &dyn Observer) -> Result<Joint> {
        let (u, v) = self.lattice();
        joint(&mut self.solver, &self.gains, Lattice { u: &u, v: &v }, &self.goals, observer)
    }

    /// The image as a model of the data, flux a pixel: what the elements see of it.
    fn model(&self, state: &MemState) -> Array2<f64> {
        let mut model = self.solver.objective().seen(state.image.clone());
        self.solver.objective().chi2.response().multiply(&mut model);
        model
    }
}

fn say(found: &Joint, begun: Instant, observer: &dyn Observer) {
    observer.event(Event::Note(&format!(
        "image and gains solved together in {} evaluations and {:.1} s, chi2/datum {:.3}",
        found.state.evaluations,
        begun.elapsed().as_secs_f64(),
        found.misfit()
    )));
}

/// The problem with a better flat prior. The shortest baselines may resolve most of a scene, so the prior is raised to the flux of the
/// first faint image. It is then multiplied by [`JointSchedule::brighter`].
fn of_its_flux<'a>(
    mut solver: MemImager<'a>,
    gains: &UnknownGains,
    tuning: &JointSchedule,
    observer: &dyn Observer,
) -> Result<MemImager<'a>> {
    let brighter = |solver: MemImager<'a>, factor: f64| -> Result<MemImager<'a>> {
        let prior = solver.prior().mapv(|v| (f64::from(v) * factor) as f32).into_shared();
        prepared(solver.into_objective(), prior, &MemPlan::default())
    };
    for _ in 0..tuning.priors {
        let image = faint(&mut solver, gains, tuning.stages[0], observer)?.image;
        let ratio = image.sum() / sum_inside(solver.prior(), None);
        if !(ratio.is_finite() && ratio > tuning.prior_settled) {
            break;
        }
        solver = brighter(solver, ratio)?;
    }
    brighter(solver, tuning.brighter)
}

/// A model maker with images to show.
pub trait ImageMaker: ModelMaker {
    /// Images of the present round; after the loop, those of the best round.
    fn products(&self) -> Option<&CleanProducts>;

    /// The joint solution of image and gains, for makers that have one.
    fn solution(&self) -> Option<&Joint> {
        None
    }
}

impl ImageMaker for CleanMaker {
    fn products(&self) -> Option<&CleanProducts> {
        Self::products(self)
    }
}

impl ImageMaker for JointMaker {
    fn products(&self) -> Option<&CleanProducts> {
        self.shown.products()
    }

    fn solution(&self) -> Option<&Joint> {
        self.found.as_ref().map(|f| &f.0)
    }
}

impl ModelMaker for JointMaker {
    fn update(&mut self, data: &mut dyn VisibilitySource, _plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        if self.imaging.channels_out != 1 || self.imaging.pol != Polarization::I {
            let expected = "one output channel of Stokes I in a joint solution of image and gains".into();
            return Err(ChainError::BadOption { option: "channels-out", value: self.imaging.channels_out.to_string(), expected });
        }
        let found = match self.found.take() {
            Some(found) => found,
            None => self.find(data, observer)?,
        };
        let metrics = self.shown.show(data, &found.1, &Quiet(observer))?;
        let iterations = found.0.stages.iter().map(|s| s.evaluations).sum();
        self.found = Some(found);
        Ok(ModelMetrics { iterations, ..metrics })
    }

    fn as_they_are(&mut self, data: &mut dyn VisibilitySource, step: usize, observer: &dyn Observer) -> Result<Option<ModelMetrics>> {
        let (mut problem, mut state) = match self.as_they_are.take() {
            Some(last) if step > 0 => last,
            _ => {
                let problem = self.problem(data, observer)?;
                problem.gains.restart();
                // With this weight no gain departs from 1.
                problem.gains.expect_unity(FROZEN);
                let state = problem.solver.start();
                (problem, state)
            }
        };
        let unit = problem.solver.objective().unit;
        let weight = problem.gains.weight_of_all();
        let Some(stage) = self.options.goals.tuning.stages.get(step) else { return Ok(None) };
        problem.solver.improve(&mut state, stage.strength / (weight * unit * unit), stage.steps, observer)?;
        let metrics = self.shown.show(data, &problem.model(&state), &Quiet(observer))?;
        self.as_they_are = Some((problem, state));
        Ok(Some(metrics))
    }

    fn reopen(&mut self, data: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<()> {
        let Some((before, _)) = self.found.take() else { return Ok(()) };
        let mut problem = self.problem(data, observer)?;
        let begun = Instant::now();
        let found = match problem.smooth(Some(&before.state.image), observer)? {
            Some(found) => found,
            None => {
                let Problem { solver, gains, goals, .. } = &mut problem;
                joint_from(solver, gains, &before.state.image, goals, observer)?
            }
        };
        say(&found, begun, observer);
        let model = problem.model(&found.state);
        self.shown.show(data, &model, &Quiet(observer))?;
        self.found = Some((found, model));
        Ok(())
    }

    fn remember(&mut self) {
        self.shown.remember();
    }

    fn recall(&mut self) {
        self.shown.recall();
    }
}

impl ModelVisibilities for JointMaker {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        self.shown.predict(header, first_row, coverage)
    }
}
