//! Runs trials that are not in the journal yet, and stores them there. Several processes share them; process 0 has the journal.

use super::journal::{Journal, Key, lines, trials_of};
use super::shard::Shard;
use crate::cli::console::Console;
use crate::cli::failure::Result;
use crate::study::{Batch, Found, Setup, TrialResult, run_batch};
use cittert_arrays::Ranks;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A trial that is needed.
pub(super) struct Job<'a> {
    pub(super) key: Key,
    pub(super) setup: &'a Setup,
    pub(super) seed: u64,
}

/// The finished trials of a study, and the journal that keeps them.
pub(super) struct Trials<'a> {
    /// That of process 0.
    journal: Option<Journal>,
    /// In other processes than 0, those that process 0 has shared.
    pub(super) done: BTreeMap<Key, TrialResult>,
    pub(super) resumed: usize,
    console: &'a Console,
    /// The shard whose trials are run, if not all are.
    shard: Option<Shard>,
    ranks: Arc<dyn Ranks>,
    /// What process 0 has not shared with the others yet.
    unshared: Vec<Key>,
}

impl<'a> Trials<'a> {
    pub(super) fn new(
        journal: Option<(Journal, BTreeMap<Key, TrialResult>)>,
        shard: Option<Shard>,
        ranks: Arc<dyn Ranks>,
        console: &'a Console,
    ) -> Self {
        let (journal, done) = journal.map_or_else(|| (None, BTreeMap::new()), |(journal, done)| (Some(journal), done));
        Self { journal, resumed: done.len(), unshared: done.keys().cloned().collect(), done, console, shard, ranks }
    }

    /// Take finished trials that are not known yet.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn adopt(&mut self, trials: BTreeMap<Key, TrialResult>) -> Result<()> {
        let new = trials.into_iter().filter(|(key, _)| !self.done.contains_key(key)).collect();
        self.store(new)?;
        self.resumed = self.done.len();
        Ok(())
    }

    fn store(&mut self, new: Vec<(Key, TrialResult)>) -> Result<()> {
        if let Some(journal) = &mut self.journal {
            journal.append(new.iter().map(|(key, result)| (key, result)))?;
        }
        self.unshared.extend(new.iter().map(|(key, _)| key.clone()));
        self.done.extend(new);
        Ok(())
    }

    /// Run the jobs that are not done and belong to the shard. `place` says where a job is, for messages of errors. All processes have the same jobs.
    ///
    /// # Errors
    /// A trial that fails, or an error of the file system.
    pub(super) fn run(&mut self, jobs: &[Job<'_>], place: &(dyn Fn(&Key) -> String + Sync)) -> Result<()> {
        let wanted = |k: &usize| self.shard.is_none_or(|s| s.has(*k)) && !self.done.contains_key(&jobs[*k].key);
        let todo: Vec<usize> = if self.ranks.rank() == 0 { (0..jobs.len()).filter(wanted).collect() } else { Vec::new() };
        let job = |k: usize| (jobs[k].setup, jobs[k].seed);
        let text = |k: usize| place(&jobs[k].key);
        let (console, ranks) = (self.console, self.ranks.clone());
        let store = &mut |found: Vec<Found>| {
            let keyed = found.into_iter().map(|(k, result)| (jobs[k].key.clone(), result)).collect();
            self.store(keyed).map_err(|e| crate::ChainError::Other(e.to_string().into()))
        };
        run_batch(&Batch { todo: &todo, job: &job, place: &text, ranks: &*ranks }, rayon::current_num_threads(), store, console)?;
        Ok(())
    }

    /// Let all processes know what process 0 knows, so that all plan the same trials of a question.
    ///
    /// # Errors
    /// A key that JSON cannot hold.
    pub(super) fn share(&mut self) -> Result<()> {
        let new = std::mem::take(&mut self.unshared);
        if self.ranks.size() == 1 {
            return Ok(());
        }
        let own = lines(new.iter().filter_map(|key| self.done.get_key_value(key)))?;
        let all = self.ranks.exchange(own.into_bytes());
        if self.ranks.rank() > 0 {
            let text = String::from_utf8_lossy(&all[0]);
            self.done.extend(trials_of(text.split_inclusive('\n'), usize::MAX).0);
        }
        Ok(())
    }
}
