//! A small part of the work of a command, which is done and thrown away: its time and its memory say what the whole will take.

use crate::cli::failure::Result;
use crate::cli::slurm::Pilot;
use cittert_arrays::Image;
use cittert_formats::atomic::{AtomicDir, Replaces};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::free_disk;
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

/// What all of some work takes, from parts of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::cli) struct Grown {
    /// Wall-clock time of all, s.
    pub(in crate::cli) seconds: f64,
    /// Largest memory of all, bytes.
    pub(in crate::cli) held_bytes: f64,
    /// How many were worked on.
    pub(in crate::cli) part: usize,
}

impl Grown {
    /// What is taken for granted: that so many of some things stand for all.
    pub(in crate::cli) fn assumption(&self, things: &str) -> String {
        format!("all {things} take the time that {} of them say, on this machine", self.part)
    }
}

/// Work on more and more of `made` things, from `first` of them on, until that takes long enough to be measured. All of them, which may be more than can be worked on, take
/// what lies on the line through the last two parts.
///
/// # Errors
/// Those of the work.
pub(in crate::cli) fn grown(of: (f64, usize), first: usize, work: &mut dyn FnMut(usize) -> Result<()>) -> Result<Grown> {
    grown_by(of, first, &mut |n| measured(|| work(n)))
}

/// The same for work that says itself what it took.
fn grown_by((all, made): (f64, usize), first: usize, work: &mut dyn FnMut(usize) -> Result<Measured<()>>) -> Result<Grown> {
    let (mut before, mut part): (Option<(f64, f64, f64)>, usize) = (None, first.clamp(1, made.max(1)));
    loop {
        let done = work(part)?;
        let (n, seconds, held_bytes) = (part as f64, done.seconds, done.held_bytes);
        let (n0, s0, b0) = before.unwrap_or((0.0, 0.0, 0.0));
        if part >= made || (before.is_some() && seconds > ENOUGH_S) {
            // A part that is larger takes no less.
            let at = |from: f64, to: f64| to + (to - from).max(0.0) * (all - n) / (n - n0).max(1.0);
            return Ok(Grown { seconds: at(s0, seconds), held_bytes: at(b0, held_bytes), part });
        }
        before = Some((n, seconds, held_bytes));
        part = (MORE * part).min(made);
    }
}

/// Time after which no larger part is needed, s, and by how much larger each part is than the one before.
const ENOUGH_S: f64 = 0.4;
const MORE: usize = 4;

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

    /// A folder for files of so many bytes. `None` where there is no room for them.
    pub(in crate::cli) fn with_room(bytes: f64) -> Option<Self> {
        let scratch = Self::new().ok()?;
        free_disk(scratch.path()).is_none_or(|free| free as f64 > 2.0 * bytes).then_some(scratch)
    }

    /// A folder for one image of so many pixels.
    pub(in crate::cli) fn for_image(pixels: usize) -> Option<Self> {
        Self::with_room(size_of::<f32>() as f64 * pixels as f64)
    }

    /// Write an image in place of the one before.
    ///
    /// # Errors
    /// An error of the file system.
    pub(in crate::cli) fn image<P: Copy + Into<f64> + Sync>(&self, image: &Image<P>) -> Result<()> {
        Ok(write_image(&self.path().join("image.fits"), image, ImageOptions { overwrite: true, ..ImageOptions::default() })?)
    }

    /// The folder.
    pub(in crate::cli) fn path(&self) -> &Path {
        self.0.path()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Work with a beginning and the same time for each thing.
    #[test]
    fn all_of_some_work_takes_what_its_parts_say() {
        let mut asked = Vec::new();
        let mut work = |n: usize| {
            asked.push(n);
            let (seconds, held_bytes) = (0.02 + 0.002 * n as f64, 1e6 + 1e3 * n as f64);
            Ok(Measured { result: (), seconds, held_bytes })
        };
        let found = grown_by((10_000.0, 10_000), 16, &mut work).unwrap();
        assert_eq!((asked, found.part), (vec![16, 64, 256], 256));
        assert!((found.seconds - 20.02).abs() < 1e-9 && (found.held_bytes - 11e6).abs() < 1.0, "{found:?}");
        let mut sizes = Vec::new();
        let mut note = |n: usize| {
            sizes.push(n);
            Ok(())
        };
        assert_eq!((grown((3.0, 3), 16, &mut note).unwrap().part, sizes), (3, vec![3]));
    }

    #[test]
    fn what_a_forecast_writes_is_removed() {
        let scratch = Scratch::new().unwrap();
        let path = scratch.path().to_owned();
        let done = measured(|| Ok(std::fs::write(path.join("a"), "b")?)).unwrap();
        assert!(path.join("a").exists() && done.seconds >= 0.0);
        drop(scratch);
        assert!(!path.exists());
        assert!(Scratch::with_room(1e6).is_some() && Scratch::with_room(1e30).is_none());
    }
}
