//! A choice among pads: exchange of chosen pads for free ones.
//!
//! # Reference
//! Boone 2001, A&A 377, 368 (the pads of an array); Fedorov 1972, Theory of Optimal Experiments (exchange); Kirkpatrick, Gelatt & Vecchi 1983,
//! Science 220, 671: worse exchanges are accepted at a falling temperature first, then only better ones.

use super::baselines::BaselineCounts;
use super::lobes::LobeGrid;
use super::moving_lobes::MovingLobes;
use super::problem::{Evaluator, Problem};
use super::search::Found;
use crate::progress::Observer;
use crate::random::stream;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Exchanges that are tried at a falling temperature, for each chosen pad.
const QUICK_TRIES: usize = 10_000;
const LOBE_TRIES: usize = 400;
const SLOW_TRIES: usize = 30;
/// Temperature at the start and at the end, relative to the score of the start.
const HOT: f64 = 0.02;
const COLD: f64 = 1e-4;
/// Distance of the directions of side lobes. Tops between them are higher by a few per cent at most.
const GRID_STEP: f64 = 0.25;
/// Share of the pads that a hop exchanges.
const HOPPED: f64 = 0.25;

/// Pads in apertures, and how many of them are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Pads {
    /// Places of the pads.
    pub places: Vec<[f64; 2]>,
    /// Number to choose.
    pub choose: usize,
    /// Pads that must be chosen, by index.
    pub kept: Vec<usize>,
}

impl Pads {
    /// Check the numbers.
    ///
    /// # Errors
    /// No pads, fewer than two or more than there are to choose, more kept than chosen.
    pub fn check(&self) -> Result<()> {
        let n = self.places.len();
        ensure!(n >= 2, ChainError::Incompatible(format!("{n} pads: there is nothing to choose")));
        need("choose", self.choose, (2..=n).contains(&self.choose), format!("2 to the number of pads, {n}"))?;
        need("choose", self.choose, self.choose >= self.kept.len(), format!("at least the {} pads that are kept", self.kept.len()))
    }
}

/// A choice that can be changed by exchanges.
enum Choice<'a> {
    /// Unique baselines alone: counts of equal baselines.
    Counts(BaselineCounts),
    /// Peak side lobes alone: an exchange changes one phasor.
    Lobes(&'a Problem, Option<MovingLobes>),
    /// Any objectives.
    Whole(&'a mut Evaluator),
}

impl<'a> Choice<'a> {
    fn new(problem: &'a Problem, pads: &Pads, evaluator: &'a mut Evaluator) -> (Self, usize) {
        let unlimited = problem.limits.beam.is_none() && problem.limits.spacing == 0.0;
        if unlimited && problem.kinds().all(|(k, _)| k.name == "redundancy") {
            let weight = problem.kinds().map(|(_, w)| w).sum();
            return (Self::Counts(BaselineCounts::new(&pads.places, problem.setting.tolerance, weight)), QUICK_TRIES);
        }
        if unlimited && problem.only_peak() { (Self::Lobes(problem, None), LOBE_TRIES) } else { (Self::Whole(evaluator), SLOW_TRIES) }
    }

    /// The score of the pads with index `chosen[slot]` replaced by `pad`; infinite where it is known to be above `limit`.
    fn after(&mut self, pads: &Pads, chosen: &[usize], slot: usize, pad: usize, limit: f64) -> Result<f64> {
        match self {
            Self::Counts(counts) => Ok(counts.after(chosen, slot, pad)),
            Self::Lobes(_, None) => Ok(f64::INFINITY),
            Self::Lobes(_, Some(moving)) => Ok(moving.try_move(slot, pads.places[pad], limit).unwrap_or(f64::INFINITY)),
            Self::Whole(evaluator) => {
                let place = |(k, c): (usize, &usize)| pads.places[if k == slot { pad } else { *c }];
                evaluator.score(&chosen.iter().enumerate().map(place).collect::<Vec<_>>())
            }
        }
    }

    /// Begin at a choice.
    fn set(&mut self, pads: &Pads, chosen: &[usize]) {
        match self {
            Self::Counts(counts) => counts.set(chosen),
            Self::Lobes(problem, moving) => {
                let ring = problem.setting.ring;
                let xy: Vec<[f64; 2]> = chosen.iter().map(|k| pads.places[*k]).collect();
                *moving = Some(MovingLobes::new(&problem.setting.views, &LobeGrid::new(ring.inner, ring.outer, GRID_STEP), &xy));
            }
            Self::Whole(_) => {}
        }
    }

    /// Make an exchange. `chosen` is the choice after it.
    fn make(&mut self, pads: &Pads, chosen: &[usize], slot: usize) {
        match self {
            Self::Lobes(_, Some(moving)) => {
                moving.try_move(slot, pads.places[chosen[slot]], f64::INFINITY);
                moving.accept();
            }
            other => other.set(pads, chosen),
        }
    }
}

/// One attempt, as [`super::attempt`] makes it with elements that move freely.
///
/// # Errors
/// An error of an objective, or a request to stop.
pub fn attempt_pads(problem: &Problem, pads: &Pads, seed: u64, number: u64, elite: &[Found], observer: &dyn Observer) -> Result<Found> {
    let mut random = stream(seed, "choice of pads", number);
    let n = pads.places.len();
    let mut chosen = match elite {
        [_, ..] if number % 2 == 1 => hop(pads, &elite[random.random_range(0..elite.len())], &mut random),
        _ => {
            let mut chosen = pads.kept.clone();
            while chosen.len() < pads.choose {
                let k = random.random_range(0..n);
                if !chosen.contains(&k) {
                    chosen.push(k);
                }
            }
            chosen
        }
    };
    let mut evaluator = problem.evaluator()?;
    if pads.choose > pads.kept.len() && pads.choose < n {
        let (mut choice, tries) = Choice::new(problem, pads, &mut evaluator);
        exchange(pads, &mut choice, &mut chosen, tries, &mut random, observer)?;
    }
    chosen[pads.kept.len()..].sort_unstable();
    let xy: Vec<[f64; 2]> = chosen.iter().map(|k| pads.places[*k]).collect();
    let score = evaluator.score(&xy)?;
    Ok(Found { attempt: number, xy, score })
}

fn hop(pads: &Pads, from: &Found, random: &mut ChaCha8Rng) -> Vec<usize> {
    let index = |p: &[f64; 2]| pads.places.iter().position(|q| q == p);
    let mut chosen: Vec<usize> = from.xy.iter().filter_map(index).collect();
    let free = pads.choose - pads.kept.len();
    for _ in 0..((HOPPED * free as f64).ceil() as usize) {
        let slot = random.random_range(0..chosen.len());
        let pad = random.random_range(0..pads.places.len());
        if slot >= pads.kept.len() && !chosen.contains(&pad) {
            chosen[slot] = pad;
        }
    }
    chosen
}

fn exchange(
    pads: &Pads,
    choice: &mut Choice<'_>,
    chosen: &mut [usize],
    tries: usize,
    random: &mut ChaCha8Rng,
    observer: &dyn Observer,
) -> Result<()> {
    let kept = pads.kept.len();
    let mut taken = vec![false; pads.places.len()];
    chosen.iter().for_each(|k| taken[*k] = true);
    choice.set(pads, chosen);
    let mut score = choice.after(pads, chosen, kept, chosen[kept], f64::INFINITY)?;
    let scale = score.abs().max(1e-6);
    let mut best = (score, chosen.to_vec());
    let total = tries * (chosen.len() - kept);
    for m in 0..total {
        if m % 256 == 0 {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
        }
        let temperature = scale * HOT * (COLD / HOT).powf(m as f64 / total as f64);
        let (slot, pad) = (random.random_range(kept..chosen.len()), random.random_range(0..taken.len()));
        let limit = score - temperature * random.random::<f64>().max(1e-300).ln();
        if taken[pad] {
            continue;
        }
        let after = choice.after(pads, chosen, slot, pad, limit)?;
        if after <= limit {
            (taken[chosen[slot]], taken[pad], chosen[slot], score) = (false, true, pad, after);
            choice.make(pads, chosen, slot);
            if score < best.0 {
                best = (score, chosen.to_vec());
            }
        }
    }
    chosen.copy_from_slice(&best.1);
    choice.set(pads, chosen);
    descend(pads, choice, chosen, best.0, observer)
}

/// Make the best single exchange until none makes the choice better.
fn descend(pads: &Pads, choice: &mut Choice<'_>, chosen: &mut [usize], mut score: f64, observer: &dyn Observer) -> Result<()> {
    loop {
        let mut best = (score, None);
        for slot in pads.kept.len()..chosen.len() {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            for pad in (0..pads.places.len()).filter(|p| !chosen.contains(p)) {
                let after = choice.after(pads, chosen, slot, pad, best.0)?;
                if after < best.0 - 1e-12 * best.0.abs() {
                    best = (after, Some((slot, pad)));
                }
            }
        }
        let Some((slot, pad)) = best.1 else { return Ok(()) };
        (score, chosen[slot]) = (best.0, pad);
        choice.make(pads, chosen, slot);
    }
}
