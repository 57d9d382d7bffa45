//! Random layouts to begin with.

use super::freedom::Freedom;
use super::limits::Limits;
use super::repair::repair;
use crate::{ChainError, Result};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Random points that are tried for one element.
const TRIES: usize = 2000;
/// Layouts that are tried.
const LAYOUTS: usize = 8;

/// A random point of the ground.
pub(super) fn point(limits: &Limits, random: &mut ChaCha8Rng) -> Option<[f64; 2]> {
    (0..TRIES).find_map(|_| {
        let (radius, angle) = (limits.region.radius * random.random::<f64>().sqrt(), TAU * random.random::<f64>());
        let p = [radius * angle.cos(), radius * angle.sin()];
        limits.region.contains(p, 0.0).then_some(p)
    })
}

/// A layout of random points that keep their distance. Where elements stand dense, they push each other apart.
///
/// # Errors
/// No free ground, or no layout in which the elements keep their distance was found.
pub(super) fn layout(freedom: &Freedom, limits: &Limits, random: &mut ChaCha8Rng) -> Result<Vec<f64>> {
    // The beam is a matter of the search. A start has to stand on the ground.
    let limits = Limits { beam: None, ..limits.clone() };
    for _ in 0..LAYOUTS {
        let mut x: Vec<f64> = Vec::with_capacity(freedom.variables());
        while x.len() < freedom.variables() {
            let first = point(&limits, random).ok_or_else(no_ground)?;
            // The best of some points, where none keeps its distance.
            let tries = if limits.spacing > 0.0 { 30 } else { 0 };
            let mut best = (clearance(freedom, &x, first), first);
            for _ in 0..tries {
                if best.0 >= limits.spacing {
                    break;
                }
                let p = point(&limits, random).ok_or_else(no_ground)?;
                let c = clearance(freedom, &x, p);
                if c > best.0 {
                    best = (c, p);
                }
            }
            x.extend(best.1);
        }
        let x = repair(freedom, &limits, x);
        if limits.worst(&freedom.positions(&x)) <= 1e-9 {
            return Ok(x);
        }
    }
    Err(ChainError::Incompatible(format!(
        "no layout of {} elements was found in which they keep their spacing: allow fewer elements, a smaller spacing or more ground",
        freedom.elements()
    )))
}

fn no_ground() -> ChainError {
    ChainError::Incompatible(
        "the elements have no ground to stand on: the polygons lie outside of the aperture, or keep-out zones cover them".into(),
    )
}

/// Distance of a point from the nearest element so far, and from its own copies.
fn clearance(freedom: &Freedom, x: &[f64], p: [f64; 2]) -> f64 {
    let so_far = Freedom { free: x.len() / 2, ..freedom.clone() }.positions(x);
    let copies = Freedom { free: 1, fixed: Vec::new(), ..freedom.clone() }.positions(&p);
    let own = copies.iter().skip(1);
    so_far.iter().chain(own).map(|q| (q[0] - p[0]).hypot(q[1] - p[1])).fold(f64::INFINITY, f64::min)
}
