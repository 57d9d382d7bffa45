//! The journal of finished trials: one line of JSON for each trial, written to the disk before the next trial is counted.
//!
//! Numbers are written as the shortest decimals that read back to the same bits, as text, so that NaN can be written. A resumed study therefore
//! has the same bytes as one that was not interrupted.

use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::study::Score;
use crate::study::{N_SCORES, Quality, TrialResult};
use cittert_formats::atomic::{FileList, LIST, write_file_now};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the journal in the folder of a study.
const NAME: &str = "journal.jsonl";
/// Locked by the process that runs the study. The lock is released when the process ends, also when it is killed.
const LOCK: &str = "journal.lock";
/// The folder of the shards of a study.
pub(super) const SHARDS: &str = "shards";
/// The name in the list of files that a study leaves in its folder.
pub(super) const WRITER: &str = "cittert study";
/// Files of a finished study beside its journal and its pictures. They are removed when the study starts again.
const RESULTS: [&str; 7] = ["trials.csv", "summary.csv", "question.csv", "failures.csv", "metrics.json", "study.h5", "report.html"];

/// Which trial of the study it is.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Key {
    /// A trial of the grid.
    Grid(usize),
    /// A trial of the question: its place among the other axes, the value of its parameter, and the index of its seed.
    Asked { place: usize, value: String, seed: usize },
    /// A trial without an antenna: the point of the grid, the index of the antenna, and that of the seed.
    Without { point: usize, antenna: usize, seed: usize },
}

#[derive(Serialize, Deserialize)]
struct Head {
    study: String,
    trials: usize,
}

#[derive(Serialize, Deserialize)]
struct Line {
    trial: Key,
    before: [String; N_SCORES],
    after: Option<[String; N_SCORES]>,
    accepted: Option<bool>,
    rounds: usize,
    note: String,
}

impl Line {
    fn of(trial: &Key, r: &TrialResult) -> Self {
        let texts = |q: &Quality| q.values().map(|v| v.to_string());
        let (before, after) = (texts(&r.before), r.after.as_ref().map(texts));
        Self { trial: trial.clone(), before, after, accepted: r.accepted, rounds: r.rounds, note: r.note.clone() }
    }

    fn result(&self) -> Option<TrialResult> {
        let quality = |t: &[String; N_SCORES]| {
            let mut v = [0.0; N_SCORES];
            for (v, t) in v.iter_mut().zip(t) {
                *v = t.parse().ok()?;
            }
            Some(Quality::from_values(v))
        };
        let after = match &self.after {
            Some(t) => Some(quality(t)?),
            None => None,
        };
        let before = quality(&self.before)?;
        Some(TrialResult { before, after, accepted: self.accepted, rounds: self.rounds, note: self.note.clone() })
    }
}

/// The journal, open at its end.
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    begun: Begun,
    _lock: File,
}

/// A folder without a finished trial. It is removed with what a study writes at its beginning, if the study ends before a trial is stored.
struct Begun {
    folder: PathBuf,
    /// False where the folder holds trials, or existed before.
    removes: bool,
}

impl Drop for Begun {
    fn drop(&mut self) {
        if self.removes {
            for name in [NAME, LIST, LOCK] {
                // What is not there needs no removal.
                let _ = std::fs::remove_file(self.folder.join(name));
            }
            // A folder that holds something else stays.
            let _ = std::fs::remove_dir(&self.folder);
        }
    }
}

impl Journal {
    /// Open the journal of a folder, or make one. Returns it with the finished trials.
    ///
    /// # Errors
    /// The folder holds other files, the journal is of another study and `overwrite` is false, or an error of the file system.
    pub(super) fn open(
        folder: &Path,
        fingerprint: &str,
        trials: usize,
        overwrite: bool,
        context: &Context,
    ) -> Result<(Self, BTreeMap<Key, TrialResult>)> {
        let path = folder.join(NAME);
        let head = serde_json::to_string(&Head { study: fingerprint.to_owned(), trials })?;
        [NAME, LOCK].iter().try_for_each(|name| cittert_formats::refuse_special(&folder.join(name)))?;
        if !path.exists() && !folder_is_free(folder)? {
            let text = format!("{}: it has files but no {NAME} of a study; choose another folder", folder.display());
            return Err(Failure::message(text));
        }
        let is_new = !folder.exists();
        let lock = lock(folder)?;
        let begun = Begun { folder: folder.to_owned(), removes: is_new };
        // Another process may have made the journal before it released the lock.
        let old = match std::fs::read(&path) {
            Ok(bytes) => Some(bytes),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
            Err(e) => return Err(e).context(format!("{}", path.display())),
        };
        let list = if old.is_some() { FileList::read(folder, WRITER)? } else { FileList::default() };
        refuse_taken(folder, &list)?;
        let mut done = BTreeMap::new();
        let mut whole = false;
        if let (Some(bytes), false) = (&old, overwrite) {
            let text = String::from_utf8_lossy(bytes);
            let mut lines = text.split_inclusive('\n');
            let first = lines.next().unwrap_or_default();
            if serde_json::from_str::<Head>(first).is_ok_and(|h| h.study == fingerprint && h.trials == trials) {
                let (found, damaged) = trials_of(lines, trials);
                if damaged > 0 {
                    context.console.warn(&format!("{}: {damaged} damaged lines; their trials are run again", path.display()));
                }
                (done, whole) = (found, damaged == 0 && first.ends_with('\n'));
            } else if first.ends_with('\n') {
                let text = format!(
                    "{}: holds a study of another configuration, input or version; choose another folder, or begin anew with --overwrite",
                    folder.display()
                );
                return Err(Failure::message(text));
            }
        }
        if !whole {
            std::fs::create_dir_all(folder).context(format!("{}: cannot make the folder", folder.display()))?;
            for name in results().filter(|name| overwrite && list.has(name)) {
                // A result that does not exist needs no removal.
                let _ = std::fs::remove_file(folder.join(name));
            }
            write_file_now(&folder.join(LIST), true, of_a_journal().text(WRITER).as_bytes())?;
            let text = head + "\n" + &lines(done.iter())?;
            write_file_now(&path, true, text.as_bytes())?;
        }
        let file = OpenOptions::new().append(true).open(&path).context(format!("{}", path.display()))?;
        Ok((Self { file, path, begun, _lock: lock }, done))
    }

    /// The finished trials in the journal of another folder; `None` where there is no journal. Nothing is changed, and nothing is locked: the
    /// last line of a running study may be incomplete.
    ///
    /// # Errors
    /// The journal is of another study, or an error of the file system.
    pub(super) fn read(folder: &Path, fingerprint: &str, trials: usize) -> Result<Option<BTreeMap<Key, TrialResult>>> {
        let path = folder.join(NAME);
        let text = match std::fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e).context(format!("{}", path.display())),
        };
        let mut lines = text.split_inclusive('\n');
        let first = lines.next().unwrap_or_default();
        if first.ends_with('\n') && !serde_json::from_str::<Head>(first).is_ok_and(|h| h.study == fingerprint && h.trials == trials) {
            let text = "holds trials of another configuration, input or version; remove this folder, or run the shard with --overwrite";
            return Err(Failure::message(format!("{}: {text}", folder.display())));
        }
        Ok(Some(trials_of(lines, trials).0))
    }

    /// Add trials. They are on the disk when this function returns.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn append<'a>(&mut self, trials: impl Iterator<Item = (&'a Key, &'a TrialResult)>) -> Result<()> {
        let text = lines(trials)?;
        // One write: a killed process leaves whole lines, and at most one incomplete line at the end.
        let stored = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        self.begun.removes &= stored.is_err() || text.is_empty();
        stored.context(format!("{}: cannot store trials", self.path.display()))
    }
}

/// The lines of trials.
///
/// # Errors
/// A key that JSON cannot hold.
pub(super) fn lines<'a>(trials: impl Iterator<Item = (&'a Key, &'a TrialResult)>) -> Result<String> {
    let mut text = String::new();
    for (key, result) in trials {
        text += &serde_json::to_string(&Line::of(key, result))?;
        text.push('\n');
    }
    Ok(text)
}

/// The list of the files of a study without results.
fn of_a_journal() -> FileList {
    FileList::default().with([NAME, LOCK])
}

/// The list of the files of a finished study.
pub(super) fn of_results(names: impl IntoIterator<Item = String>) -> FileList {
    of_a_journal().with(names)
}

/// Names of all results that a study may have.
fn results() -> impl Iterator<Item = String> {
    let pictures = Score::ALL.iter().map(|score| score.name()).chain(["failures"]).map(|name| format!("{name}.png"));
    RESULTS.iter().map(|name| (*name).to_owned()).chain(pictures)
}

/// Refuse a folder in which somebody else has a file with the name of a result.
fn refuse_taken(folder: &Path, list: &FileList) -> Result<()> {
    match results().map(|name| (folder.join(&name), name)).find(|(path, name)| path.symlink_metadata().is_ok() && !list.has(name)) {
        Some((path, _)) => {
            let text = format!("{}: {WRITER} has not written this file, and would replace it: move it away", path.display());
            Err(Failure::message(text))
        }
        None => Ok(()),
    }
}

/// The lock of a folder. The folder is made if it does not exist.
fn lock(folder: &Path) -> Result<File> {
    std::fs::create_dir_all(folder).context(format!("{}: cannot make the folder", folder.display()))?;
    let path = folder.join(LOCK);
    let file = OpenOptions::new().create(true).append(true).open(&path).context(format!("{}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(std::fs::TryLockError::WouldBlock) => {
            let text = format!("{}: another process runs a study in this folder; wait for it, or choose another folder", folder.display());
            Err(Failure::message(text))
        }
        Err(std::fs::TryLockError::Error(e)) => Err(e).context(format!("{}: cannot lock it", path.display())),
    }
}

/// True if a folder does not exist or holds nothing but what a study leaves that was killed before it had a journal.
fn folder_is_free(folder: &Path) -> Result<bool> {
    let unfinished = |name: &str| [NAME, LIST].iter().any(|of| name.starts_with(&format!(".{of}."))) && name.ends_with(".partial");
    // Shards of a study run before the study has a journal of its own.
    let left = |name: &str| [LOCK, LIST, SHARDS].contains(&name) || unfinished(name);
    match std::fs::read_dir(folder) {
        Ok(entries) => Ok(entries.flatten().all(|e| e.file_name().to_str().is_some_and(left))),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(true),
        Err(e) => Err(e).context(format!("{}", folder.display())),
    }
}

/// The trials of all complete lines, and the number of other lines.
pub(super) fn trials_of<'a>(lines: impl Iterator<Item = &'a str>, trials: usize) -> (BTreeMap<Key, TrialResult>, usize) {
    let (mut done, mut damaged) = (BTreeMap::new(), 0);
    for line in lines {
        let known = |l: &Line| !matches!(l.trial, Key::Grid(k) if k >= trials);
        let parsed = serde_json::from_str::<Line>(line).ok().filter(|l| line.ends_with('\n') && known(l));
        match parsed.and_then(|l| Some((l.trial.clone(), l.result()?))) {
            Some((k, r)) => {
                done.insert(k, r);
            }
            None => damaged += 1,
        }
    }
    (done, damaged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_the_bit_and_torn_lines_are_left_out() {
        let q = Quality::from_values([0.1 + 0.2, f64::NAN, f64::INFINITY, 1e-300, -0.0, 5.0, 6.0]);
        let r = TrialResult { before: q, after: None, accepted: Some(false), rounds: 2, note: "a \"b\"\n".into() };
        let asked = Key::Asked { place: 1, value: "4.5".into(), seed: 2 };
        let without = Key::Without { point: 1, antenna: 3, seed: 2 };
        for key in [Key::Grid(7), asked, without] {
            let line = serde_json::to_string(&Line::of(&key, &r)).unwrap() + "\n";
            let (done, damaged) = trials_of([line.as_str(), &line[..line.len() / 2], line.trim_end()].into_iter(), 8);
            assert_eq!(damaged, 2);
            let bits = |r: &TrialResult| r.before.values().map(f64::to_bits);
            assert_eq!(bits(&done[&key]), bits(&r));
            assert_eq!((&done[&key].note, done[&key].accepted), (&r.note, Some(false)));
            assert_eq!(trials_of([line.as_str()].into_iter(), 7).1, usize::from(key == Key::Grid(7)));
        }
    }
}
