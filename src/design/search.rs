//! Many attempts at a layout, in parallel and in an order that does not depend on the number of threads.
//!
//! Attempts are numbered and run in rounds. An attempt sees only its number, the seed, and the best layouts of the rounds before its own. So the
//! result depends on the seed and on the number of attempts alone. A limit of time decides how many rounds are begun, and nothing else.

use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Attempts in a round.
const ROUND: u64 = 8;
/// Layouts of which later attempts may begin.
const ELITE: usize = 4;

/// A layout that an attempt has found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The number of the attempt, from 0.
    pub attempt: u64,
    /// The positions of all elements, or the chosen pads, in apertures.
    pub xy: Vec<[f64; 2]>,
    /// Its score; smaller is better.
    pub score: f64,
}

/// How long to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchControl {
    /// Number of attempts.
    pub attempts: u64,
    /// No round begins that would probably end later than this.
    pub time: Option<Duration>,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    /// The best layout.
    pub best: Found,
    /// Number of attempts.
    pub attempts: u64,
    /// The score of each attempt \[attempt\].
    pub scores: Vec<f64>,
}

/// Run attempts. `attempt` gets a number and the best layouts of earlier rounds, the best first. `done` holds attempts of an earlier run, and
/// `each` is told every new one as soon as it ends.
///
/// # Errors
/// The first error of an attempt or of `each`; a request to stop.
pub fn search(
    control: SearchControl,
    mut done: BTreeMap<u64, Found>,
    attempt: &(dyn Fn(u64, &[Found]) -> Result<Found> + Sync),
    each: &(dyn Fn(&Found) -> Result<()> + Sync),
    observer: &dyn Observer,
) -> Result<Searched> {
    let started = Instant::now();
    // Where time ends the search, the number of attempts is only an upper limit.
    let total = control.time.is_none().then_some(control.attempts);
    observer.event(Event::Phase { name: "attempts", total, unit: "attempt" });
    let (mut all, mut longest): (Vec<Found>, Duration) = (Vec::new(), Duration::ZERO);
    let mut told = f64::INFINITY;
    while (all.len() as u64) < control.attempts {
        let first = all.len() as u64;
        let last = (first + ROUND).min(control.attempts);
        let elite = elite(&all);
        let begun = Instant::now();
        let round: Vec<Found> = (first..last)
            .map(|k| (k, done.remove(&k)))
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|(k, known)| {
                ensure!(!observer.cancelled(), ChainError::Cancelled);
                let found = match known {
                    Some(found) => found,
                    None => {
                        let found = attempt(k, &elite)?;
                        each(&found)?;
                        found
                    }
                };
                observer.event(Event::Advance(1));
                Ok(found)
            })
            .collect::<Result<_>>()?;
        all.extend(round);
        longest = longest.max(begun.elapsed());
        if let Some(best) = self::elite(&all).first().filter(|best| best.score < told) {
            told = best.score;
            observer.event(Event::Note(&format!("{} attempts, best {:.5} (attempt {})", all.len(), best.score, best.attempt + 1)));
        }
        if control.time.is_some_and(|limit| started.elapsed() + longest > limit) {
            break;
        }
    }
    observer.event(Event::Done);
    let scores = all.iter().map(|f| f.score).collect();
    let attempts = all.len() as u64;
    let best = elite(&all).into_iter().next();
    best.map(|best| Searched { best, attempts, scores }).ok_or_else(|| ChainError::NoData("no attempt was made".into()))
}

/// The best layouts; of equal ones the earlier.
fn elite(all: &[Found]) -> Vec<Found> {
    let mut order: Vec<&Found> = all.iter().collect();
    order.sort_by(|a, b| a.score.total_cmp(&b.score).then(a.attempt.cmp(&b.attempt)));
    order.into_iter().take(ELITE).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use rand::RngExt;
    use std::sync::Mutex;

    /// An attempt whose result depends on everything that it may depend on.
    fn toy(k: u64, elite: &[Found]) -> Result<Found> {
        let drawn: f64 = crate::random::stream(7, "toy", k).random();
        let score = elite.first().map_or(drawn, |e| 0.9 * e.score.min(drawn));
        Ok(Found { attempt: k, xy: vec![[drawn, score]], score })
    }

    #[test]
    fn the_result_does_not_depend_on_threads_or_interruptions() {
        let control = SearchControl { attempts: 29, time: None };
        let told = Mutex::new(BTreeMap::new());
        let keep = |f: &Found| {
            told.lock().unwrap().insert(f.attempt, f.clone());
            Ok(())
        };
        let run = |threads: usize, done| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| search(control, done, &toy, &keep, &Silent).unwrap())
        };
        let whole = run(1, BTreeMap::new());
        assert_eq!(whole, run(5, BTreeMap::new()));
        assert_eq!(whole.attempts, 29);
        // Some attempts of an interrupted run, out of order.
        let some: BTreeMap<u64, Found> =
            told.lock().unwrap().iter().filter(|(k, _)| *k % 3 == 1 && **k < 20).map(|(k, f)| (*k, f.clone())).collect();
        assert_eq!(whole, run(2, some));
    }

    #[test]
    fn a_limit_of_time_ends_after_whole_rounds() {
        let control = SearchControl { attempts: 1000, time: Some(Duration::ZERO) };
        let found = search(control, BTreeMap::new(), &toy, &|_| Ok(()), &Silent).unwrap();
        assert_eq!(found.attempts, ROUND);
    }
}
