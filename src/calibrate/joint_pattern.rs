//! Image and gains solved together where elements with a pattern see a smooth scene that fills the frame.
//!
//! Such a scene has no dark frame and is nearly as bright everywhere, so positivity says nothing about it. What is known instead is its level, by total
//! power; that neighbours are alike, which makes the image of weak data a blurred one; and the pattern, which stays in the middle of the frame. Each step is
//! a Newton step of the image, at the gains that fit the image before it. The weight of the data grows from a small part of that of their noise to all of
//! it: the coarse structure, which the short baselines measure best, is found first, and finer structure joins it.
//!
//! Unknown phases leave the position of the scene open, and where it is wrong, so is the pattern above it. Scene and pattern are therefore taken to move together: the slope of
//! the phases over the band tells where both lie (see [`UnknownGains::shift`]), and the data are looked at from there. The prior has no say in it: under a pattern that stays in
//! the middle, a gradient of brightness over the field looks like a displaced pattern, and the scene would drift to where it has none. At the end what the elements saw
//! moves to its place, the gains are solved for it once more, and the image is made from the data with these gains, under the pattern in the middle of the frame.

use super::joint_solution::{FROZEN, Joint, JointGoals, JointStage, Lattice};
use super::unknown_gains::{Held, UnknownGains};
use crate::mem::{MemGoals, MemImager, MemState, Method, Progress};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Some Newton steps in which the data have this part of the weight that their noise gives them.
#[derive(Debug, Clone, Copy)]
struct Stage {
    share: f64,
    steps: usize,
    /// Moves of the scene after the steps, at most.
    moves: usize,
}

const fn stage(share: f64, steps: usize, moves: usize) -> Stage {
    Stage { share, steps, moves }
}

/// The stages. A factor of 3 in weight adds about an octave of a spectrum that falls as the square of the frequency, which the next steps can follow. The scene is
/// placed as soon as it can be recognised, and again where finer structure places it better.
const STAGES: [Stage; 6] =
    [stage(0.003, 6, 0), stage(0.01, 6, 0), stage(0.03, 8, 0), stage(0.1, 5, 4), stage(0.3, 5, 3), stage(1.0, 8, MOVES)];
/// Moves of the scene at the full weight of the data, at most.
const MOVES: usize = 6;
/// The first image, of gains that are taken to be 1.
const AS_THEY_ARE: [Stage; 3] = [stage(0.03, 3, 0), stage(0.3, 3, 0), stage(1.0, 4, 0)];
/// Newton steps at the full weight of the data, from a solution of most of them.
const AGAIN: usize = 8;
/// Runs of as many steps with free gains where the pattern is, as long as the data are not explained.
const POLISHED: usize = 4;
/// Moves of less than this part of the uncertainty of the position are not made on the way, and at the end. A move leaves up to a quarter of the way, because the image has
/// followed the data where they are.
const PLACED: f64 = 1.0;
const PLACED_WELL: f64 = 0.1;
/// Largest move, as a part of the frame.
const FAR: f64 = 0.25;

/// A solution on its way.
pub(super) struct ThroughPattern<'s, 'a, 'o> {
    imager: &'s mut MemImager<'a>,
    gains: &'s UnknownGains,
    at: Lattice<'s>,
    /// Multiplier of chi squared that belongs to the expected scene, in units of the mean prior.
    lambda: f64,
    /// Geometric mean of the amplitudes of the gains.
    scale: f64,
    goals: JointGoals,
    observer: &'o dyn Observer,
    stages: Vec<JointStage>,
    last: Option<Progress>,
    /// Where the scene lies with its pattern, rad.
    place: [f64; 2],
}

impl<'s, 'a, 'o> ThroughPattern<'s, 'a, 'o> {
    pub(super) fn new(
        imager: &'s mut MemImager<'a>,
        gains: &'s UnknownGains,
        at: Lattice<'s>,
        (lambda, scale, goals): (f64, f64, JointGoals),
        observer: &'o dyn Observer,
    ) -> Self {
        Self { imager, gains, at, lambda, scale, goals, observer, stages: Vec::new(), last: None, place: [0.0; 2] }
    }

    /// Solve image and gains. Gains near 1 are tried first, because the position of the scene is known then.
    ///
    /// # Errors
    /// Values that are not finite; a request to stop.
    pub(super) fn solve(&mut self) -> Result<Joint> {
        let (near, rms) = self.near_unity()?;
        let tuning = self.goals.tuning;
        let may = rms <= tuning.near_rms;
        let tolerance = 1.0 + self.goals.chi2.1;
        if may && near.chi2_per_datum <= tolerance * self.goals.chi2.0 {
            return self.refined(near);
        }
        let blind = self.blind()?;
        if may && near.chi2_per_datum <= tolerance * blind.chi2_per_datum {
            // The gains belong to the image, and the pattern lies where it is.
            self.look_at([0.0; 2]);
            self.gains.expect_unity(1.0 / (rms * rms));
            self.gains.fit(self.imager.predict(&near.image)?);
            return self.refined(near);
        }
        self.in_place(blind)
    }

    /// The solution near gains of 1 with the weights of the smoothness that belong to the image.
    fn refined(&mut self, mut state: MemState) -> Result<Joint> {
        self.imager.reweight(&state);
        self.run(&mut state, stage(1.0, AGAIN, 0))?;
        self.joint(state)
    }

    /// The solution in which the scene lies where the band puts it, from one that lies anywhere, and with it its pattern.
    fn in_place(&mut self, mut state: MemState) -> Result<Joint> {
        self.imager.reweight(&state);
        self.run(&mut state, stage(1.0, AGAIN, MOVES))?;
        self.say_position(&state)?;
        let mut model = self.imager.predict(&state.image)?.to_vec();
        for (value, (u, v)) in model.iter_mut().zip(self.at.u.iter().zip(self.at.v)) {
            *value *= Complex64::from_polar(1.0, TAU * (u * self.place[0] + v * self.place[1]));
        }
        self.look_at([0.0; 2]);
        self.gains.fit(&model);
        drop(model);
        let free = self.gains.held();
        self.gains.hold(Held { all: true, ..free });
        let made = self.under_the_pattern();
        self.gains.hold(free);
        let mut state = made?;
        // Data that are not explained are worth more than the position that the prior prefers.
        for _ in 0..POLISHED {
            if state.chi2_per_datum <= (1.0 + self.goals.chi2.1) * self.goals.chi2.0 {
                break;
            }
            self.improve(&mut state, stage(1.0, AGAIN, 0))?;
        }
        self.joint(state)
    }

    /// The image of data whose gains are solved, under the pattern in the middle of the frame.
    fn under_the_pattern(&mut self) -> Result<MemState> {
        self.imager.even_weights();
        let mut state = self.imager.start();
        let progress = self.imager.solve_at(&mut state, self.lambda, &MemGoals::default(), Method::QuasiNewton, self.observer)?;
        self.note(&state, (1.0, progress));
        Ok(state)
    }

    fn joint(&mut self, state: MemState) -> Result<Joint> {
        let progress = self.last.ok_or_else(|| ChainError::Internal("a joint solution without a step".into()))?;
        Ok(Joint { state, progress, noise_factor: None, stages: std::mem::take(&mut self.stages) })
    }

    /// Go on from an image, with more data of the same sky.
    ///
    /// # Errors
    /// As [`ThroughPattern::solve`].
    pub(super) fn again(&mut self, image: &ndarray::Array2<f64>) -> Result<Joint> {
        let mut state = self.imager.start_at(image.clone());
        self.gains.hold(self.scaled());
        self.gains.restart();
        self.gains.expect_unity(f64::MIN_POSITIVE.sqrt());
        self.gains.fit(self.imager.predict(&state.image)?);
        let rms = self.gains.rms_from_unity().max(self.goals.tuning.unity_rms);
        let near = rms <= self.goals.tuning.near_rms;
        self.gains.expect_unity(if near { 1.0 / (rms * rms) } else { 0.0 });
        state.lambda = self.lambda;
        if near { self.refined(state) } else { self.in_place(state) }
    }

    /// The solution whose gains are nearest to 1, and the rms that is expected of them.
    fn near_unity(&mut self) -> Result<(MemState, f64)> {
        self.observer.event(Event::Phase { name: "image and gains near 1", total: None, unit: "evaluations" });
        self.imager.even_weights();
        let mut state = self.imager.start();
        self.gains.hold(self.scaled());
        self.gains.restart();
        self.gains.expect_unity(FROZEN);
        for stage in AS_THEY_ARE {
            self.run(&mut state, stage)?;
        }
        let mut rms = self.goals.tuning.unity_rms;
        for _ in 0..self.goals.tuning.expectations {
            self.gains.expect_unity(1.0 / (rms * rms));
            self.run(&mut state, stage(1.0, AGAIN, 0))?;
            let now = self.gains.rms_from_unity();
            if now <= 1.1 * rms {
                break;
            }
            rms = now;
        }
        self.observer.event(Event::Done);
        Ok((state, rms))
    }

    /// The solution if nothing is known of the gains. Their amplitudes are solved when the phases are found: from a faint image they would take up its
    /// brightness.
    fn blind(&mut self) -> Result<MemState> {
        self.observer.event(Event::Phase { name: "image and gains", total: None, unit: "evaluations" });
        self.imager.even_weights();
        let mut state = self.imager.start();
        self.gains.hold(Held { amplitudes: true, ..Held::default() });
        self.gains.expect_unity(0.0);
        self.gains.restart();
        for stage in STAGES {
            self.run(&mut state, stage)?;
        }
        if self.gains.has_amplitudes() {
            self.gains.hold(self.scaled());
            self.run(&mut state, STAGES[STAGES.len() - 1])?;
        }
        self.observer.event(Event::Done);
        Ok(state)
    }

    /// Free gains, whose amplitudes have the scale that is known of them.
    fn scaled(&self) -> Held {
        Held { scale: Some(self.scale), ..Held::default() }
    }

    /// The steps of a stage, and the moves after it.
    fn run(&mut self, state: &mut MemState, stage: Stage) -> Result<()> {
        self.improve(state, stage)?;
        for _ in 0..stage.moves {
            let least = if stage.share < 1.0 { PLACED } else { PLACED_WELL };
            let Some(shift) = self.asked_for(state, least)? else { break };
            self.look_at([self.place[0] + shift[0], self.place[1] + shift[1]]);
            self.improve(state, stage)?;
        }
        Ok(())
    }

    fn look_at(&mut self, place: [f64; 2]) {
        self.place = place;
        self.gains.look_at(place, self.at.u, self.at.v);
        self.gains.restart();
    }

    fn improve(&mut self, state: &mut MemState, stage: Stage) -> Result<()> {
        let progress = self.imager.improve(state, stage.share * self.lambda, stage.steps, self.observer)?;
        self.note(state, (stage.share, progress));
        Ok(())
    }

    fn note(&mut self, state: &MemState, (strength, progress): (f64, Progress)) {
        let (cell, chi2_per_datum) = (self.imager.objective().chi2.grid().cell_rad, state.chi2_per_datum);
        let [l, m] = self.place.map(|x| (x / cell).round() as i64);
        self.stages.push(JointStage { strength, evaluations: progress.evaluations, chi2_per_datum, moved: (l, m) });
        self.last = Some(progress);
    }

    /// The shift that the band asks for, rad; `None` where it is less than its uncertainty times `least`, or the data do not tell.
    fn asked_for(&mut self, state: &MemState, least: f64) -> Result<Option<[f64; 2]>> {
        let model = self.imager.predict(&state.image)?;
        let Some((shift, sigma)) = self.gains.shift(model, self.at.u, self.at.v)? else { return Ok(None) };
        let grid = self.imager.objective().chi2.grid();
        let far = |n: usize| FAR * n as f64 * grid.cell_rad;
        let (l, m) = (shift[0].clamp(-far(grid.n_l), far(grid.n_l)), shift[1].clamp(-far(grid.n_m), far(grid.n_m)));
        let asked = l.is_finite() && m.is_finite() && (l.abs() > least * sigma[0] || m.abs() > least * sigma[1]);
        Ok(asked.then_some([l, m]))
    }

    /// Tell the user how well the position of the scene is known.
    fn say_position(&mut self, state: &MemState) -> Result<()> {
        let model = self.imager.predict(&state.image)?;
        let text = match self.gains.shift(model, self.at.u, self.at.v)? {
            Some((_, [l, m])) => {
                let cell = self.imager.objective().chi2.grid().cell_rad;
                format!(
                    "the position of the scene comes from the slope of the phases over the band: its standard deviation is {:.1} x {:.1} pixels",
                    l / cell,
                    m / cell
                )
            }
            None => "nothing tells the position of the scene under the pattern of the elements: it needs several channels or times".into(),
        };
        self.observer.event(Event::Note(&text));
        Ok(())
    }
}
