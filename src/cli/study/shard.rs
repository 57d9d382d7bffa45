//! One of the parts into which the trials of a study are shared out.

use super::journal::SHARDS;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Largest number of shards.
const MOST: usize = 100_000;

/// One of `of` shards, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shard {
    pub(super) number: usize,
    pub(super) of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) && of <= MOST => Ok(Self { number, of }),
            _ => Err(format!("expected the number of a shard and how many there are, such as 3/8: 1/n to n/n, with n up to {MOST}")),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl Shard {
    /// Whether the job with this number, in the order of the study, is part of the shard. Seeds run fastest, so that every shard has trials of every
    /// point.
    pub(super) fn has(self, job: usize) -> bool {
        job % self.of == self.number - 1
    }

    /// Where its journal is.
    pub(super) fn folder(self, study: &Path) -> PathBuf {
        study.join(SHARDS).join(format!("{}-of-{}", self.number, self.of))
    }

    /// The shard with a folder of this name.
    pub(super) fn of_folder(name: &str) -> Option<Self> {
        name.split_once("-of-").and_then(|(i, n)| format!("{i}/{n}").parse().ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_numbered_from_1() {
        let shard: Shard = "3/8".parse().unwrap();
        assert_eq!((shard.to_string().as_str(), shard.folder(Path::new("s"))), ("3/8", PathBuf::from("s/shards/3-of-8")));
        assert_eq!(Shard::of_folder("3-of-8"), Some(shard));
        for wrong in ["0/8", "9/8", "3", "a/8", "-1/8", "3/0", "1/1000000", "3/8/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
        assert_eq!(Shard::of_folder("x-of-8"), None);
    }

    #[test]
    fn every_job_is_in_one_shard() {
        for job in 0..100 {
            assert_eq!((1..=7).filter(|number| Shard { number: *number, of: 7 }.has(job)).count(), 1);
        }
    }
}
