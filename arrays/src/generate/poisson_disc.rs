//! Random places of a disc that are as far from each other as their number allows.
//!
//! Bridson's method fills the disc with points at a least distance. The distance is found by bisection, so that the disc takes the wanted number.
//!
//! # Reference
//! Bridson 2007, ACM SIGGRAPH sketches, "Fast Poisson disk sampling in arbitrary dimensions".

use super::random_disc::check_room;
use super::shape::{Point, Shape, polar};
use super::spaced::Spaced;
use crate::random::{below, stream, uniform};
use crate::{ArrayError, Result};
use std::f64::consts::TAU;

/// Places tried around a point before it counts as surrounded, as in the paper.
const TRIES: usize = 30;
/// Steps of the bisection. The number of points jumps, so more steps find nothing better.
const STEPS: usize = 20;

pub fn has(_: &Shape) -> bool {
    true
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    check_room(s)?;
    // N points of a full disc have the distance 0.8 / sqrt N or so. Half and twice of that hold too many and too few.
    let guess = 0.8 / libm::sqrt(s.elements as f64);
    let (mut near, mut far) = ((guess / 2.0).max(s.spacing), guess * 2.0);
    let mut best = fill(near, s.seed);
    let most = best.len();
    let expected = format!("at most {most} at random with this spacing: fewer, a smaller spacing, or a grid, which packs more");
    ArrayError::need("elements", s.elements, most >= s.elements, expected)?;
    for _ in 0..STEPS {
        if best.len() == s.elements || far <= near {
            break;
        }
        let middle = 0.5 * (near + far);
        let found = fill(middle, s.seed);
        if found.len() >= s.elements {
            (near, best) = (middle, found);
        } else {
            far = middle;
        }
    }
    let mut rng = stream(s.seed, "Poisson disc: points too many", 0);
    while best.len() > s.elements {
        let k = below(&mut rng, best.len());
        best.swap_remove(k);
    }
    Ok(best)
}

/// Fill a disc of diameter 1 with points at a least distance.
fn fill(least: f64, seed: u64) -> Vec<Point> {
    let mut rng = stream(seed, "Poisson disc", 0);
    let mut placed = Spaced::new(least);
    let first = polar(0.5 * libm::sqrt(uniform(&mut rng)), TAU * uniform(&mut rng));
    placed.push(first);
    let mut active = vec![first];
    while !active.is_empty() {
        let k = below(&mut rng, active.len());
        let centre = active[k];
        let tried = (0..TRIES).map(|_| {
            // Even in area between one and two least distances.
            let [x, y] = polar(least * libm::sqrt(1.0 + 3.0 * uniform(&mut rng)), TAU * uniform(&mut rng));
            [centre[0] + x, centre[1] + y]
        });
        match tried.into_iter().find(|p| placed.fits(*p)) {
            Some(point) => {
                placed.push(point);
                active.push(point);
            }
            None => {
                active.swap_remove(k);
            }
        }
    }
    placed.points
}
