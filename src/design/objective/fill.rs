//! The unfilled share of the u-v plane: 1 - filled cells / cells of the disc of the aperture. A cell is so large that the disc has as many cells as
//! the layout has baselines in both directions, N (N - 1), so layouts with the same number of elements are compared on the same cells.

use super::kind::{Objective, Setting};
use crate::Result;
use crate::design::views::View;
use std::collections::HashSet;
use std::f64::consts::PI;

struct Fill {
    views: Vec<View>,
}

pub(super) fn make(setting: &Setting) -> Result<Box<dyn Objective>> {
    Ok(Box::new(Fill { views: setting.views.clone() }))
}

impl Objective for Fill {
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64> {
        let n = xy.len() as f64;
        let cells = n * (n - 1.0);
        let cell = (PI / cells).sqrt();
        let (mut hit, mut seen) = (HashSet::new(), Vec::new());
        for view in &self.views {
            view.project(xy, &mut seen);
            for (i, a) in seen.iter().enumerate() {
                for b in &seen[i + 1..] {
                    let [u, v] = [0, 1].map(|k| ((b[k] - a[k]) / cell).round() as i32);
                    hit.insert([u, v]);
                    hit.insert([-u, -v]);
                }
            }
        }
        Ok(1.0 - hit.len() as f64 / cells)
    }
}
