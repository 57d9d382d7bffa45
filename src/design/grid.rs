//! Positions on a square grid, for apertures whose elements plug into sockets.
//!
//! A search among free positions gives a good layout between the sockets. Its elements are put into the nearest free sockets, and then move to
//! neighbouring sockets as long as the score falls.

use super::movable::movable;
use super::problem::{Evaluator, Problem};
use crate::{ChainError, Result, ensure};

/// Sockets around the nearest one that are tried for an element, in each direction.
const AROUND: i32 = 6;
/// Rounds through all elements at most.
const ROUNDS: usize = 30;

/// Put the free elements on the grid.
///
/// # Errors
/// No free socket where an element may stand, or an error of an objective.
pub(super) fn snap(problem: &Problem, evaluator: &mut Evaluator, step: f64, x: &[f64]) -> Result<Vec<f64>> {
    let mut placed: Vec<[f64; 2]> = Vec::new();
    for p in x.as_chunks::<2>().0 {
        let near = p.map(|v| (v / step).round());
        let mut sockets: Vec<[f64; 2]> = (-AROUND..=AROUND)
            .flat_map(|i| (-AROUND..=AROUND).map(move |j| [(near[0] + f64::from(i)) * step, (near[1] + f64::from(j)) * step]))
            .collect();
        let distance = |q: &[f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
        sockets.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let free = sockets.into_iter().find(|q| may_stand(problem, &placed, *q, step));
        let socket = free.ok_or_else(|| {
            let text =
                "no free position of the grid was found near an element: use a finer position grid, fewer elements or a smaller spacing";
            ChainError::Incompatible(text.into())
        })?;
        placed.push(socket);
    }
    let mut layout = movable(problem, evaluator, placed.concat())?;
    for _ in 0..ROUNDS {
        let before = layout.score();
        for k in 0..problem.freedom.free {
            for (i, j) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                // From whole numbers of steps, so that sums of many steps do not drift.
                let now = layout.place(k).map(|v| (v / step).round());
                let to = [(now[0] + f64::from(i)) * step, (now[1] + f64::from(j)) * step];
                let others: Vec<[f64; 2]> = others(&layout.variables(), k);
                if may_stand(problem, &others, to, step) {
                    layout.attempt(k, to, layout.score() * (1.0 - 1e-12))?;
                }
            }
        }
        if layout.score() >= before {
            break;
        }
    }
    let x = layout.variables();
    ensure!(x.iter().all(|v| v.is_finite()), ChainError::Internal("a position on the grid is not finite".into()));
    Ok(x)
}

fn others(x: &[f64], k: usize) -> Vec<[f64; 2]> {
    x.as_chunks::<2>().0.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, p)| *p).collect()
}

/// True if a socket is on the ground and not too near other elements.
fn may_stand(problem: &Problem, others: &[[f64; 2]], p: [f64; 2], step: f64) -> bool {
    let freedom = &problem.freedom;
    let least = problem.limits.spacing.max(0.5 * step);
    let all = super::freedom::Freedom { free: others.len(), ..freedom.clone() }.positions(others.as_flattened());
    let near = all.iter().any(|q| (q[0] - p[0]).hypot(q[1] - p[1]) < least * (1.0 - 1e-9));
    problem.limits.region.contains(p, 1e-9) && !near
}

#[cfg(test)]
mod tests {
    use crate::design::{DesignOptions, Ground, METHODS, attempt};
    use crate::progress::Silent;
    use cittert_arrays::quantity::Length;

    #[test]
    fn elements_stand_on_the_grid_and_apart() {
        let options = DesignOptions {
            elements: Some(14),
            aperture: Some(Length(1.0)),
            spacing: Length(0.1),
            position_grid: Some(Length(0.05)),
            within: 6.0,
            ..DesignOptions::default()
        };
        let problem = options.problem(&Ground::default()).unwrap();
        let found = attempt(&problem, &METHODS[0], None, 1, 0, &[], &Silent).unwrap();
        for (k, p) in found.xy.iter().enumerate() {
            assert!(p.iter().all(|v| (v / 0.05 - (v / 0.05).round()).abs() < 1e-9), "{p:?}");
            assert!(found.xy[..k].iter().all(|q| (p[0] - q[0]).hypot(p[1] - q[1]) > 0.1 - 1e-9));
        }
        assert!(found.score < 0.35, "{}", found.score);
    }
}
