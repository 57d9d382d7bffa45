//! Elements at the numbers of a perfect difference set, on a ring, on a line, or folded onto a grid.
//!
//! Modulo v every distance occurs once. If v = a b with factors that have no common divisor, i -> (i mod a, i mod b) carries this over to
//! two dimensions: modulo a and b every step across the grid occurs once.
//!
//! # Reference
//! Singer 1938, Trans. Amer. Math. Soc. 43, 377; Leeper 1999, IEEE Trans. Antennas Propag. 47, 247 (thinned arrays); MacWilliams & Sloane
//! 1976, Proc. IEEE 64, 1715 (folding).

use super::shape::{Point, Shape, arm_angle, polar};
use super::singer::{difference_set, has_set, modulus};
use crate::Result;

pub fn has(s: &Shape) -> bool {
    s.elements <= 1000 && has_set(s.elements)
}

/// The sizes whose modulus can be folded.
pub fn has_grid(s: &Shape) -> bool {
    has(s) && sides(modulus(s.elements)).is_some()
}

/// On v places of a circle.
pub fn ring(s: &Shape) -> Result<Vec<Point>> {
    let v = modulus(s.elements);
    Ok(set(s).map(|i| polar(1.0, arm_angle(i, v))).collect())
}

/// On a line, with the widest gap of the circle beyond its ends.
pub fn line(s: &Shape) -> Result<Vec<Point>> {
    Ok(set(s).map(|i| [i as f64, 0.0]).collect())
}

/// On a grid of a times b places.
pub fn grid(s: &Shape) -> Result<Vec<Point>> {
    let (a, b) = sides(modulus(s.elements)).unwrap_or((1, 1));
    Ok(set(s).map(|i| [(i % b) as f64, (i % a) as f64]).collect())
}

fn set(s: &Shape) -> impl Iterator<Item = usize> {
    difference_set(s.elements).unwrap_or_default().into_iter()
}

/// Factors a < b of v without a common divisor, as equal as possible.
fn sides(v: usize) -> Option<(usize, usize)> {
    fn common(a: usize, b: usize) -> usize {
        if b == 0 { a } else { common(b, a % b) }
    }
    (2..).take_while(|a| a * a < v).filter(|a| v.is_multiple_of(*a) && common(*a, v / a) == 1).last().map(|a| (a, v / a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::GenerateOptions;
    use crate::quantity::Length;

    #[test]
    fn every_step_across_the_grid_comes_once() {
        for n in [5, 8, 10, 12, 17, 20, 32] {
            let s = Shape::of("t", &[], &GenerateOptions::new(n, Length(1.0))).unwrap();
            assert!(has_grid(&s));
            let (a, b) = sides(modulus(n)).unwrap();
            let p: Vec<[usize; 2]> = grid(&s).unwrap().iter().map(|p| [p[0] as usize, p[1] as usize]).collect();
            let mut seen = vec![0; a * b];
            for x in &p {
                for y in p.iter().filter(|y| *y != x) {
                    seen[(x[1] + a - y[1]) % a * b + (x[0] + b - y[0]) % b] += 1;
                }
            }
            assert!(seen[0] == 0 && seen[1..].iter().all(|n| *n == 1), "{n}");
        }
        // 31 places are a prime number.
        assert!(!has_grid(&Shape::of("t", &[], &GenerateOptions::new(6, Length(1.0))).unwrap()));
    }
}
