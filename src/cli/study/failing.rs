//! The antennas of a study that fail in turn.

use super::config::{FailingAntennas, FailuresSection};
use crate::cli::failure::{Failure, Result, ensure};
use crate::study::{Antennas, Score, Setup};

/// The antennas that fail.
pub(super) struct Failing {
    pub(super) score: Score,
    /// Indices and names of the antennas \[point\].
    pub(super) antennas: Vec<Vec<(usize, String)>>,
}

impl Failing {
    /// The antennas of a section in the array of each point.
    ///
    /// # Errors
    /// A name that an array does not have, or antennas that differ from seed to seed.
    pub(super) fn new(section: &FailuresSection, setups: &[Setup]) -> Result<Self> {
        let of = |setup: &Setup| {
            if setup.antennas != Antennas::All {
                return Err(Failure::message("layout.choose is \"random\": the antennas that fail must be the same in every seed"));
            }
            let layout = &setup.base.set.header.layout;
            ensure!(layout.n_ant() > 2, Failure::message("an array of two antennas has no image where one fails"));
            let named = |name: &String| {
                let found = layout.index_of(name).map(|k| (k, name.clone()));
                found.ok_or_else(|| {
                    let all: Vec<&str> = layout.antennas().iter().take(40).map(|a| a.name.as_str()).collect();
                    Failure::message(format!("antennas: there is no antenna {name:?}, expected \"each\" or some of {}", all.join(", ")))
                })
            };
            match &section.antennas {
                None => Ok(every(setup)),
                Some(FailingAntennas::Word(word)) if word == "each" => Ok(every(setup)),
                Some(FailingAntennas::Word(name)) => Ok(vec![named(name)?]),
                Some(FailingAntennas::Named(names)) => names.iter().map(named).collect(),
            }
        };
        Ok(Self { score: section.score, antennas: setups.iter().map(of).collect::<Result<_>>()? })
    }

    /// Number of trials without an antenna for each seed.
    pub(super) fn n(&self) -> usize {
        self.antennas.iter().map(Vec::len).sum()
    }
}

fn every(setup: &Setup) -> Vec<(usize, String)> {
    setup.base.set.header.layout.antennas().iter().map(|a| a.name.clone()).enumerate().collect()
}
