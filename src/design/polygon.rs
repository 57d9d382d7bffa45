//! Polygons on the ground.

use crate::{ChainError, Result, ensure};

/// A polygon whose edges do not cross.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    corners: Vec<[f64; 2]>,
}

/// Twice the area of the triangle of three points, positive where they turn to the left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True where two edges have a point in common.
fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let within = |p: [f64; 2], a: [f64; 2], b: [f64; 2]| (0..2).all(|k| a[k].min(b[k]) <= p[k] && p[k] <= a[k].max(b[k]));
    let (t1, t2, t3, t4) = (turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b));
    ((t1 > 0.0) != (t2 > 0.0) && (t3 > 0.0) != (t4 > 0.0) && t1 != 0.0 && t2 != 0.0 && t3 != 0.0 && t4 != 0.0)
        || [(t1, c, a, b), (t2, d, a, b), (t3, a, c, d), (t4, b, c, d)].into_iter().any(|(t, p, q, r)| t == 0.0 && within(p, q, r))
}

impl Polygon {
    /// The polygon with these corners, in order around it.
    ///
    /// # Errors
    /// Fewer than three corners, a coordinate that is not finite, two edges that cross or touch, no area.
    pub fn new(name: &str, corners: Vec<[f64; 2]>) -> Result<Self> {
        let n = corners.len();
        let wrong = |why: String| ChainError::Incompatible(format!("the polygon {name} {why}"));
        ensure!(n >= 3, wrong(format!("has {n} corners, it needs at least 3")));
        if let Some(k) = corners.iter().position(|c| !(c[0].is_finite() && c[1].is_finite())) {
            return Err(wrong(format!("has a corner {} that is not two finite numbers: {:?}", k + 1, corners[k])));
        }
        let edge = |k: usize| [corners[k], corners[(k + 1) % n]];
        for i in 0..n {
            for j in i + 1..n {
                let neighbours = j == i + 1 || (i == 0 && j == n - 1);
                // Neighbours share a corner. They overlap only where one turns back over the other.
                let crosses = if neighbours {
                    let [a, b, c] = if j == i + 1 { [i, j, (j + 1) % n] } else { [j, 0, 1] }.map(|k| corners[k]);
                    turn(a, b, c) == 0.0 && (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]) >= 0.0
                } else {
                    meet(edge(i), edge(j))
                };
                let ([a, b], [c, d]) = (edge(i), edge(j));
                ensure!(
                    !crosses,
                    wrong(format!(
                        "crosses itself: its edge {} from {a:?} to {b:?} meets its edge {} from {c:?} to {d:?}; list the corners in order around it",
                        i + 1,
                        j + 1
                    ))
                );
            }
        }
        let polygon = Self { corners };
        ensure!(polygon.area() > 0.0, wrong("has no area".into()));
        Ok(polygon)
    }

    fn edges(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let n = self.corners.len();
        (0..n).map(move |k| [self.corners[k], self.corners[(k + 1) % n]])
    }

    /// Its area.
    #[must_use]
    pub fn area(&self) -> f64 {
        0.5 * self.edges().map(|[a, b]| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs()
    }

    /// The same polygon with all coordinates times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { corners: self.corners.iter().map(|c| c.map(|v| v * factor)).collect() }
    }

    /// The largest distance of a corner from the centre of the coordinates.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.corners.iter().map(|c| c[0].hypot(c[1])).fold(0.0, f64::max)
    }

    /// Distance of a point from the edge, negative inside, and the direction in which it grows.
    pub(super) fn depth(&self, p: [f64; 2]) -> (f64, [f64; 2]) {
        let (mut best, mut away, mut odd) = (f64::INFINITY, [0.0; 2], false);
        for [a, b] in self.edges() {
            let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let along = ((ap[0] * ab[0] + ap[1] * ab[1]) / (ab[0] * ab[0] + ab[1] * ab[1])).clamp(0.0, 1.0);
            let off = [ap[0] - along * ab[0], ap[1] - along * ab[1]];
            let distance = off[0].hypot(off[1]);
            if distance < best {
                best = distance;
                let length = ab[0].hypot(ab[1]);
                // On the edge itself the normal of the edge says where outside is, once the sign is known.
                away = if distance > 1e-12 * length { off.map(|v| v / distance) } else { [ab[1] / length, -ab[0] / length] };
            }
            if (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + ab[0] * (p[1] - a[1]) / ab[1] {
                odd = !odd;
            }
        }
        if odd { (-best, away.map(|v| -v)) } else { (best, away) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_negative_inside_and_its_direction_points_outwards() {
        let square = Polygon::new("a", vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]).unwrap();
        assert_eq!(square.area(), 4.0);
        assert_eq!(square.depth([1.9, 1.0]).0, -0.1_f64.abs() - 0.0 + (0.1 - (2.0 - 1.9)));
        let (d, away) = square.depth([1.75, 1.0]);
        assert!((d + 0.25).abs() < 1e-15 && away == [1.0, 0.0], "{d} {away:?}");
        let (d, away) = square.depth([5.0, 6.0]);
        assert!((d - 5.0).abs() < 1e-15 && (away[0] - 0.6).abs() < 1e-15 && (away[1] - 0.8).abs() < 1e-15);
    }

    #[test]
    fn a_polygon_that_crosses_itself_is_refused_with_its_edges() {
        let bow = Polygon::new("field", vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]).unwrap_err().to_string();
        assert!(bow.contains("polygon field crosses itself") && bow.contains("edge 1") && bow.contains("edge 3"), "{bow}");
        for wrong in [vec![[0.0, 0.0], [1.0, 0.0]], vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, 0.0]]]
        {
            assert!(Polygon::new("x", wrong).is_err());
        }
        // A spike: the second edge runs back over the first.
        assert!(Polygon::new("x", vec![[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]]).is_err());
    }
}
