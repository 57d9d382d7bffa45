//! Arms whose marks are minimum-redundancy rulers: every whole distance up to the length of the ruler occurs, and the ruler is the longest
//! with this property.
//!
//! Rulers of up to 9 and of 13 marks are single finds. All others have the pattern of Wichmann, which reaches the longest known lengths from 10
//! marks on.
//!
//! # Reference
//! Leech 1956, J. London Math. Soc. 31, 160; Moffet 1968, IEEE Trans. Antennas Propag. 16, 172; Wichmann 1963, J. London Math. Soc. 38, 465;
//! Ishiguro 1980, Radio Science 15, 1163.

use super::shape::{Point, Shape, marks_per_arm, no_opposite_arms, on_arms};
use crate::Result;

/// Distances from mark to mark of the rulers without a pattern.
const SINGLE: [&[usize]; 9] = [
    &[1],
    &[1, 2],
    &[1, 3, 2],
    &[1, 3, 3, 2],
    &[1, 3, 1, 6, 2],
    &[1, 3, 6, 2, 3, 2],
    &[1, 3, 6, 6, 2, 3, 2],
    &[1, 3, 6, 6, 6, 2, 3, 2],
    &[1, 4, 3, 4, 9, 9, 9, 9, 5, 1, 2, 2],
];

pub fn has(s: &Shape) -> bool {
    marks_per_arm(s).is_some_and(|m| (2..=1000).contains(&m))
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    no_opposite_arms(s)?;
    Ok(on_arms(&ruler(marks_per_arm(s).unwrap_or(2)), s.arms))
}

fn ruler(marks: usize) -> Vec<usize> {
    let steps = match SINGLE.iter().find(|steps| steps.len() + 1 == marks) {
        Some(steps) => steps.to_vec(),
        None => (1..=marks / 4).filter_map(|r| wichmann(marks, r)).max_by_key(|steps| steps.iter().sum::<usize>()).unwrap_or_default(),
    };
    let ends = steps.iter().scan(0, |sum, step| {
        *sum += step;
        Some(*sum)
    });
    std::iter::once(0).chain(ends).collect()
}

/// The ruler 1^r, r + 1, (2r + 1)^r, (4r + 3)^s, (2r + 2)^(r + 1), 1^r of 4 r + s + 3 marks.
fn wichmann(marks: usize, r: usize) -> Option<Vec<usize>> {
    let s = marks.checked_sub(4 * r + 3)?;
    let parts = [(1, r), (r + 1, 1), (2 * r + 1, r), (4 * r + 3, s), (2 * r + 2, r + 1), (1, r)];
    Some(parts.iter().flat_map(|(step, times)| std::iter::repeat_n(*step, *times)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_distance_occurs_up_to_the_tabulated_length() {
        // OEIS A004137 for 2 to 26 marks.
        let longest = [1, 3, 6, 9, 13, 17, 23, 29, 36, 43, 50, 58, 68, 79, 90, 101, 112, 123, 138, 153, 168, 183, 198, 213, 232];
        for marks in (2..=40).chain([100]) {
            let r = ruler(marks);
            assert_eq!(r.len(), marks);
            let length = *r.last().unwrap();
            let mut seen = vec![false; length + 1];
            for (i, a) in r.iter().enumerate() {
                r[i + 1..].iter().for_each(|b| seen[b - a] = true);
            }
            assert!(seen[1..].iter().all(|s| *s), "{marks} marks have a hole");
            match longest.get(marks - 2) {
                Some(expected) => assert_eq!(length, *expected, "{marks} marks"),
                // Wichmann's rulers are at least n^2 / 3 long.
                None => assert!(3 * length >= marks * marks, "{marks} marks: {length}"),
            }
        }
    }
}
