//! Whether all numbers of an array are finite, on all threads.

use ndarray::{ArrayRef, Dimension};
use rayon::prelude::*;

/// Number of values that one task looks at.
const PART: usize = 1 << 16;

/// True if `number` of every value is finite.
pub(crate) fn all_finite<P: Copy + Sync, D: Dimension>(values: &ArrayRef<P, D>, number: impl Fn(P) -> f64 + Sync) -> bool {
    // Without an early end the compiler makes vector code of it. Nearly always all values are finite.
    let sound = |all: bool, v: &P| all & number(*v).is_finite();
    match values.as_slice_memory_order() {
        Some(all) => all.par_chunks(PART).all(|part| part.iter().fold(true, sound)),
        None => values.iter().fold(true, sound),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, s};

    #[test]
    fn one_value_that_is_not_finite_is_found_anywhere() {
        let sound = Array2::<f64>::ones((300, 300));
        assert!(all_finite(&sound, |v| v) && all_finite(&sound.slice(s![.., ..;3]), |v| v));
        for (at, bad) in [((0, 0), f64::NAN), ((299, 299), f64::INFINITY), ((150, 3), f64::NEG_INFINITY)] {
            let mut values = sound.clone();
            values[at] = bad;
            assert!(!all_finite(&values, |v| v) && !all_finite(&values.t(), |v| v));
            assert_eq!(all_finite(&values.slice(s![.., 1..299]), |v| v), at.1 != 3);
        }
    }
}
