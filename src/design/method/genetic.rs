//! A genetic search: layouts are cut along a line and joined with the other part of another layout, and some elements move.
//!
//! A cut along a line keeps what is good in one part of a layout together. Elements have no order, so a cut through their list would not.
//!
//! # Reference
//! Haupt 1994, IEEE Trans. Antennas Propag. 42, 993 (genetic search of arrays); Deaven & Ho 1995, Phys. Rev. Lett. 75, 288 (cut and join).

use super::kind::Work;
use crate::design::freedom::Freedom;
use crate::design::repair::repair;
use crate::design::start;
use crate::{ChainError, Result, ensure};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const LAYOUTS: usize = 24;
const GENERATIONS: usize = 120;
/// Chance that an element of a child moves, and the length of the move in apertures.
const CHANCE: f64 = 0.05;
const MOVE: f64 = 0.05;

pub(super) fn run(work: Work<'_>) -> Result<Vec<f64>> {
    let Work { problem, evaluator, start, mut random, observer, .. } = work;
    let (freedom, limits) = (&problem.freedom, &problem.limits);
    let mut layouts: Vec<(f64, Vec<f64>)> = Vec::with_capacity(2 * LAYOUTS);
    for k in 0..LAYOUTS {
        let x = if k == 0 { start.clone() } else { start::layout(freedom, limits, &mut random)? };
        layouts.push((evaluator.score(&freedom.positions(&x))?, x));
    }
    for _ in 0..GENERATIONS {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        for _ in 0..LAYOUTS {
            let mother = parent(&mut random);
            let father = parent(&mut random);
            let mut child = joined(freedom, &layouts[mother].1, &layouts[father].1, &mut random);
            limits.put_inside(freedom, &mut child);
            layouts.push((evaluator.score(&freedom.positions(&child))?, child));
        }
        // A stable sort: of equal layouts the older one stays.
        layouts.sort_by(|a, b| a.0.total_cmp(&b.0));
        layouts.truncate(LAYOUTS);
    }
    Ok(repair(freedom, limits, layouts.swap_remove(0).1))
}

/// The better of two layouts, which are sorted or random.
fn parent(random: &mut ChaCha8Rng) -> usize {
    random.random_range(0..LAYOUTS).min(random.random_range(0..LAYOUTS))
}

/// The elements of the mother on one side of a line through the centre, and those of the father that lie furthest on the other side.
fn joined(freedom: &Freedom, mother: &[f64], father: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
    let (s, c) = (TAU * random.random::<f64>()).sin_cos();
    let side = |p: &[f64; 2]| c * p[0] + s * p[1];
    let mut child: Vec<[f64; 2]> = mother.as_chunks::<2>().0.iter().filter(|p| side(p) >= 0.0).copied().collect();
    let mut others: Vec<[f64; 2]> = father.as_chunks::<2>().0.to_vec();
    others.sort_by(|a, b| side(a).total_cmp(&side(b)));
    child.extend(others.iter().take(freedom.free - child.len()));
    for p in &mut child {
        if random.random::<f64>() < CHANCE {
            *p = p.map(|v| v + MOVE * (2.0 * random.random::<f64>() - 1.0));
        }
    }
    child.concat()
}
