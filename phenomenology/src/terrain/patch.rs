//! Patches of ground.

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

/// How a rectangle lies to a patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lies {
    Inside,
    Across,
    Outside,
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

    /// Cover of the patch.
    pub(super) fn cover(&self) -> u32 {
        self.cover
    }

    /// Lowest and highest coordinates, m.
    pub(super) fn bounds(&self) -> [[f64; 2]; 2] {
        [self.low, self.high]
    }

    /// How a rectangle between two corners lies to the patch.
    pub(super) fn lies(&self, low: [f64; 2], high: [f64; 2]) -> Lies {
        if (0..2).any(|k| low[k] > self.high[k] || high[k] < self.low[k]) {
            return Lies::Outside;
        }
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        let inside = corners.map(|[x, y]| self.contains(x, y));
        let crossed = match &self.shape {
            Shape::Circle { center, radius } => {
                let nearest = [0, 1].map(|k| center[k].clamp(low[k], high[k]) - center[k]);
                nearest[0].hypot(nearest[1]) <= *radius && !inside.iter().all(|i| *i)
            }
            Shape::Polygon(points) => (0..points.len()).any(|k| meets(points[k], points[(k + 1) % points.len()], low, high)),
        };
        match (crossed, inside[0]) {
            (true, _) => Lies::Across,
            (false, true) => Lies::Inside,
            (false, false) => Lies::Outside,
        }
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

/// Whether a segment meets a rectangle, by separating axes. Touching counts.
fn meets(a: [f64; 2], b: [f64; 2], low: [f64; 2], high: [f64; 2]) -> bool {
    if (0..2).any(|k| a[k].max(b[k]) < low[k] || a[k].min(b[k]) > high[k]) {
        return false;
    }
    let along = [b[0] - a[0], b[1] - a[1]];
    let side = |x: f64, y: f64| along[0] * (y - a[1]) - along[1] * (x - a[0]);
    let sides = [side(low[0], low[1]), side(high[0], low[1]), side(high[0], high[1]), side(low[0], high[1])];
    !(sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0))
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
}
