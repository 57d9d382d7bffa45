//! Ground given by heights on a grid of nodes. Each cell consists of two triangles.

use super::hit::GroundHit;
use crate::space::{Ray, Vec3};

/// Heights on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    origin: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    /// From the south-west, row by row to the north. // [row, column]
    heights: Vec<f64>,
    low: f64,
    high: f64,
}

impl HeightField {
    /// Heights in m of nodes `cell_m` apart, from the south-west node `origin_m`, in rows of `columns` from south to north.
    ///
    /// Returns `None` for fewer than 2 x 2 nodes, an incomplete row, a cell that is not positive or a number that is not finite.
    #[must_use]
    pub fn new(origin_m: [f64; 2], cell_m: f64, columns: usize, heights_m: Vec<f64>) -> Option<Self> {
        let rows = heights_m.len().checked_div(columns)?;
        let good = columns >= 2 && rows >= 2 && rows * columns == heights_m.len() && cell_m > 0.0 && cell_m.is_finite();
        if !good || !heights_m.iter().chain(&origin_m).all(|h| h.is_finite()) {
            return None;
        }
        let low = heights_m.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(Self { origin: origin_m, cell: cell_m, columns, rows, heights: heights_m, low, high })
    }

    /// Lowest and highest node, m.
    #[must_use]
    pub fn range_m(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    fn at(&self, column: usize, row: usize) -> f64 {
        self.heights[row * self.columns + column]
    }

    /// The cell that contains a point, and the coordinates of the point in the cell, 0 to 1.
    fn locate(&self, x: f64, y: f64) -> Option<(usize, usize, f64, f64)> {
        let (u, v) = ((x - self.origin[0]) / self.cell, (y - self.origin[1]) / self.cell);
        let (last_u, last_v) = ((self.columns - 1) as f64, (self.rows - 1) as f64);
        if !(u >= 0.0 && v >= 0.0 && u <= last_u && v <= last_v) {
            return None;
        }
        let (i, j) = ((u as usize).min(self.columns - 2), (v as usize).min(self.rows - 2));
        Some((i, j, u - i as f64, v - j as f64))
    }

    /// Height and slopes of one triangle of a cell: the lower right triangle (`u >= v`), or the upper left one.
    fn plane(&self, i: usize, j: usize, lower: bool) -> (f64, f64, f64) {
        let (h00, h10, h01, h11) = (self.at(i, j), self.at(i + 1, j), self.at(i, j + 1), self.at(i + 1, j + 1));
        if lower { (h00, h10 - h00, h11 - h10) } else { (h00, h11 - h01, h01 - h00) }
    }

    /// Height at a point, m. `None` outside the grid.
    #[must_use]
    pub fn height_m(&self, x: f64, y: f64) -> Option<f64> {
        let (i, j, u, v) = self.locate(x, y)?;
        let (h, su, sv) = self.plane(i, j, u >= v);
        Some(h + su * u + sv * v)
    }

    /// The first point beyond `t_min` where a ray meets the ground. The cells are tested in the order in which the ray passes over them.
    #[must_use]
    pub fn hit(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<GroundHit> {
        let (o, d) = (ray.origin, ray.direction);
        let far = [self.origin[0] + self.cell * (self.columns - 1) as f64, self.origin[1] + self.cell * (self.rows - 1) as f64];
        let margin = 1e-9 * self.cell + 1e-9 * (self.high - self.low);
        let limits = [(self.origin[0], far[0]), (self.origin[1], far[1]), (self.low - margin, self.high + margin)];
        let (mut near_t, mut far_t) = (t_min, t_max);
        let mut side = Vec3::ZERO;
        for (axis, (lo, hi)) in limits.into_iter().enumerate() {
            if d[axis] == 0.0 {
                if o[axis] < lo || o[axis] > hi {
                    return None;
                }
                continue;
            }
            let (a, b) = ((lo - o[axis]) * ray.inverse[axis], (hi - o[axis]) * ray.inverse[axis]);
            if a.min(b) > near_t {
                near_t = a.min(b);
                let outward = -d[axis].signum();
                side = [Vec3::new(outward, 0.0, 0.0), Vec3::new(0.0, outward, 0.0), Vec3::ZERO][axis];
            }
            far_t = far_t.min(a.max(b));
        }
        if near_t > far_t {
            return None;
        }
        let start = ray.at(near_t);
        // A ray that enters at the rim below the surface hits the vertical side of the field.
        if side != Vec3::ZERO {
            let inner = start - side * (1e-9 * self.cell);
            if self.height_m(inner.x, inner.y).is_some_and(|h| h > start.z) {
                return Some(GroundHit { t: near_t, normal: side });
            }
        }
        let clamp = |v: f64, n: usize| (v.max(0.0) as usize).min(n - 2);
        let mut i = clamp((start.x - self.origin[0]) / self.cell, self.columns) as isize;
        let mut j = clamp((start.y - self.origin[1]) / self.cell, self.rows) as isize;
        let step = |d: f64| if d >= 0.0 { 1_isize } else { -1 };
        let (si, sj) = (step(d.x), step(d.y));
        let border = |k: isize, s: isize, axis: usize| {
            if d[axis] == 0.0 {
                return f64::INFINITY;
            }
            let edge = self.origin[axis] + self.cell * (k + s.max(0)) as f64;
            (edge - o[axis]) * ray.inverse[axis]
        };
        let mut t = near_t;
        while i >= 0 && j >= 0 && i < self.columns as isize - 1 && j < self.rows as isize - 1 && t <= far_t {
            let (ti, tj) = (border(i, si, 0), border(j, sj, 1));
            if let Some(hit) = self.cell_hit(ray, i as usize, j as usize, t_min, t_max) {
                return Some(hit);
            }
            t = ti.min(tj);
            if ti <= tj {
                i += si;
            } else {
                j += sj;
            }
        }
        None
    }

    fn cell_hit(&self, ray: &Ray, i: usize, j: usize, t_min: f64, t_max: f64) -> Option<GroundHit> {
        let corner = [self.origin[0] + self.cell * i as f64, self.origin[1] + self.cell * j as f64];
        let mut best: Option<GroundHit> = None;
        for lower in [true, false] {
            let (h, su, sv) = self.plane(i, j, lower);
            let (sx, sy) = (su / self.cell, sv / self.cell);
            let across = Vec3::new(-sx, -sy, 1.0);
            let slope = ray.direction.dot(across);
            if slope >= 0.0 {
                continue;
            }
            let foot = Vec3::new(corner[0], corner[1], h);
            let t = (foot - ray.origin).dot(across) / slope;
            let p = ray.at(t);
            let (u, v) = ((p.x - corner[0]) / self.cell, (p.y - corner[1]) / self.cell);
            // The triangles overlap a little, so that no ray passes between them.
            let e = 1e-9;
            let inside = u >= -e && v >= -e && u <= 1.0 + e && v <= 1.0 + e && if lower { u >= v - e } else { v >= u - e };
            if inside && t > t_min && t <= t_max && best.is_none_or(|b| t < b.t) {
                best = Some(GroundHit { t, normal: across.unit() });
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hills() -> HeightField {
        let heights = (0..21 * 31).map(|k| 3.0 * (f64::from(k % 31) * 0.7).sin() + 2.0 * (f64::from(k / 31) * 0.9).cos()).collect();
        HeightField::new([-30.0, -20.0], 2.0, 31, heights).unwrap()
    }

    proptest! {
        // Walking along the ray in small steps finds the same place.
        #[test]
        fn a_walk_along_the_ray_agrees(x in -40.0f64..40.0, y in -30.0f64..30.0, tx in -29.0f64..29.0, ty in -19.0f64..19.0, z in 6.0f64..30.0) {
            let field = hills();
            let from = Vec3::new(x, y, z);
            let ray = Ray::new(from, Vec3::new(tx, ty, field.height_m(tx, ty).unwrap()) - from);
            let hit = field.hit(&ray, 1e-9, 1e9).unwrap();
            let p = ray.at(hit.t);
            let cut = hit.normal.z == 0.0;
            prop_assert!(cut || (field.height_m(p.x, p.y).unwrap() - p.z).abs() < 1e-6);
            prop_assert!(hit.normal.dot(ray.direction) < 0.0);
            for k in 0..400 {
                let q = ray.at(hit.t * f64::from(k) / 400.0);
                if let Some(h) = field.height_m(q.x, q.y) {
                    prop_assert!(q.z > h - 1e-6, "passed through the ground at {q:?}");
                }
            }
        }
    }

    #[test]
    fn fields_that_cannot_be_are_refused() {
        assert!(HeightField::new([0.0; 2], 1.0, 2, vec![0.0; 4]).is_some());
        assert!(HeightField::new([0.0; 2], 1.0, 2, vec![0.0; 5]).is_none());
        assert!(HeightField::new([0.0; 2], 0.0, 2, vec![0.0; 4]).is_none());
        assert!(HeightField::new([0.0; 2], 1.0, 0, vec![]).is_none());
        assert!(HeightField::new([0.0; 2], 1.0, 2, vec![0.0, f64::NAN, 0.0, 0.0]).is_none());
    }
}
