//! A small part of the work of a command, which is done and thrown away: its time and its memory say what the whole will take.

use crate::cli::failure::Result;
use crate::cli::slurm::Pilot;
use cittert_formats::atomic::{AtomicDir, Replaces};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// A result, and what it took.
pub(in crate::cli) struct Measured<T> {
    pub(in crate::cli) result: T,
    /// Wall-clock time, s.
    pub(in crate::cli) seconds: f64,
    /// Largest memory that the process took meanwhile beside what it had before, bytes. 0 where the system does not tell.
    pub(in crate::cli) held_bytes: f64,
}

/// Do some work, and say what it took.
///
/// # Errors
/// Those of the work.
pub(in crate::cli) fn measured<T>(work: impl FnOnce() -> Result<T>) -> Result<Measured<T>> {
    Pilot::forget_memory();
    let before = Pilot::memory().0;
    let started = Instant::now();
    let result = work()?;
    Ok(Measured { result, seconds: started.elapsed().as_secs_f64(), held_bytes: Pilot::memory().1.saturating_sub(before) as f64 })
}

/// How many frames of a film stand for all of them: three for each thread, which makes one at a time, and at least four.
pub(in crate::cli) fn frames_to_make(threads: usize) -> usize {
    4.max(3 * threads)
}

/// A folder for files of a forecast, which is removed with them in the end.
pub(in crate::cli) struct Scratch(AtomicDir);

impl Scratch {
    /// A new folder in the folder of temporary files.
    ///
    /// # Errors
    /// The folder of temporary files is not writable.
    pub(in crate::cli) fn new() -> Result<Self> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let name = format!("cittert-forecast-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        Ok(Self(AtomicDir::create(&std::env::temp_dir().join(name), false, Replaces::FilesOf("cittert --dry-run"))?))
    }

    /// The folder.
    pub(in crate::cli) fn path(&self) -> &Path {
        self.0.path()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_forecast_writes_is_removed() {
        let scratch = Scratch::new().unwrap();
        let path = scratch.path().to_owned();
        let done = measured(|| Ok(std::fs::write(path.join("a"), "b")?)).unwrap();
        assert!(path.join("a").exists() && done.seconds >= 0.0);
        drop(scratch);
        assert!(!path.exists());
    }
}
