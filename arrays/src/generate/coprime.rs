//! Arms with two uniform lines whose spacings have no common factor.
//!
//! N marks stand at multiples of M and 2 M marks at multiples of N, the mark 0 shared. The distances 0 to M N + M - 1 all occur.
//!
//! # Reference
//! Vaidyanathan & Pal 2011, IEEE Trans. Signal Process. 59, 573; Pal & Vaidyanathan 2011, Proc. DSP/SPE Workshop, 289 (the extended array).

use super::shape::{Point, Shape, marks_per_arm, no_opposite_arms, on_arms};
use crate::Result;

pub fn has(s: &Shape) -> bool {
    marks_per_arm(s).is_some_and(|m| pair(m).is_some())
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    no_opposite_arms(s)?;
    let (m, n) = marks_per_arm(s).and_then(pair).unwrap_or((1, 1));
    Ok(on_arms(&marks(m, n), s.arms))
}

fn marks(m: usize, n: usize) -> Vec<usize> {
    let mut marks: Vec<usize> = (0..n).map(|i| i * m).chain((1..2 * m).map(|i| i * n)).collect();
    marks.sort_unstable();
    marks
}

/// The coprime M < N with N + 2 M - 1 marks that reach farthest without a hole.
fn pair(marks: usize) -> Option<(usize, usize)> {
    (2..marks / 2).map(|m| (m, marks + 1 - 2 * m)).filter(|(m, n)| m < n && common_factor(*m, *n) == 1).max_by_key(|(m, n)| m * n + m)
}

fn common_factor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_factor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_have_no_hole_up_to_the_length_of_theory() {
        let mut tested = 0;
        for count in 2..60 {
            let Some((m, n)) = pair(count) else { continue };
            let marks = marks(m, n);
            assert_eq!(marks.len(), count);
            let mut seen = vec![false; 2 * m * n];
            marks.iter().for_each(|a| marks.iter().filter(|b| *b >= a).for_each(|b| seen[b - a] = true));
            assert!(seen[..m * n + m].iter().all(|s| *s), "{count} marks, M = {m}, N = {n}");
            tested += 1;
        }
        assert!(tested > 50, "{tested}");
        assert_eq!((pair(5), pair(6), pair(7)), (None, Some((2, 3)), None));
    }
}
