//! Numbers of baselines: every pair p < q of n antennas has one index.

/// Number of pairs of `n` antennas.
pub(crate) fn n_pairs(n: usize) -> usize {
    n * n.saturating_sub(1) / 2
}

/// Index of the pair p < q among the pairs of `n` antennas.
pub(crate) fn pair_index(n: usize, p: usize, q: usize) -> usize {
    p * (2 * n - p - 1) / 2 + q - p - 1
}

/// All pairs p < q of `n` antennas, in the order of [`pair_index`].
pub(crate) fn pairs_of(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |p| (p + 1..n).map(move |q| (p, q)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_numbered_without_gaps() {
        let n = 7;
        assert!(pairs_of(n).enumerate().all(|(i, (p, q))| pair_index(n, p, q) == i));
        assert_eq!(pairs_of(n).count(), n_pairs(n));
    }
}
