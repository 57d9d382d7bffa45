//! Random numbers that depend only on the seed, the purpose and the index. They do not depend on threads or on the size of blocks.

use rand::SeedableRng;
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn seed_purpose_and_index_each_change_the_numbers() {
        let first = |seed, purpose, index| stream(seed, purpose, index).next_u64();
        let reference = first(1, "noise", 0);
        assert_eq!(reference, first(1, "noise", 0));
        for other in [first(2, "noise", 0), first(1, "phase", 0), first(1, "noise", 1)] {
            assert_ne!(reference, other);
        }
    }
}
