//! The noise of an image from its median of absolute deviations, computed on all threads.

use ndarray::ArrayView2;
use rayon::prelude::*;
use std::borrow::Cow;

/// A list with fewer values is sorted by one thread.
const FEW: usize = 1 << 16;
/// Number of leading bits of a value that give its bin.
const BITS: u32 = 14;

/// Noise of an image that contains sources: 1.4826 times the median distance of the pixels from their median. A minority of bright pixels
/// hardly changes it. Pixels that are not finite are left out. The result is NaN if no pixel is finite.
///
/// # Reference
/// Rousseeuw & Croux 1993, J. Am. Stat. Assoc. 88, 1273, eq. 1.2.
#[must_use]
pub fn robust_rms<P: Copy + Into<f64> + Send + Sync>(plane: ArrayView2<'_, P>) -> f64 {
    let finite = |values: &[P]| values.par_iter().all(|v| (*v).into().is_finite());
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
    // The keys have the order of the numbers. Their leading bits are counted, then the next bits of those in the bin of the median, until few are
    // left to be sorted. A copy of one bin alone may be as large as a quarter of the image.
    let (mut start, mut shift, mut rank) = (0_u64, 64, n / 2);
    let inside = loop {
        let (begin, above) = (start, shift);
        let within = move |v: f64| above == 64 || key(v) >> above == begin >> above;
        shift -= BITS;
        let count = |mut counts: Vec<usize>, part: &[P]| {
            part.iter().map(f).filter(|v| within(*v)).for_each(|v| counts[(key(v) >> shift) as usize % (1 << BITS)] += 1);
            counts
        };
        let none = || vec![0_usize; 1 << BITS];
        let plus = |mut a: Vec<usize>, b: Vec<usize>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let counts = values.par_chunks(FEW).fold(none, count).reduce(none, plus);
        let mut wanted = 0;
        while rank >= counts[wanted] {
            rank -= counts[wanted];
            wanted += 1;
        }
        start |= (wanted as u64) << shift;
        if counts[wanted] < FEW || shift < BITS {
            break move |v: &f64| key(*v) >> shift == start >> shift;
        }
    };
    let mut all: Vec<f64> = values.par_iter().map(f).filter(&inside).collect();
    let before = || values.par_iter().map(f).filter(|v| key(*v) < start).reduce(|| f64::NEG_INFINITY, f64::max);
    middle(&mut all, rank, n.is_multiple_of(2), before)
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

/// The bits of a number, changed so that they have the order of the numbers.
fn key(v: f64) -> u64 {
    let bits = v.to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
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
        // Halves of two values: the middle lies between them.
        let two: Vec<f64> = (0..2 * FEW).map(|k| if k % 2 == 0 { -1.0 } else { 3.0 }).collect();
        assert_eq!(median(&two, |v| v), 1.0);
    }
}
