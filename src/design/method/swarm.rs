//! Particle swarm: layouts that fly towards their own best places and towards the best of all.
//!
//! # Reference
//! Clerc & Kennedy 2002, IEEE Trans. Evol. Comput. 6, 58: with these constants the swarm contracts.

use super::kind::Work;
use crate::design::repair::repair;
use crate::design::start;
use crate::{ChainError, Result, ensure};
use rand::RngExt;

const PARTICLES: usize = 24;
const FLIGHTS: usize = 120;
const INERTIA: f64 = 0.729_8;
const PULL: f64 = 1.496_18;

struct Particle {
    x: Vec<f64>,
    velocity: Vec<f64>,
    best: Vec<f64>,
    score: f64,
}

pub(super) fn run(work: Work<'_>) -> Result<Vec<f64>> {
    let Work { problem, evaluator, start, mut random, observer, .. } = work;
    let (freedom, limits) = (&problem.freedom, &problem.limits);
    let mut swarm = Vec::with_capacity(PARTICLES);
    for k in 0..PARTICLES {
        let x = if k == 0 { start.clone() } else { start::layout(freedom, limits, &mut random)? };
        let score = evaluator.score(&freedom.positions(&x))?;
        swarm.push(Particle { velocity: vec![0.0; x.len()], best: x.clone(), x, score });
    }
    let lowest = |swarm: &[Particle]| (0..swarm.len()).min_by(|a, b| swarm[*a].score.total_cmp(&swarm[*b].score)).unwrap_or(0);
    for _ in 0..FLIGHTS {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let leader = swarm[lowest(&swarm)].best.clone();
        for p in &mut swarm {
            for (i, x) in p.x.iter_mut().enumerate() {
                let own = PULL * random.random::<f64>() * (p.best[i] - *x);
                let all = PULL * random.random::<f64>() * (leader[i] - *x);
                p.velocity[i] = INERTIA * p.velocity[i] + own + all;
                *x += p.velocity[i];
            }
            limits.put_inside(freedom, &mut p.x);
            let score = evaluator.score(&freedom.positions(&p.x))?;
            if score < p.score {
                (p.best, p.score) = (p.x.clone(), score);
            }
        }
    }
    let best = lowest(&swarm);
    Ok(repair(freedom, limits, swarm.swap_remove(best).best))
}
