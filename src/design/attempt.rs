//! One attempt: a start, and what a method makes of it.

use super::grid::snap;
use super::method::{Beginning, MethodKind, Work};
use super::problem::Problem;
use super::search::Found;
use super::start;
use crate::Result;
use crate::progress::Observer;
use crate::random::stream;
use rand::RngExt;

/// Share of the free elements that a hop moves at most.
const MOVED: f64 = 0.15;

/// Attempt number `number` under a seed. Odd attempts begin at one of the best layouts so far, of which they move some elements to random places:
/// basin hopping. Even attempts, and all of the first round, begin at random layouts, or the first at the layout that was given.
///
/// # Reference
/// Wales & Doye 1997, J. Phys. Chem. A 101, 5111 (basin hopping).
///
/// # Errors
/// No start that keeps the elements apart, or an error of an objective.
pub fn attempt(
    problem: &Problem,
    method: &MethodKind,
    given: Option<&[f64]>,
    seed: u64,
    number: u64,
    elite: &[Found],
    observer: &dyn Observer,
) -> Result<Found> {
    let mut random = stream(seed, "layout design", number);
    let freedom = &problem.freedom;
    let (start, beginning) = match (given, elite) {
        (Some(given), []) if number == 0 => (given.to_vec(), Beginning::Fresh),
        (_, [_, ..]) if number % 2 == 1 => {
            let chosen = &elite[random.random_range(0..elite.len())];
            (hop(problem, freedom.variables_of(&chosen.xy), &mut random), Beginning::Hop)
        }
        _ => (start::layout(freedom, &problem.limits, &mut random)?, Beginning::Fresh),
    };
    let mut evaluator = problem.evaluator()?;
    let work = Work { problem, evaluator: &mut evaluator, start, beginning, random, observer };
    let mut x = (method.run)(work)?;
    if let Some(step) = problem.grid {
        x = snap(problem, &mut evaluator, step, &x)?;
    }
    let xy = freedom.positions(&x);
    let score = evaluator.score(&xy)?;
    Ok(Found { attempt: number, xy, score })
}

/// The layout with some elements at random places.
fn hop(problem: &Problem, mut x: Vec<f64>, random: &mut rand_chacha::ChaCha8Rng) -> Vec<f64> {
    let free = problem.freedom.free;
    let most = ((MOVED * free as f64).round() as usize).clamp(1, free);
    for _ in 0..random.random_range(1..=most) {
        let k = random.random_range(0..free);
        if let Some(p) = start::point(&problem.limits, random) {
            x[2 * k..2 * k + 2].copy_from_slice(&p);
        }
    }
    x
}
