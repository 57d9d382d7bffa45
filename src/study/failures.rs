//! What the failure of each antenna costs.

use super::score::{Quality, Score};
use super::summary::summarize;

/// What the failure of an antenna costs.
#[derive(Debug, Clone, PartialEq)]
pub struct AntennaCost {
    /// Index of the antenna in the list that was given.
    pub antenna: usize,
    /// Mean over the seeds of the loss of the score: positive where the image gets worse.
    pub cost: f64,
    /// Standard error of that mean; NaN for one seed.
    pub error: f64,
    /// Number of seeds with a score for both images.
    pub n: usize,
}

/// Rank antennas by their costs, the largest first. `whole` are the trials with all antennas \[seed\], `without` those with one of them
/// silent \[antenna\]\[seed\]. Both have the same errors in each seed, so only the differences of a seed scatter.
#[must_use]
pub fn rank(score: Score, whole: &[Option<Quality>], without: &[Vec<Option<Quality>>]) -> Vec<AntennaCost> {
    let sign = if score.larger_is_better() { 1.0 } else { -1.0 };
    let loss = |(a, b): (&Option<Quality>, &Option<Quality>)| Some(sign * ((*a)?.of(score) - (*b)?.of(score)));
    let cost = |(antenna, trials): (usize, &Vec<Option<Quality>>)| {
        let s = summarize(whole.iter().zip(trials).filter_map(loss));
        AntennaCost { antenna, cost: s.mean, error: s.std / (s.n as f64).sqrt(), n: s.n }
    };
    let mut all: Vec<AntennaCost> = without.iter().enumerate().map(cost).collect();
    // An antenna whose failure leaves no score is worse than any number.
    let key = |c: &AntennaCost| if c.cost.is_nan() { f64::INFINITY } else { c.cost };
    all.sort_by(|a, b| key(b).total_cmp(&key(a)).then(a.antenna.cmp(&b.antenna)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_differences_of_the_same_seed() {
        let of = |x: f64| Some(Quality { nrmse: x, fidelity: 1.0 / x, ..Quality::from_values([f64::NAN; 7]) });
        let whole = [of(0.1), of(0.3), of(0.5)];
        let without = [vec![of(0.2), of(0.4), of(0.6)], vec![None; 3], vec![of(0.3), of(0.6), of(0.6)]];
        let ranked = rank(Score::Nrmse, &whole, &without);
        assert_eq!(ranked.iter().map(|c| c.antenna).collect::<Vec<_>>(), [1, 2, 0]);
        assert!((ranked[2].cost - 0.1).abs() < 1e-12 && ranked[2].error < 1e-12 && ranked[0].n == 0);
        // Losses 0.2, 0.3, 0.1: standard deviation 0.1.
        assert!((ranked[1].cost - 0.2).abs() < 1e-12 && (ranked[1].error - 0.1 / 3.0_f64.sqrt()).abs() < 1e-12);
        // A larger fidelity is better.
        assert!(rank(Score::Fidelity, &whole, &without)[1].cost > 0.0);
    }
}
