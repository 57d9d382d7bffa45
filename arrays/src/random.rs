//! Random numbers that depend only on the seed, the purpose and the index. They do not depend on threads or on the size of blocks.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The stream of random numbers of one `purpose` (such as "thermal noise") and one `index` (such as a row) under a seed.
///
/// Different purposes have different keys, and different indices have different streams of the ChaCha cipher, so that no two overlap.
#[must_use]
pub fn stream(seed: u64, purpose: &str, index: u64) -> ChaCha8Rng {
    // FNV-1a is sufficient to distinguish a few names.
    let name = purpose.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    let mut key = [0_u8; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&name.to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(index);
    rng
}

/// A number from 0 up to, but not including, 1. Only the stream of bits decides it, so no release of a package changes it.
pub fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (0.5_f64).powi(53)
}

/// A whole number from 0 to `n` - 1, without the bias of a remainder.
///
/// # Reference
/// Lemire 2019, ACM TOMACS 29, 3.
pub fn below(rng: &mut ChaCha8Rng, n: usize) -> usize {
    let n = n.max(1) as u64;
    loop {
        let wide = u128::from(rng.next_u64()) * u128::from(n);
        if wide as u64 >= n.wrapping_neg() % n {
            return (wide >> 64) as usize;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seed_purpose_and_index_each_change_the_numbers() {
        let first = |seed, purpose, index| stream(seed, purpose, index).next_u64();
        let reference = first(1, "noise", 0);
        assert_eq!(reference, first(1, "noise", 0));
        for other in [first(2, "noise", 0), first(1, "phase", 0), first(1, "noise", 1)] {
            assert_ne!(reference, other);
        }
    }

    #[test]
    fn numbers_are_uniform_and_known() {
        let mut rng = stream(1, "layout", 0);
        let mean = (0..10_000).map(|_| uniform(&mut rng)).sum::<f64>() / 1e4;
        // The mean of 10,000 numbers has the standard deviation 1 / sqrt(12e4) = 0.0029.
        assert!((mean - 0.5).abs() < 0.012, "{mean}");
        let mut counts = [0; 7];
        (0..70_000).for_each(|_| counts[below(&mut rng, 7)] += 1);
        // Standard deviation sqrt(70,000 * 6 / 49) = 93.
        assert!(counts.iter().all(|c| (c - 10_000_i32).abs() < 400), "{counts:?}");
    }
}
