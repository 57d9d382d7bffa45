//! The mean beam on a grid of directions, and sums over it with their gradients.

use super::lobes::{LobeField, LobeGrid, LobeMap};
use super::views::View;

/// The beam of some views of an array on a grid.
#[derive(Debug, Clone)]
pub struct BeamMap {
    views: Vec<View>,
    fields: Vec<LobeField>,
    map: LobeMap,
    seen: Vec<[f64; 2]>,
    by_seen: Vec<[f64; 2]>,
}

impl BeamMap {
    /// For an array that is observed in these views.
    #[must_use]
    pub fn new(views: &[View], grid: &LobeGrid) -> Self {
        let fields = views.iter().map(|_| LobeField::new(grid.clone())).collect();
        Self { views: views.to_vec(), fields, map: LobeMap::zeros(grid), seen: Vec::new(), by_seen: Vec::new() }
    }

    /// Compute the mean of |AF|^2 / (N (N - 1)) over the views.
    pub fn set(&mut self, xy: &[[f64; 2]]) {
        let n = xy.len() as f64;
        let scale = 1.0 / (n * (n - 1.0));
        self.map.clear();
        for (view, field) in self.views.iter().zip(&mut self.fields) {
            view.project(xy, &mut self.seen);
            field.set(&self.seen);
            field.add_power(scale * view.weight, &mut self.map);
        }
    }

    /// Change the numbers of the map, in the order of [`LobeGrid::directions`].
    pub fn apply(&mut self, change: impl FnMut(&mut f64)) {
        if let Some(field) = self.fields.first() {
            field.apply(&mut self.map, change);
        }
    }

    /// The gradient by the positions that were given to [`BeamMap::set`], of a function whose derivatives by the mean beam the map now holds. It is
    /// added to `gradient`.
    pub fn add_gradient(&mut self, gradient: &mut [[f64; 2]]) {
        let n = gradient.len() as f64;
        let scale = 1.0 / (n * (n - 1.0));
        self.apply(|a| *a *= scale);
        for (view, field) in self.views.iter().zip(&self.fields) {
            self.by_seen.clear();
            self.by_seen.resize(gradient.len(), [0.0; 2]);
            field.add_gradient(&self.map, &mut self.by_seen);
            view.add_back(&self.by_seen, view.weight, gradient);
        }
    }
}
