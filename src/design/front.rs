//! Pareto fronts: weightings of two objectives, and the layouts that no other layout beats in both.

use super::options::Objectives;
use crate::Result;
use crate::values::{bad_value, need};

/// The weights of the two objectives change by this factor from the middle of the front to an end.
const REACH: f64 = 8.0;

/// Weightings of two objectives around the given weights, from the first objective to the second.
///
/// # Errors
/// A number of objectives other than two, fewer than two weightings or more than a hundred.
pub fn weightings(objectives: &Objectives, count: usize) -> Result<Vec<Objectives>> {
    need("pareto", count, (2..=100).contains(&count), "2 to 100 weightings")?;
    let [(first, a), (second, b)] = objectives.0.as_slice() else {
        return bad_value("objective", objectives, "two objectives for a Pareto front");
    };
    let weighting = |k: usize| {
        let factor = REACH.powf(1.0 - 2.0 * k as f64 / (count - 1) as f64);
        Objectives(vec![(first.clone(), a * factor), (second.clone(), b / factor)])
    };
    Ok((0..count).map(weighting).collect())
}

/// The indices of the points that no other point beats: none is at most as large in both numbers and smaller in one. They are sorted by the first
/// number; of equal points the first counts.
#[must_use]
pub fn front(points: &[[f64; 2]]) -> Vec<usize> {
    let beats = |p: &[f64; 2], q: &[f64; 2]| p[0] <= q[0] && p[1] <= q[1] && p != q;
    let kept = |k: &usize| {
        let here = &points[*k];
        !points.iter().any(|p| beats(p, here)) && !points[..*k].contains(here)
    };
    let mut out: Vec<usize> = (0..points.len()).filter(kept).collect();
    out.sort_by(|a, b| points[*a][0].total_cmp(&points[*b][0]));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_has_no_point_that_another_beats() {
        let points = [[3.0, 1.0], [1.0, 3.0], [2.0, 2.0], [2.0, 2.5], [3.0, 1.0], [4.0, 0.5], [5.0, 5.0]];
        assert_eq!(front(&points), [1, 2, 0, 5]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn weightings_go_from_one_objective_to_the_other() {
        let both: Objectives = "psl,cable=0.1".parse().unwrap();
        let all = weightings(&both, 3).unwrap();
        assert_eq!(all[1], both);
        assert!((all[0].0[0].1 - 8.0).abs() < 1e-12 && (all[2].0[1].1 - 0.8).abs() < 1e-12);
        assert!(weightings(&"psl".parse().unwrap(), 3).is_err() && weightings(&both, 1).is_err());
    }
}
