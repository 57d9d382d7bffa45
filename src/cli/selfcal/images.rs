//! The images of the rounds. Those of the chosen way to calibrate get their names at the end, because it is not known before.

use super::maker::Keep;
use crate::cli::failure::{Context as _, Result};
use crate::cli::options::OutputArgs;
use cittert_arrays::Image;
use cittert_formats::fits::{ImageOptions, write_image};
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The end of the name of a file of a round.
pub(super) fn round_file(round: usize, ending: &str) -> String {
    format!("-round{round}{ending}")
}

/// Writes the image of each round of each candidate.
pub(super) struct RoundImages<'a> {
    pub(super) out: &'a OutputArgs,
    pub(super) history: String,
    pub(super) seconds: Cell<f64>,
    pub(super) kept: RefCell<BTreeSet<(&'static str, usize)>>,
}

impl RoundImages<'_> {
    fn path(&self, candidate: &str, round: usize) -> PathBuf {
        self.out.suffixed(&round_file(round, &format!("-image-{candidate}.fits")))
    }

    /// Give the images of the candidate `chosen` up to its last round their names, and remove all others.
    pub(super) fn choose(&self, chosen: &str, last: usize) -> Result<()> {
        for (candidate, round) in self.kept.take() {
            let path = self.path(candidate, round);
            let done = if candidate == chosen && round <= last {
                std::fs::rename(&path, self.out.suffixed(&round_file(round, "-image.fits")))
            } else {
                std::fs::remove_file(&path)
            };
            done.context(path.display().to_string())?;
        }
        Ok(())
    }

    /// Remove all images after a failure.
    pub(super) fn forget_all(&self) {
        for (candidate, round) in self.kept.take() {
            // The error that led here is worth more than one about a file that is left.
            let _ = std::fs::remove_file(self.path(candidate, round));
        }
    }
}

impl Keep for RoundImages<'_> {
    fn keep(&self, candidate: &'static str, round: usize, image: &Image) -> crate::Result<()> {
        let mut image = image.clone();
        image.history.push(self.history.clone());
        let options = ImageOptions { overwrite: true, ..ImageOptions::default() };
        write_image(&self.path(candidate, round), &image, options).map_err(|e| crate::ChainError::Other(Box::new(e)))?;
        self.kept.borrow_mut().insert((candidate, round));
        Ok(())
    }

    fn took(&self, seconds: f64) {
        self.seconds.set(self.seconds.get() + seconds);
    }
}
