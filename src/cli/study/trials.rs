//! Runs trials that are not in the journal yet, and stores them there.

use super::journal::{Journal, Key};
use super::shard::Shard;
use crate::cli::console::Console;
use crate::cli::failure::Result;
use crate::study::{Batch, Setup, TrialResult, run_batch};
use std::collections::BTreeMap;

/// A trial that is needed.
pub(super) struct Job<'a> {
    pub(super) key: Key,
    pub(super) setup: &'a Setup,
    pub(super) seed: u64,
}

/// The finished trials of a study, and the journal that keeps them.
pub(super) struct Trials<'a> {
    journal: Journal,
    pub(super) done: BTreeMap<Key, TrialResult>,
    pub(super) resumed: usize,
    console: &'a Console,
    /// The shard whose trials are run, if not all are.
    shard: Option<Shard>,
}

impl<'a> Trials<'a> {
    pub(super) fn new(journal: Journal, done: BTreeMap<Key, TrialResult>, shard: Option<Shard>, console: &'a Console) -> Self {
        let resumed = done.len();
        Self { journal, done, resumed, console, shard }
    }

    /// Take finished trials that are not known yet.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn adopt(&mut self, trials: BTreeMap<Key, TrialResult>) -> Result<()> {
        let new: BTreeMap<Key, TrialResult> = trials.into_iter().filter(|(key, _)| !self.done.contains_key(key)).collect();
        self.journal.append_all(new.iter())?;
        self.done.extend(new);
        self.resumed = self.done.len();
        Ok(())
    }

    /// Run the jobs that are not done and belong to the shard. `place` says where a job is, for messages of errors.
    ///
    /// # Errors
    /// A trial that fails, or an error of the file system.
    pub(super) fn run(&mut self, jobs: &[Job<'_>], place: &(dyn Fn(&Key) -> String + Sync)) -> Result<()> {
        let todo: Vec<usize> =
            (0..jobs.len()).filter(|k| self.shard.is_none_or(|s| s.has(*k)) && !self.done.contains_key(&jobs[*k].key)).collect();
        let job = |k: usize| (jobs[k].setup, jobs[k].seed);
        let text = |k: usize| place(&jobs[k].key);
        let (journal, done) = (&mut self.journal, &mut self.done);
        let store = &mut |k: usize, result: TrialResult| {
            journal.append(&jobs[k].key, &result).map_err(|e| crate::ChainError::Other(e.to_string().into()))?;
            done.insert(jobs[k].key.clone(), result);
            Ok(())
        };
        run_batch(&Batch { todo: &todo, job: &job, place: &text }, rayon::current_num_threads(), store, self.console)?;
        Ok(())
    }
}
