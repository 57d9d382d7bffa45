//! `--shard i/n` and `--merge`: the trials of a study, shared out over processes that know nothing of one another.
//!
//! Each shard has a folder of its own below that of the study, with a journal and a lock. It can therefore run on any machine that sees the
//! folder, at any time, and again. The numbers of a trial depend only on its place in the study, so the merged study is that of one process.

use super::journal::{Journal, Key, SHARDS};
use super::shard::Shard;
use super::trials::Trials;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use std::collections::BTreeSet;
use std::path::Path;

/// Number of shards that a message names.
const MOST_NAMED: usize = 20;

/// The shards that have a folder, sorted.
fn present(study: &Path) -> Result<Vec<Shard>> {
    let folder = study.join(SHARDS);
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(e).context(folder.display()),
    };
    let mut shards: Vec<Shard> = entries.flatten().filter_map(|e| Shard::of_folder(e.file_name().to_str()?)).collect();
    shards.sort_by_key(|s| (s.of, s.number));
    Ok(shards)
}

/// Take the trials of all shards into the journal of the study. `jobs` are the groups of trials that shards share out, each in its order.
///
/// # Errors
/// There is no shard, a shard is of another study, or trials are missing. The error names the shards to run.
pub(super) fn merge(study: &Path, fingerprint: &str, planned: usize, jobs: &[Vec<Key>], all: &mut Trials<'_>) -> Result<()> {
    let shards = present(study)?;
    let none = || Failure::message(format!("{}: there are no trials of shards to merge; run --shard 1/N to N/N first", study.display()));
    ensure!(!shards.is_empty() || !all.done.is_empty(), none());
    for shard in &shards {
        if let Some(done) = Journal::read(&shard.folder(study), fingerprint, planned).context(format!("shard {shard}"))? {
            all.adopt(done)?;
        }
    }
    let done = &all.done;
    let missing: Vec<usize> = jobs.iter().flat_map(|group| (0..group.len()).filter(move |k| !done.contains_key(&group[*k]))).collect();
    if missing.is_empty() {
        return Ok(());
    }
    // Shards of the latest division are named. Trials that another division has are not missing.
    let of = shards.iter().map(|s| s.of).max().unwrap_or(1);
    let again: BTreeSet<usize> = missing.iter().map(|job| job % of + 1).collect();
    let named: Vec<String> = again.iter().take(MOST_NAMED).map(|number| Shard { number: *number, of }.to_string()).collect();
    let more = if again.len() > MOST_NAMED { format!(" and {} more", again.len() - MOST_NAMED) } else { String::new() };
    Err(Failure::message(format!(
        "{}: {} trials are missing: run these shards (again), and merge then: --shard {}{more}",
        study.display(),
        missing.len(),
        named.join(", ")
    )))
}
