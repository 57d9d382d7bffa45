//! Unknown gains of a set that several processes share.
//!
//! Each process has some of the rows. An interval whose rows are all in one process is solved there, and the others need not know its gains. The sums of an
//! interval that several processes have a part of are added up, so that all of these find the same gains. What is counted over all intervals, such as the
//! number of unknowns, is counted by the first process that has a row of the interval.

use super::least_squares::Pairs;
use super::over_ranks::{Numbers, of_all};
use crate::Result;
use cittert_arrays::Ranks;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::sync::Arc;

/// Two antennas and a problem, and what is summed for them.
pub(super) type OfBaselines = BTreeMap<(u32, u32, usize), [f64; 4]>;

/// How intervals are shared among processes.
pub(super) struct Sharing {
    ranks: Arc<dyn Ranks>,
    intervals: Vec<Interval>,
}

#[derive(Debug, Clone, Copy)]
struct Interval {
    /// The first process that has a row of it.
    first: usize,
    /// Several processes have rows of it.
    common: bool,
    /// This process has rows of it.
    own: bool,
}

impl fmt::Debug for Sharing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sharing").field("processes", &self.ranks.size()).field("intervals", &self.intervals).finish()
    }
}

impl Sharing {
    /// The intervals of all processes from the keys of the rows of this one, and the interval of each of its rows.
    ///
    /// # Errors
    /// `keys` is one in any process.
    pub(super) fn of(ranks: Arc<dyn Ranks>, keys: Result<Vec<i64>>) -> Result<(Self, Vec<u32>)> {
        // Keys of milliseconds or of intervals are whole numbers below 2^53.
        let (distinct, keys) = match keys {
            Ok(keys) => {
                let mut seen = HashSet::new();
                (Ok(keys.iter().filter(|k| seen.insert(**k)).map(|k| *k as f64).collect()), keys)
            }
            Err(e) => (Err(e), Vec::new()),
        };
        let all = of_all(&*ranks, distinct)?;
        let (mut number, mut intervals) = (HashMap::new(), Vec::<Interval>::new());
        for (rank, keys) in all.iter().enumerate() {
            for key in keys {
                let at = *number.entry(*key as i64).or_insert(intervals.len());
                if at == intervals.len() {
                    intervals.push(Interval { first: rank, common: false, own: false });
                }
                intervals[at].common |= intervals[at].first != rank;
                intervals[at].own |= rank == ranks.rank();
            }
        }
        let of_rows = keys.iter().map(|key| number[key] as u32).collect();
        Ok((Self { ranks, intervals }, of_rows))
    }

    /// Number of intervals of all processes.
    pub(super) fn n(&self) -> usize {
        self.intervals.len()
    }

    /// Whether this process has rows of an interval.
    pub(super) fn has(&self, interval: usize) -> bool {
        self.intervals[interval].own
    }

    /// Whether this process counts an interval for all.
    pub(super) fn counts(&self, interval: usize) -> bool {
        self.intervals[interval].first == self.ranks.rank()
    }

    pub(super) fn ranks(&self) -> Arc<dyn Ranks> {
        self.ranks.clone()
    }

    /// Sums over all processes.
    pub(super) fn sum<const N: usize>(&self, mut own: [f64; N]) -> [f64; N] {
        self.ranks.sum(&mut own);
        own
    }

    /// True if `own` is in every process.
    pub(super) fn all(&self, own: bool) -> bool {
        let mut fails = [f64::from(u8::from(!own))];
        self.ranks.largest(&mut fails);
        fails == [0.0]
    }

    /// Make each of these true that is in any process.
    pub(super) fn any(&self, own: &mut [bool]) {
        let mut all: Vec<f64> = own.iter().map(|x| f64::from(u8::from(*x))).collect();
        self.ranks.largest(&mut all);
        own.iter_mut().zip(all).for_each(|(own, all)| *own = all > 0.0);
    }

    /// Add up the sums of the intervals that several processes have rows of. Every interval has `per` problems, of which each has one of `pairs`.
    pub(super) fn add_up(&self, per: usize, pairs: &mut [Pairs]) {
        if self.ranks.size() == 1 {
            return;
        }
        let common = || {
            self.intervals.iter().enumerate().filter(|(_, i)| i.common).flat_map(|(k, i)| (per * k..per * (k + 1)).map(|at| (at, i.own)))
        };
        // Who has no row of an interval does not know how many antennas it has, but sums lists of the same length.
        let mut sizes: Vec<f64> = common().map(|(at, _)| pairs[at].n as f64).collect();
        self.ranks.largest(&mut sizes);
        let mut sums = Vec::new();
        for ((at, own), n) in common().zip(&sizes) {
            let from = sums.len();
            if own {
                pairs[at].put_sums(&mut sums);
            }
            sums.resize(from + Pairs::n_sums(*n as usize), 0.0);
        }
        self.ranks.sum(&mut sums);
        let mut left = &sums[..];
        for ((at, own), n) in common().zip(&sizes) {
            let (here, rest) = left.split_at(Pairs::n_sums(*n as usize));
            left = rest;
            if own {
                pairs[at].set_sums(here);
            }
        }
    }

    /// Bring together what belongs to intervals of several processes, and leave out what does not. Every interval has `per` problems.
    ///
    /// # Errors
    /// Another process has failed.
    pub(super) fn of_common(&self, per: usize, own: &OfBaselines) -> Result<OfBaselines> {
        let mut merged = OfBaselines::new();
        if self.ranks.size() == 1 {
            return Ok(merged);
        }
        let common = own.iter().filter(|((.., problem), _)| self.is_common(per, *problem));
        let numbers = common.flat_map(|((a, b, p), sums)| [f64::from(*a), f64::from(*b), *p as f64].into_iter().chain(*sums)).collect();
        for numbers in of_all(&*self.ranks, Ok(numbers))? {
            let mut left = Numbers::of(&numbers);
            while let (Some([a, b, p]), Some(sums)) = (left.next(), left.next::<4>()) {
                let all = merged.entry((a as u32, b as u32, p as usize)).or_default();
                all.iter_mut().zip(sums).for_each(|(all, x)| *all += x);
            }
        }
        Ok(merged)
    }

    /// Whether several processes have rows of the interval of a problem.
    pub(super) fn is_common(&self, per: usize, problem: usize) -> bool {
        self.intervals[problem / per].common
    }
}
