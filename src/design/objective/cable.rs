//! The length of cable that connects all elements, in apertures: the shortest tree between them.
//!
//! # Reference
//! Prim 1957, Bell Syst. Tech. J. 36, 1389.

use super::kind::{Objective, Setting};
use crate::Result;

struct Cable;

pub(super) fn make(_setting: &Setting) -> Result<Box<dyn Objective>> {
    Ok(Box::new(Cable))
}

/// The edges of the shortest tree, as pairs of elements.
fn tree(xy: &[[f64; 2]]) -> Vec<[usize; 2]> {
    let distance = |i: usize, j: usize| (xy[i][0] - xy[j][0]).hypot(xy[i][1] - xy[j][1]);
    // The nearest element of the tree for each one that is not in it.
    let mut outside: Vec<(usize, usize, f64)> = (1..xy.len()).map(|k| (k, 0, distance(k, 0))).collect();
    let mut edges = Vec::new();
    while let Some(at) = (0..outside.len()).min_by(|a, b| outside[*a].2.total_cmp(&outside[*b].2)) {
        let (new, to, _) = outside.swap_remove(at);
        edges.push([new, to]);
        for (k, near, d) in &mut outside {
            let now = distance(*k, new);
            if now < *d {
                (*near, *d) = (new, now);
            }
        }
    }
    edges
}

impl Objective for Cable {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        Ok(tree(xy).into_iter().map(|[i, j]| (xy[i][0] - xy[j][0]).hypot(xy[i][1] - xy[j][1])).sum())
    }

    fn smooth(&mut self, xy: &[[f64; 2]], _doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        let mut sum = 0.0;
        for [i, j] in tree(xy) {
            let d = [xy[i][0] - xy[j][0], xy[i][1] - xy[j][1]];
            let length = d[0].hypot(d[1]);
            sum += length;
            let pull = d.map(|d| weight * d / length.max(1e-12));
            (0..2).for_each(|k| (gradient[i][k], gradient[j][k]) = (gradient[i][k] + pull[k], gradient[j][k] - pull[k]));
        }
        Some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_of_a_comb_is_known() {
        // Three teeth of length 1 on a back of length 2.
        let xy = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]];
        assert!((Cable.value(&xy).unwrap() - 5.0).abs() < 1e-15);
    }
}
