//! Image and antenna gains solved as one problem, from data whose gains are unknown.
//!
//! At every step the gains are those that fit the image best (see [`UnknownGains`]). The image therefore descends on chi squared with
//! free gains, and does not wait for the next calibration. The data first have a small weight against the entropy, so that the image is
//! smooth and cannot take up errors of the gains. The weight then grows from stage to stage. The positive image and the dark frame
//! around the scene replace the known model of an ordinary calibration.
//!
//! Unknown phases leave the position of the scene open. The image is moved to the middle of the frame once. After that, a band of
//! frequencies or the rotation of the Earth determines its position (see [`UnknownGains::shift`]), and it is moved there.
//!
//! # Reference
//! Golub & Pereyra 1973, SIAM J. Numer. Anal. 10, 413; Cornwell & Wilkinson 1981, MNRAS 196, 1067.

use super::joint_tuning::{JointSchedule, JointStep};
use super::unknown_gains::UnknownGains;
use crate::mem::{MemGoals, MemImager, MemState, Method, Progress};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, s};

/// The record of one stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointStage {
    /// Strength of the data relative to the entropy. It is 0 in the final solutions, which determine it.
    pub strength: f64,
    /// Evaluations of the data term.
    pub evaluations: usize,
    /// Chi squared over its expected value at its end.
    pub chi2_per_datum: f64,
    /// Cells by which the image was moved after it, (columns, rows).
    pub moved: (i64, i64),
}

/// An image that was found together with the gains.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The image with its multipliers.
    pub state: MemState,
    /// The last solution.
    pub progress: Progress,
    /// The variance of the data over that of the weights, where it was estimated.
    pub noise_factor: Option<f64>,
    /// Every stage, in order.
    pub stages: Vec<JointStage>,
}

impl Joint {
    /// Chi squared over its expected value, with the noise that was estimated.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        self.state.chi2_per_datum / self.noise_factor.unwrap_or(1.0)
    }
}

/// Coordinates of the visibilities in the u-v plane, wavelengths \[n\].
#[derive(Debug, Clone, Copy)]
pub struct Lattice<'a> {
    /// Along l.
    pub u: &'a [f64],
    /// Along m.
    pub v: &'a [f64],
}

/// The goals at which the joint solution ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointGoals {
    /// Chi squared over its expected value, and its largest relative departure.
    pub chi2: (f64, f64),
    /// Estimate the noise from the difference of two hands, because the weights do not contain it.
    pub find_noise: bool,
    /// Stages and other constants.
    pub tuning: JointSchedule,
}

impl Default for JointGoals {
    fn default() -> Self {
        Self { chi2: (1.0, 0.01), find_noise: false, tuning: JointSchedule::default() }
    }
}

/// Solve image and gains together. The data term of `imager` must be `gains`; afterwards these hold the gains of the image.
///
/// # Errors
/// Values that are not finite; a request to stop.
pub fn joint(
    imager: &mut MemImager<'_>,
    gains: &UnknownGains,
    at: Lattice<'_>,
    goals: &JointGoals,
    observer: &dyn Observer,
) -> Result<Joint> {
    let grid = imager.objective().chi2.grid().clone();
    let unit = imager.objective().unit;
    let weight = gains.weight_of_all();
    let mut state = imager.start();
    let mut stages = Vec::new();
    let mut noise_factor = None;
    gains.expect_unity(0.0);
    gains.restart();
    observer.event(Event::Phase { name: "image and gains", total: None, unit: "evaluations" });
    let tuning = &goals.tuning;
    for (k, &JointStep { strength, steps }) in tuning.stages.iter().enumerate() {
        let progress = imager.improve(&mut state, strength / (weight * unit * unit), steps, observer)?;
        if goals.find_noise {
            noise_factor = gains.noise_factor(imager.predict(&state.image)?);
        }
        let explained = state.chi2_per_datum <= tuning.near * goals.chi2.0 * noise_factor.unwrap_or(1.0);
        let moved = if k == 0 { to_the_middle(&state.image)? } else { asked_for(imager, gains, at, &grid, &state)? };
        shift(imager, gains, &mut state, moved, tuning.dark);
        stages.push(JointStage { strength, evaluations: progress.evaluations, chi2_per_datum: state.chi2_per_datum, moved });
        if explained && k > 0 && moved == (0, 0) {
            break;
        }
    }
    if goals.find_noise && noise_factor.is_none() {
        observer.event(Event::Warning(
            "the weights do not hold the noise and no two hands give it: chi squared is computed as if the weights were 1/sigma^2",
        ));
    }
    let last = final_goals(goals, noise_factor);
    let mut left = tuning.finals;
    let mut eased = 0;
    let progress = loop {
        let progress = imager.solve(&mut state, &last, Method::QuasiNewton, observer)?;
        if fits_noise(&state, &last) && eased < tuning.expectations {
            state.lambda *= tuning.ease;
            eased += 1;
            continue;
        }
        left = left.saturating_sub(1);
        let moved = if left > 0 { asked_for(imager, gains, at, &grid, &state)? } else { (0, 0) };
        shift(imager, gains, &mut state, moved, tuning.dark);
        stages.push(JointStage { strength: 0.0, evaluations: progress.evaluations, chi2_per_datum: state.chi2_per_datum, moved });
        if moved == (0, 0) {
            break progress;
        }
    };
    observer.event(Event::Done);
    Ok(Joint { state, progress, noise_factor, stages })
}

/// The image of the first stage, in which the data have little weight.
pub(super) fn faint(imager: &mut MemImager<'_>, gains: &UnknownGains, first: JointStep, observer: &dyn Observer) -> Result<MemState> {
    let weight = gains.weight_of_all();
    let unit = imager.objective().unit;
    let mut state = imager.start();
    gains.restart();
    imager.improve(&mut state, first.strength / (weight * unit * unit), first.steps, observer)?;
    Ok(state)
}

/// Weight of the expectation that gains are 1 with which they stay there.
pub(super) const FROZEN: f64 = 1e12;

/// Solve image and gains together, with gains that are expected near 1. Their rms from 1 is estimated on the way, from a small value
/// upwards. Of all gains that fit the data, those are found that change the data least. The data alone do not determine them: a shift of
/// the image, or phases that grow along each arm of a Y, fit as well.
///
/// # Errors
/// As [`joint`].
pub fn joint_near_unity(imager: &mut MemImager<'_>, gains: &UnknownGains, goals: &JointGoals, observer: &dyn Observer) -> Result<Joint> {
    let unit = imager.objective().unit;
    let weight = gains.weight_of_all();
    let mut state = imager.start();
    let mut found = Stages::default();
    let tuning = &goals.tuning;
    gains.restart();
    observer.event(Event::Phase { name: "image and gains near 1", total: None, unit: "evaluations" });
    // First the image of the data as they are, so far as it explains more and more of them.
    gains.expect_unity(FROZEN);
    for (k, &JointStep { strength, steps }) in tuning.stages.iter().enumerate() {
        let before = state.chi2_per_datum;
        let progress = imager.improve(&mut state, strength / (weight * unit * unit), steps, observer)?;
        found.record(strength, &progress, &state);
        // The stages of little weight come first whatever the misfit, because a faint image explains nothing.
        if k > 2 && state.chi2_per_datum > tuning.deeper * before {
            break;
        }
    }
    if goals.find_noise {
        found.noise_factor = gains.noise_factor(imager.predict(&state.image)?);
    }
    let rms = tuning.unity_rms;
    let joint = settle(imager, gains, state, (rms, found), goals, observer)?;
    observer.event(Event::Done);
    Ok(joint)
}

/// Go on from an image, with more data of the same sky. The gains are expected as far from 1 as those that fit this image best.
///
/// # Errors
/// As [`joint`].
pub fn joint_from(
    imager: &mut MemImager<'_>,
    gains: &UnknownGains,
    image: &Array2<f64>,
    goals: &JointGoals,
    observer: &dyn Observer,
) -> Result<Joint> {
    let state = imager.start_at(image.clone());
    gains.restart();
    let mut found = Stages::default();
    if goals.find_noise {
        found.noise_factor = gains.noise_factor(imager.predict(&state.image)?);
    }
    // A very weak expectation lets the gains go where they fit, and measures how far that is from 1.
    gains.expect_unity(f64::MIN_POSITIVE.sqrt());
    gains.fit(imager.predict(&state.image)?);
    let rms = goals.tuning.unity_rms.max(gains.rms_from_unity());
    settle(imager, gains, state, (rms, found), goals, observer)
}

#[derive(Default)]
struct Stages {
    stages: Vec<JointStage>,
    noise_factor: Option<f64>,
}

impl Stages {
    fn expect(&self, gains: &UnknownGains, rms: f64) {
        gains.expect_unity(self.noise_factor.unwrap_or(1.0) / (rms * rms));
    }

    fn record(&mut self, strength: f64, progress: &Progress, state: &MemState) {
        let stage = JointStage { strength, evaluations: progress.evaluations, chi2_per_datum: state.chi2_per_datum, moved: (0, 0) };
        self.stages.push(stage);
    }
}

/// Solve to the target of chi squared, and again while the gains are found farther from 1 than was expected.
fn settle(
    imager: &mut MemImager<'_>,
    gains: &UnknownGains,
    mut state: MemState,
    (mut rms, mut found): (f64, Stages),
    goals: &JointGoals,
    observer: &dyn Observer,
) -> Result<Joint> {
    let last = final_goals(goals, found.noise_factor);
    let mut left = goals.tuning.expectations;
    let mut eased = 0;
    let progress = loop {
        found.expect(gains, rms);
        let progress = imager.solve(&mut state, &last, Method::QuasiNewton, observer)?;
        found.record(0.0, &progress, &state);
        if fits_noise(&state, &last) && eased < goals.tuning.expectations {
            state.lambda *= goals.tuning.ease;
            eased += 1;
            continue;
        }
        let now = gains.rms_from_unity();
        left = left.saturating_sub(1);
        if left == 0 || now <= 1.1 * rms {
            break progress;
        }
        rms = now;
    };
    Ok(Joint { state, progress, noise_factor: found.noise_factor, stages: found.stages })
}

/// True if the image has taken up noise. The solver gives it back slowly, so it starts again from a smaller lambda.
fn fits_noise(state: &MemState, goals: &MemGoals) -> bool {
    state.chi2_per_datum < goals.chi2 * (1.0 - 2.0 * goals.chi2_tolerance)
}

/// The gains change with the image, so the KKT residual cannot reach its usual limit. The data do not determine these digits of the image.
fn final_goals(goals: &JointGoals, noise_factor: Option<f64>) -> MemGoals {
    MemGoals {
        chi2: goals.chi2.0 * noise_factor.unwrap_or(1.0),
        chi2_tolerance: goals.chi2.1,
        kkt: f64::INFINITY,
        evaluations: goals.tuning.final_evaluations,
        ..MemGoals::default()
    }
}

/// Cells (columns, rows) from the centre of brightness to the middle of the frame.
fn to_the_middle(image: &Array2<f64>) -> Result<(i64, i64)> {
    let (rows, columns) = image.dim();
    let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
    for ((i, j), v) in image.indexed_iter() {
        sum += v;
        x += v * (j as f64 - (columns / 2) as f64);
        y += v * (i as f64 - (rows / 2) as f64);
    }
    if sum > 0.0 {
        return Ok((-(x / sum).round() as i64, -(y / sum).round() as i64));
    }
    Err(ChainError::NoData("the first image of the joint solution is black: the data hold no flux".into()))
}

/// Cells by which the image must move to fit the data best. It is 0 where the data do not determine the move to within a cell.
fn asked_for(imager: &mut MemImager<'_>, gains: &UnknownGains, at: Lattice<'_>, grid: &SkyGrid, state: &MemState) -> Result<(i64, i64)> {
    let model = imager.predict(&state.image)?;
    let Some((shift, sigma)) = gains.shift(model, at.u, at.v)? else { return Ok((0, 0)) };
    // The error of the shift grows with the misfit, because an image far from the data does not determine the shift better.
    let worse = state.chi2_per_datum.sqrt();
    let cells = |shift: f64, sigma: f64, limit: usize| {
        let (d, s) = (shift / grid.cell_rad, worse * sigma / grid.cell_rad);
        let limit = limit as f64 / 4.0;
        if d.abs() > 2.0 * s && d.is_finite() { d.clamp(-limit, limit).round() as i64 } else { 0 }
    };
    Ok((grid.l_sign() as i64 * cells(shift[0], sigma[0], grid.n_l), cells(shift[1], sigma[1], grid.n_m)))
}

/// Smoothed over five pixels along both axes with binomial weights. The edge of the pixels that entered the frame is finer than any beam, so
/// the data could not remove it.
fn smoothed(image: &Array2<f64>) -> Array2<f64> {
    const WEIGHTS: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
    let (n_m, n_l) = image.dim();
    let at = |i: usize, k: usize, n: usize| (i + k).saturating_sub(2).min(n - 1);
    let along = |from: &Array2<f64>, pick: &dyn Fn(usize, usize, usize) -> (usize, usize)| {
        Array2::from_shape_fn((n_m, n_l), |(i, j)| WEIGHTS.iter().enumerate().map(|(k, w)| w * from[pick(i, j, k)]).sum())
    };
    let rows = along(image, &|i, j, k| (i, at(j, k, n_l)));
    along(&rows, &|i, j, k| (at(i, k, n_m), j))
}

/// Move the image. Pixels that enter the frame are `dark` times the prior.
fn shift(imager: &MemImager<'_>, gains: &UnknownGains, state: &mut MemState, (columns, rows): (i64, i64), dark: f64) {
    if (columns, rows) == (0, 0) {
        return;
    }
    let mut image = imager.prior().mapv(|v| dark * f64::from(v));
    let (n_m, n_l) = image.dim();
    let spans = |d: i64, n: usize| {
        let d = d.clamp(-(n as i64), n as i64);
        let (from, to) = ((-d).max(0) as usize, d.max(0) as usize);
        let length = n - d.unsigned_abs() as usize;
        (from..from + length, to..to + length)
    };
    let ((from_l, to_l), (from_m, to_m)) = (spans(columns, n_l), spans(rows, n_m));
    image.slice_mut(s![to_m, to_l]).assign(&state.image.slice(s![from_m, from_l]));
    let moved = imager.start_at(smoothed(&image));
    state.image = moved.image;
    // After a move the gains differ by a phase gradient of many turns, so they are solved again from the start.
    gains.restart();
}
