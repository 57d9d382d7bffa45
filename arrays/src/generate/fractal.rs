//! Arrays that repeat a small pattern at every scale.
//!
//! # Reference
//! Kim & Jaggard 1986, Proc. IEEE 74, 1278 (random fractal arrays); Puente-Baliarda & Pous 1996, IEEE Trans. Antennas Propag. 44, 730
//! (Sierpinski and Koch arrays).

use super::shape::{Point, Shape, arm_angle, polar};
use crate::random::{stream, uniform};
use crate::{ArrayError, Result};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// A pattern of the next smaller scale is smaller by this factor, so that neighbouring patterns do not touch.
const SHRINK: f64 = 1.0 / 3.0;

/// The power of `base` that gives `n`, at least 1.
fn level(base: usize, n: usize) -> Option<u32> {
    (1..64).take_while(|k| base.checked_pow(*k).is_some_and(|p| p <= n)).find(|k| base.pow(*k) == n)
}

/// Powers of 3.
pub fn has_sierpinski(s: &Shape) -> bool {
    level(3, s.elements).is_some()
}

/// The middles of the triangles that remain of a triangle after each level.
pub fn sierpinski(s: &Shape) -> Result<Vec<Point>> {
    let mut points = vec![[0.0; 2]];
    let mut size = 1.0;
    for _ in 0..level(3, s.elements).unwrap_or(0) {
        points = points
            .iter()
            .flat_map(|p| {
                (0..3).map(move |k| {
                    let [x, y] = polar(size, arm_angle(k, 3));
                    [p[0] + x, p[1] + y]
                })
            })
            .collect();
        size /= 2.0;
    }
    Ok(points)
}

/// 3, or 3 times a power of 4.
pub fn has_koch(s: &Shape) -> bool {
    s.elements == 3 || (s.elements.is_multiple_of(3) && level(4, s.elements / 3).is_some())
}

/// The corners of Koch's snowflake.
pub fn koch(s: &Shape) -> Result<Vec<Point>> {
    let mut points: Vec<Point> = (0..3).map(|k| polar(1.0, arm_angle(k, 3))).collect();
    while points.len() < s.elements {
        let next = |i: usize| points[(i + 1) % points.len()];
        // Each side gets a triangle on its middle third. The corners run clockwise, so outside is to the left.
        points = (0..points.len())
            .flat_map(|i| {
                let ([ax, ay], [bx, by]) = (points[i], next(i));
                let (dx, dy) = ((bx - ax) / 3.0, (by - ay) / 3.0);
                let height = libm::sqrt(3.0) / 2.0;
                let peak = [ax + 1.5 * dx - height * dy, ay + 1.5 * dy + height * dx];
                [[ax, ay], [ax + dx, ay + dy], peak, [ax + 2.0 * dx, ay + 2.0 * dy]]
            })
            .collect();
    }
    Ok(points)
}

/// Powers of the number of branches.
pub fn has_random(s: &Shape) -> bool {
    s.arms >= 2 && level(s.arms, s.elements).is_some()
}

/// A regular polygon, each of whose corners becomes a smaller polygon turned by a random angle, and so on.
pub fn random(s: &Shape) -> Result<Vec<Point>> {
    // The polygons around two neighbouring corners of a hexagon would touch.
    ArrayError::need("arms", s.arms, (2..=5).contains(&s.arms), "2 to 5 branches")?;
    let mut rng = stream(s.seed, "random fractal", 0);
    let mut points = Vec::with_capacity(s.elements);
    grow([0.0; 2], 1.0, level(s.arms, s.elements).unwrap_or(0), s.arms, &mut rng, &mut points);
    Ok(points)
}

fn grow(centre: Point, size: f64, levels: u32, branches: usize, rng: &mut ChaCha8Rng, points: &mut Vec<Point>) {
    if levels == 0 {
        points.push(centre);
        return;
    }
    let turn = TAU * uniform(rng);
    for k in 0..branches {
        let [x, y] = polar(size, turn + arm_angle(k, branches));
        grow([centre[0] + x, centre[1] + y], size * SHRINK, levels - 1, branches, rng, points);
    }
}
