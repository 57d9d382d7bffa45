//! The noise of an image from its median of absolute deviations, computed on all threads.

use ndarray::ArrayView2;
use rayon::prelude::*;
use std::borrow::Cow;

/// A list with at most so many values is sorted by one thread.
const FEW: usize = 1 << 16;
/// Of a list with at most so many values, those near the median are copied in the first pass.
const MANY: usize = 1 << 24;
/// Most values near the median that are copied out of each [`FEW`] values.
const MOST_FOUND: usize = FEW / 4;
/// Values that are compared with a range at once.
const AT_ONCE: usize = 8;
/// Number of values that show where the median lies. More of them show it more narrowly in a long list.
const SAMPLE: usize = 4096;

/// Noise of an image that contains sources: 1.4826 times the median distance of the pixels from their median. A minority of bright pixels
/// hardly changes it. Pixels that are not finite are left out. The result is NaN if no pixel is finite.
///
/// # Reference
/// Rousseeuw & Croux 1993, J. Am. Stat. Assoc. 88, 1273, eq. 1.2.
#[must_use]
pub fn robust_rms<P: Copy + Into<f64> + Send + Sync>(plane: ArrayView2<'_, P>) -> f64 {
    let finite = |values: &[P]| values.par_chunks(FEW).all(|part| part.iter().fold(true, |all, v| all & (*v).into().is_finite()));
    let values = match plane.to_slice() {
        Some(all) if finite(all) => Cow::Borrowed(all),
        _ => Cow::Owned(plane.iter().copied().filter(|v| (*v).into().is_finite()).collect()),
    };
    let center = median(&values, |v| v);
    1.482_602_218_505_602 * median(&values, |v| (v - center).abs())
}

/// The median of a function of finite values: for an even number of values the mean of the two in the middle. NaN for an empty list.
fn median<P: Copy + Into<f64> + Send + Sync>(values: &[P], f: impl Fn(f64) -> f64 + Sync) -> f64 {
    let f = |v: &P| f((*v).into());
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    if n < FEW {
        let mut all: Vec<f64> = values.iter().map(f).collect();
        return middle(&mut all, n / 2, n.is_multiple_of(2), || f64::NAN);
    }
    // A sample shows a narrow range in which the value of this rank lies, and a pass over all values whether the sample was right. A copy of all values
    // would take as much memory as the image.
    let (rank, even, all) = (n / 2, n.is_multiple_of(2), (f64::NEG_INFINITY, f64::INFINITY));
    let narrow = || within(values, f, around(&mut sample(values, f, all, SAMPLE * (n / FEW).isqrt()), 0.5));
    if n <= MANY
        && let Some((mut found, below)) = narrow()
        && (below + 1..below + found.len()).contains(&rank)
    {
        return middle(&mut found, rank - below, even, || f64::NAN);
    }
    // The value lies in `range`, and `below` values lie below the range.
    let (mut range, mut below, mut inside) = (all, 0, n);
    while inside > FEW && range.0 < range.1 {
        let mut sample = sample(values, f, range, SAMPLE * n.div_ceil(inside));
        let near = around(&mut sample, (rank - below) as f64 / inside as f64);
        // Where half of the values are the same, a sample is not narrower than the range. Its middle divides the range in any case.
        let (low, high) = if near.0 <= range.0 && near.1 >= range.1 {
            let half = sample.len() / 2;
            (nth(&mut sample, half), nth(&mut sample, half))
        } else {
            near
        };
        let count = |(less, not_more): (usize, usize), v: f64| (less + usize::from(v < low), not_more + usize::from(v <= high));
        let counts = values.par_chunks(FEW).map(|part| part.iter().map(f).fold((0, 0), count));
        let (less, not_more) = counts.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        (range, below, inside) = if rank < less {
            ((range.0, low.next_down()), below, less - below)
        } else if rank < not_more {
            ((low.max(range.0), high.min(range.1)), less, not_more - less)
        } else {
            ((high.next_up(), range.1), not_more, below + inside - not_more)
        };
    }
    let before = || values.par_iter().map(f).filter(|v| *v < range.0).reduce(|| f64::NEG_INFINITY, f64::max);
    if range.0 == range.1 {
        let lower = if !even || rank > below { range.0 } else { before() };
        return 0.5 * (range.0 + lower);
    }
    let mut all: Vec<f64> = values.par_iter().map(f).filter(|v| (range.0..=range.1).contains(v)).collect();
    middle(&mut all, rank - below, even, before)
}

/// The values in a range, and how many lie below it. `None` where there are too many.
fn within<P: Copy + Sync>(values: &[P], f: impl Fn(&P) -> f64 + Sync, (low, high): (f64, f64)) -> Option<(Vec<f64>, usize)> {
    let inside = |v: f64| (v >= low) & (v <= high);
    let of_part = |part: &[P]| {
        let (mut found, mut below) = (Vec::new(), 0);
        let (whole, rest) = part.as_chunks::<AT_ONCE>();
        // Few values lie in the range. A look at several at once takes a fraction of the time of one after the other.
        for few in whole {
            let (mut any, mut less) = (false, 0);
            for v in few {
                any |= inside(f(v));
                less += u64::from(f(v) < low);
            }
            below += less as usize;
            if any {
                found.extend(few.iter().map(&f).filter(|v| inside(*v)));
                if found.len() > MOST_FOUND {
                    return None;
                }
            }
        }
        found.extend(rest.iter().map(&f).filter(|v| inside(*v)));
        below += rest.iter().filter(|v| f(v) < low).count();
        (found.len() <= MOST_FOUND).then_some((found, below))
    };
    let parts: Option<Vec<_>> = values.par_chunks(FEW).map(of_part).collect();
    let parts = parts?;
    let below = parts.iter().map(|p| p.1).sum();
    Some((parts.into_iter().flat_map(|p| p.0).collect(), below))
}

/// Those of so many draws that lie in a range. They are spread over the list like random numbers, because images have rows.
fn sample<P: Copy + Sync>(values: &[P], f: impl Fn(&P) -> f64 + Sync, range: (f64, f64), draws: usize) -> Vec<f64> {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15; // the golden ratio
    let n = values.len() as u128;
    let place = |k: usize| ((u128::from((k as u64).wrapping_mul(STEP)) * n) >> 64) as usize;
    // Each draw waits for the memory: several threads wait for several.
    let drawn = (0..draws).into_par_iter().with_min_len(SAMPLE).map(|k| f(&values[place(k + 1)]));
    let mut sample: Vec<f64> = drawn.filter(|v| (range.0..=range.1).contains(v)).collect();
    if sample.is_empty() {
        sample.extend(values.iter().map(f).find(|v| (range.0..=range.1).contains(v)));
    }
    sample
}

/// The value of this rank in a sample.
fn nth(sample: &mut [f64], rank: usize) -> f64 {
    *sample.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Values of a sample between which this part of all values ends: four standard deviations to either side.
fn around(sample: &mut [f64], part: f64) -> (f64, f64) {
    let (n, middle) = (sample.len() as f64, part * sample.len() as f64);
    let mut at = |x: f64| match x {
        x if x < 0.0 => f64::NEG_INFINITY,
        x if x as usize >= sample.len() => f64::INFINITY,
        x => nth(sample, x as usize),
    };
    (at(middle - 2.0 * n.sqrt()), at(middle + 2.0 * n.sqrt()))
}

/// The value of rank `rank`, or its mean with the value before it. If that value is not in the list, `before` gives it.
fn middle(values: &mut [f64], rank: usize, mean: bool, before: impl Fn() -> f64) -> f64 {
    let (low, upper, _) = values.select_nth_unstable_by(rank, f64::total_cmp);
    let upper = *upper;
    if !mean {
        return upper;
    }
    let lower = low.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (upper + if rank > 0 { lower } else { before() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn the_robust_rms_does_not_see_a_few_bright_pixels() {
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = crate::random::stream(3, "fidelity", 0);
        let mut plane = Array2::from_shape_simple_fn((128, 128), || StandardNormal.sample(&mut rng));
        for k in 0..60 {
            plane[[2 * k, k]] = 1000.0;
        }
        // One per cent from 16,384 numbers, and the bright 0.4 per cent shift the median by as much.
        assert!((robust_rms(plane.view()) - 1.0).abs() < 0.03, "{}", robust_rms(plane.view()));
    }

    #[test]
    fn many_values_have_the_median_of_few() {
        let mut noise = crate::fixtures::Noise(5);
        for n in [FEW, FEW + 1, 2 * FEW + 3] {
            let mut values: Vec<f64> = (0..n).map(|_| noise.next() * noise.next() * 1e-3).collect();
            let found = median(&values, |v| v);
            values.sort_by(f64::total_cmp);
            let expected = if n % 2 == 1 { values[n / 2] } else { 0.5 * (values[n / 2 - 1] + values[n / 2]) };
            assert_eq!(found, expected, "{n}");
        }
        // Few different values, one of which is most frequent, and values that grow along the list.
        let n = 5 * FEW;
        let cases: [&dyn Fn(usize) -> f64; 6] = [
            &|_| 2.5,
            &|k| (k % 3) as f64,
            &|k| if k % 16 == 0 { k as f64 } else { 0.0 },
            &|k| k as f64,
            &|k| -1.0 / (1 + k) as f64,
            &|k| (k * k % 4099) as f64,
        ];
        for case in cases {
            for n in [n, n + 1] {
                let mut values: Vec<f64> = (0..n).map(case).collect();
                let found = median(&values, |v| v);
                values.sort_by(f64::total_cmp);
                assert_eq!(found, if n % 2 == 1 { values[n / 2] } else { 0.5 * (values[n / 2 - 1] + values[n / 2]) });
            }
        }
        // Halves of two values: the middle lies between them.
        let two: Vec<f64> = (0..2 * FEW).map(|k| if k % 2 == 0 { -1.0 } else { 3.0 }).collect();
        assert_eq!(median(&two, |v| v), 1.0);
    }
}
