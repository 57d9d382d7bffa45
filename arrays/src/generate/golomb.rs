//! Arms whose marks are Golomb rulers: no two pairs of marks have the same distance.
//!
//! Up to 27 marks the rulers are the shortest that exist. Longer ones are cut out of Singer's difference sets: short, but not proven to be
//! the shortest.
//!
//! # Reference
//! Babcock 1953, Bell Syst. Tech. J. 32, 63. The optimal rulers to order 27 are those of Shearer 1990 (to 16), Sibert 1993 (17, 18), Dollas,
//! Rankin & McCracken 1998, IEEE Trans. Inf. Theory 44, 379 (19), and the searches of distributed.net (24 to 27, 2004 to 2014).

use super::shape::{Point, Shape, marks_per_arm, no_opposite_arms, on_arms};
use super::singer;
use crate::Result;

/// The shortest rulers of 2 to 27 marks.
const OPTIMAL: [&[usize]; 26] = [
    &[0, 1],
    &[0, 1, 3],
    &[0, 1, 4, 6],
    &[0, 1, 4, 9, 11],
    &[0, 1, 4, 10, 12, 17],
    &[0, 1, 4, 10, 18, 23, 25],
    &[0, 1, 4, 9, 15, 22, 32, 34],
    &[0, 1, 5, 12, 25, 27, 35, 41, 44],
    &[0, 1, 6, 10, 23, 26, 34, 41, 53, 55],
    &[0, 1, 4, 13, 28, 33, 47, 54, 64, 70, 72],
    &[0, 2, 6, 24, 29, 40, 43, 55, 68, 75, 76, 85],
    &[0, 2, 5, 25, 37, 43, 59, 70, 85, 89, 98, 99, 106],
    &[0, 4, 6, 20, 35, 52, 59, 77, 78, 86, 89, 99, 122, 127],
    &[0, 4, 20, 30, 57, 59, 62, 76, 100, 111, 123, 136, 144, 145, 151],
    &[0, 1, 4, 11, 26, 32, 56, 68, 76, 115, 117, 134, 150, 163, 168, 177],
    &[0, 5, 7, 17, 52, 56, 67, 80, 81, 100, 122, 138, 159, 165, 168, 191, 199],
    &[0, 2, 10, 22, 53, 56, 82, 83, 89, 98, 130, 148, 153, 167, 188, 192, 205, 216],
    &[0, 1, 6, 25, 32, 72, 100, 108, 120, 130, 153, 169, 187, 190, 204, 231, 233, 242, 246],
    &[0, 1, 8, 11, 68, 77, 94, 116, 121, 156, 158, 179, 194, 208, 212, 228, 240, 253, 259, 283],
    &[0, 2, 24, 56, 77, 82, 83, 95, 129, 144, 179, 186, 195, 255, 265, 285, 293, 296, 310, 329, 333],
    &[0, 1, 9, 14, 43, 70, 106, 122, 124, 128, 159, 179, 204, 223, 253, 263, 270, 291, 330, 341, 353, 356],
    &[0, 3, 7, 17, 61, 66, 91, 99, 114, 159, 171, 199, 200, 226, 235, 246, 277, 316, 329, 348, 350, 366, 372],
    &[0, 9, 33, 37, 38, 97, 122, 129, 140, 142, 152, 191, 205, 208, 252, 278, 286, 326, 332, 353, 368, 384, 403, 425],
    &[0, 12, 29, 39, 72, 91, 146, 157, 160, 161, 166, 191, 207, 214, 258, 290, 316, 354, 372, 394, 396, 431, 459, 467, 480],
    &[0, 1, 33, 83, 104, 110, 124, 163, 185, 200, 203, 249, 251, 258, 314, 318, 343, 356, 386, 430, 440, 456, 464, 475, 487, 492],
    &[0, 3, 15, 41, 66, 95, 97, 106, 142, 152, 220, 221, 225, 242, 295, 330, 338, 354, 382, 388, 402, 415, 486, 504, 523, 546, 553],
];

/// Most marks of an arm. The widest ruler is found among a million places.
const MOST: usize = 1000;

pub fn has(s: &Shape) -> bool {
    marks_per_arm(s).is_some_and(|m| (2..=MOST).contains(&m))
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    no_opposite_arms(s)?;
    Ok(on_arms(&marks_per_arm(s).and_then(ruler).unwrap_or_default(), s.arms))
}

/// A Golomb ruler of so many marks, at least 2.
fn ruler(marks: usize) -> Option<Vec<usize>> {
    if (2..=27).contains(&marks) {
        return Some(OPTIMAL[marks - 2].to_vec());
    }
    // No two differences of a difference set are the same, even modulo v, so any run of its marks is a ruler. The shortest run is taken.
    let size = (marks..2 * marks).find(|size| singer::has_set(*size))?;
    let (set, v) = (singer::difference_set(size)?, singer::modulus(size));
    let at = |k: usize| set[k % size] + if k >= size { v } else { 0 };
    let first = (0..size).min_by_key(|k| at(k + marks - 1) - at(*k))?;
    Some((first..first + marks).map(|k| at(k) - at(first)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_distance_repeats_and_the_lengths_are_the_tabulated_ones() {
        // OEIS A003022.
        let lengths = [1, 3, 6, 11, 17, 25, 34, 44, 55, 72, 85, 106, 127, 151, 177, 199, 216, 246, 283, 333, 356, 372, 425, 480, 492, 553];
        for marks in (2..=60).chain([100, 200]) {
            let r = ruler(marks).unwrap();
            assert_eq!(r.len(), marks);
            let length = *r.last().unwrap();
            let mut seen = vec![false; length + 1];
            for (i, a) in r.iter().enumerate() {
                for b in &r[i + 1..] {
                    assert!(!std::mem::replace(&mut seen[b - a], true), "{marks} marks: {} repeats", b - a);
                }
            }
            match lengths.get(marks - 2) {
                Some(expected) => assert_eq!(length, *expected, "{marks} marks"),
                // A set of q + 1 marks lies within q^2 + q, and its widest gap is outside.
                None => assert!(length < 2 * marks * marks, "{marks} marks: {length}"),
            }
        }
    }
}
