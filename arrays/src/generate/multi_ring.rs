//! Concentric rings of equally growing radii. Each has elements in proportion to its radius.

use super::shape::{GOLDEN_ANGLE, Point, Shape, arm_angle, polar};
use crate::Result;

/// Fewest elements of a ring.
const LEAST: usize = 3;

pub fn has(s: &Shape) -> bool {
    s.elements >= LEAST * s.rings
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    let mut points = Vec::with_capacity(s.elements);
    for (ring, count) in shares(s.elements, s.rings).into_iter().enumerate() {
        let radius = (ring + 1) as f64 / s.rings as f64;
        // Rings that are turned against each other share no directions.
        let turn = GOLDEN_ANGLE * ring as f64;
        points.extend((0..count).map(|i| polar(radius, turn + arm_angle(i, count))));
    }
    Ok(points)
}

/// Elements of each ring: [`LEAST`], and the rest in proportion to the radius, where the rings with the largest remainders get one more.
fn shares(elements: usize, rings: usize) -> Vec<usize> {
    let (rest, total) = (elements - LEAST * rings, rings * (rings + 1) / 2);
    let mut out: Vec<usize> = (1..=rings).map(|r| LEAST + rest * r / total).collect();
    let mut order: Vec<usize> = (0..rings).collect();
    order.sort_by_key(|r| std::cmp::Reverse((rest * (r + 1) % total, *r)));
    let missing = elements - out.iter().sum::<usize>();
    order.into_iter().take(missing).for_each(|r| out[r] += 1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_share_the_elements_by_their_radius() {
        assert_eq!(shares(9, 3), [3, 3, 3]);
        assert_eq!(shares(21, 3), [5, 7, 9]);
        for n in 30..200 {
            let counts = shares(n, 5);
            assert_eq!(counts.iter().sum::<usize>(), n);
            assert!(counts.is_sorted(), "{counts:?}");
        }
    }
}
