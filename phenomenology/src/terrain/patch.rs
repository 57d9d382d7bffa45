//! Patches of ground, and a grid that finds the patch at a point.

/// Outline of a patch, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A polygon, which may be concave.
    Polygon(Vec<[f64; 2]>),
    /// A disc.
    Circle {
        /// Centre, m.
        center: [f64; 2],
        /// Radius, m.
        radius: f64,
    },
}

/// A patch with its cover.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    shape: Shape,
    cover: u32,
    low: [f64; 2],
    high: [f64; 2],
}

impl Patch {
    /// A patch of this outline.
    #[must_use]
    pub fn new(shape: Shape, cover: u32) -> Self {
        let (low, high) = match &shape {
            Shape::Polygon(corners) => corners.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(lo, hi), p| {
                ([lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])])
            }),
            Shape::Circle { center: [x, y], radius: r } => ([x - r, y - r], [x + r, y + r]),
        };
        Self { shape, cover, low, high }
    }

    /// Whether a point lies in the patch. The even-odd rule applies to polygons that cross themselves.
    #[must_use]
    #[inline]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        if !(x >= self.low[0] && y >= self.low[1] && x <= self.high[0] && y <= self.high[1]) {
            return false;
        }
        match &self.shape {
            Shape::Circle { center, radius } => (x - center[0]).powi(2) + (y - center[1]).powi(2) <= radius * radius,
            Shape::Polygon(corners) => {
                let mut inside = false;
                let mut a = corners[corners.len() - 1];
                for &b in corners {
                    if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                        inside = !inside;
                    }
                    a = b;
                }
                inside
            }
        }
    }
}

/// Cells along each side of the search grid.
const CELLS: usize = 48;

/// Patches sorted into cells, so that only patches near a point are tested.
#[derive(Debug, Clone, Default)]
pub(super) struct PatchIndex {
    patches: Vec<Patch>,
    low: [f64; 2],
    per_m: [f64; 2],
    /// Patches that overlap each cell, the topmost first.
    cells: Vec<Vec<u32>>,
}

impl PatchIndex {
    pub(super) fn new(patches: Vec<Patch>) -> Self {
        if patches.is_empty() {
            return Self::default();
        }
        let low = [0, 1].map(|k| patches.iter().fold(f64::INFINITY, |a, p| a.min(p.low[k])));
        let high = [0, 1].map(|k| patches.iter().fold(f64::NEG_INFINITY, |a, p| a.max(p.high[k])));
        let per_m = [0, 1].map(|k| CELLS as f64 / (high[k] - low[k]).max(1e-9));
        let mut cells = vec![Vec::new(); CELLS * CELLS];
        let clamp = |v: f64| (v.max(0.0) as usize).min(CELLS - 1);
        for (i, p) in patches.iter().enumerate().rev() {
            let range = |k: usize| clamp((p.low[k] - low[k]) * per_m[k])..=clamp((p.high[k] - low[k]) * per_m[k]);
            for row in range(1) {
                for column in range(0) {
                    cells[row * CELLS + column].push(i as u32);
                }
            }
        }
        Self { patches, low, per_m, cells }
    }

    /// The cover of the topmost patch at a point.
    #[inline]
    pub(super) fn cover(&self, x: f64, y: f64) -> Option<u32> {
        if self.patches.is_empty() {
            return None;
        }
        let (u, v) = ((x - self.low[0]) * self.per_m[0], (y - self.low[1]) * self.per_m[1]);
        let limit = CELLS as f64 + 1e-6;
        if !(u >= 0.0 && v >= 0.0 && u <= limit && v <= limit) {
            return None;
        }
        let cell = (v as usize).min(CELLS - 1) * CELLS + (u as usize).min(CELLS - 1);
        self.cells[cell].iter().map(|i| &self.patches[*i as usize]).find(|p| p.contains(x, y)).map(|p| p.cover)
    }
}

/// The rectangles of a strip along a centre line. Two equal points in succession give no rectangle.
pub(crate) fn strip(line: &[[f64; 2]], width: f64) -> Vec<Vec<[f64; 2]>> {
    line.windows(2)
        .filter_map(|w| {
            let (dx, dy) = (w[1][0] - w[0][0], w[1][1] - w[0][1]);
            let length = dx.hypot(dy);
            let (nx, ny) = (-dy / length * 0.5 * width, dx / length * 0.5 * width);
            let corner = |p: [f64; 2], s: f64| [p[0] + s * nx, p[1] + s * ny];
            (length > 0.0).then(|| vec![corner(w[0], 1.0), corner(w[1], 1.0), corner(w[1], -1.0), corner(w[0], -1.0)])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn concave_polygons_and_strips_hold_what_they_should() {
        let l_shape = Patch::new(Shape::Polygon(vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]]), 1);
        assert!(l_shape.contains(0.5, 3.0) && l_shape.contains(3.0, 0.5) && !l_shape.contains(2.0, 2.0));
        let road = strip(&[[0.0, 0.0], [3.0, 4.0]], 2.0);
        let road = Patch::new(Shape::Polygon(road[0].clone()), 1);
        assert!(road.contains(1.5, 2.0) && road.contains(1.5 + 0.75, 2.0 - 0.55) && !road.contains(1.5 + 0.9, 2.0 - 0.7));
    }

    #[test]
    fn the_index_agrees_with_a_search_of_all() {
        let patches: Vec<Patch> = (0..60)
            .map(|k| {
                let k = f64::from(k);
                Patch::new(Shape::Circle { center: [37.0 * k % 101.0, 53.0 * k % 89.0], radius: 3.0 + k % 7.0 }, k as u32)
            })
            .collect();
        let index = PatchIndex::new(patches.clone());
        for i in 0..2000 {
            let (x, y) = (f64::from(i) * 0.717 % 130.0 - 15.0, f64::from(i) * 0.391 % 120.0 - 15.0);
            let direct = patches.iter().rev().find(|p| p.contains(x, y)).map(|p| p.cover);
            assert_eq!(index.cover(x, y), direct, "{x} {y}");
        }
    }
}
