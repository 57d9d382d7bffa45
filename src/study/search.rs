//! Finds the limit of a parameter up to which trials keep a score.
//!
//! The trials of one seed at different values have the same errors with another size. Each seed therefore has a threshold of its own, beyond
//! which it misses the score. A search brackets these thresholds between the values that were tried, and asks for trials in the middle of
//! the brackets that matter. The answer is a quantile of the thresholds: half of the seeds keep the score up to their median.

use super::quantile::{Bracket, Estimate, Place, enough_seeds, estimate, unresolved};
use super::question::Question;
use super::trial::TrialResult;

/// One trial: its value, and whether it keeps the score.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tried {
    value: f64,
    kept: bool,
}

/// The trials of one question at one place of the other axes, for images before or after self-calibration.
#[derive(Debug, Clone)]
pub struct Search<'a> {
    question: &'a Question,
    /// Trials of each seed by ascending value \[seed\].
    tried: Vec<Vec<Tried>>,
    after: bool,
}

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The limit of the parameter.
    pub limit: Estimate,
    /// True if larger values of the parameter are better: the limit is then the smallest value that keeps the score.
    pub rising: bool,
    /// Fraction of the seeds of which some value beyond the limit keeps the score again.
    pub contradictions: f64,
    /// The seeds that the wanted precision needs, where there are too few.
    pub seeds_needed: Option<usize>,
}

impl<'a> Search<'a> {
    /// A search without trials. `after` judges the images after self-calibration.
    #[must_use]
    pub fn new(question: &'a Question, seeds: usize, after: bool) -> Self {
        Self { question, tried: vec![Vec::new(); seeds], after }
    }

    /// Add a trial of the seed with this index.
    pub fn add(&mut self, seed: usize, value: f64, result: &TrialResult) {
        let quality = if self.after { result.after } else { Some(result.before) };
        let kept = quality.is_some_and(|q| self.question.bound.kept(&q));
        let list = &mut self.tried[seed];
        let at = list.partition_point(|t| t.value < value);
        list.insert(at, Tried { value, kept });
    }

    /// The seeds (by index) and values of the trials that are needed next; none if the answer is found.
    #[must_use]
    pub fn next(&self) -> Vec<(usize, f64)> {
        let rising = self.rising();
        let brackets = self.brackets(rising);
        let ends = |b: &Bracket| if rising { (-b.high, -b.low) } else { (b.low, b.high) };
        let open = |b: &Bracket| {
            let (low, high) = ends(b);
            let (low, high) = (self.value(low), self.value(high));
            low.is_finite() && high.is_finite() && self.question.too_wide(low, high) && self.question.between(low, high).is_some()
        };
        let middle = |k: usize| {
            let (low, high) = ends(&brackets[k]);
            self.question.between(self.value(low), self.value(high)).map(|v| (k, v))
        };
        unresolved(&brackets, self.level(), open).into_iter().filter_map(middle).collect()
    }

    /// The answer by the trials so far.
    #[must_use]
    pub fn answer(&self) -> Answer {
        let rising = self.rising();
        let found = estimate(&self.brackets(rising), self.level());
        let place = |p: Place| match p {
            Place::At(x) => Place::At(self.kept_at(self.value(if rising { -x } else { x }), rising)),
            Place::Below if rising => Place::Above,
            Place::Above if rising => Place::Below,
            other => other,
        };
        let (low, high) = if rising { (found.high, found.low) } else { (found.low, found.high) };
        let limit = Estimate { value: place(found.value), low: low.map(place), high: high.map(place) };
        let again = self.tried.iter().filter(|t| step(&ordered(t, rising)).1 > 0).count();
        Answer { limit, rising, contradictions: again as f64 / self.tried.len() as f64, seeds_needed: self.seeds_needed(&limit) }
    }

    /// Level of the quantile: this part of the thresholds lies below the answer.
    fn level(&self) -> f64 {
        1.0 - self.question.fraction
    }

    fn value(&self, scaled: f64) -> f64 {
        if self.question.log && scaled.is_finite() { scaled.exp() } else { scaled }
    }

    /// The last value that keeps the score. A threshold of whole numbers lies between two of them.
    fn kept_at(&self, value: f64, rising: bool) -> f64 {
        match (self.question.whole, rising) {
            (false, _) => value,
            (true, false) => value.floor(),
            (true, true) => value.ceil(),
        }
    }

    /// True if more seeds keep the score at the largest value than at the smallest.
    fn rising(&self) -> bool {
        let kept = |pick: fn(&[Tried]) -> Option<&Tried>| self.tried.iter().filter(|t| pick(t).is_some_and(|t| t.kept)).count();
        kept(|t| t.last()) > kept(|t| t.first())
    }

    /// The brackets of the thresholds, on the scale of the question. If larger values are better, the scale is reversed.
    fn brackets(&self, rising: bool) -> Vec<Bracket> {
        let one = |tried: &Vec<Tried>| {
            let tried = ordered(tried, rising);
            let at = step(&tried).0;
            let scaled = |t: &Tried| if rising { -self.question.scale(t.value) } else { self.question.scale(t.value) };
            let low = at.checked_sub(1).map_or(f64::NEG_INFINITY, |k| scaled(&tried[k]));
            let high = tried.get(at).map_or(f64::INFINITY, scaled);
            Bracket { low, high }
        };
        self.tried.iter().map(one).collect()
    }

    /// The seeds that the precision needs, if those of the study do not give it.
    fn seeds_needed(&self, limit: &Estimate) -> Option<usize> {
        let n = self.tried.len();
        let least = enough_seeds(self.level());
        let number = |p: Option<Place>| p.and_then(Place::number);
        match (limit.value.number(), number(limit.low), number(limit.high)) {
            (Some(_), ..) if n < least => Some(least),
            (Some(value), Some(low), Some(high)) => {
                let found = 0.5 * (high - low) / value.abs();
                // The width falls with the square root of the number of seeds.
                let needed = n as f64 * (found / self.question.precision).powi(2);
                (found > self.question.precision).then_some(needed.ceil() as usize)
            }
            _ => None,
        }
    }
}

/// Trials in the order in which the score gets worse.
fn ordered(tried: &[Tried], rising: bool) -> Vec<Tried> {
    let mut all = tried.to_vec();
    if rising {
        all.reverse();
    }
    all
}

/// The number of trials before the threshold, and the number of trials that contradict it (missed before it, or kept behind it). It is the
/// threshold with the fewest contradictions, and the first of them.
fn step(tried: &[Tried]) -> (usize, usize) {
    let mut against = tried.iter().filter(|t| t.kept).count();
    let mut best = (0, against);
    for (k, t) in tried.iter().enumerate() {
        if t.kept {
            against -= 1;
        } else {
            against += 1;
        }
        if against < best.1 {
            best = (k + 1, against);
        }
    }
    best
}
