//! The images of the rounds. Those of the chosen way to calibrate get their names at the end, because it is not known before.

use super::maker::Keep;
use crate::cli::failure::Result;
use crate::cli::options::OutputArgs;
use cittert_arrays::Image;
use cittert_formats::FormatError;
use cittert_formats::atomic::Drafts;
use cittert_formats::fits::{ImageOptions, write_image};
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The end of the name of a file of a round.
pub(super) fn round_file(round: usize, ending: &str) -> String {
    format!("-round{round}{ending}")
}

/// Writes the image of each round of each candidate into a hidden folder.
pub(super) struct RoundImages<'a> {
    pub(super) out: &'a OutputArgs,
    /// Those of process 0.
    pub(super) drafts: Option<Drafts>,
    pub(super) history: String,
    pub(super) seconds: Cell<f64>,
    pub(super) kept: RefCell<BTreeSet<(&'static str, usize)>>,
}

fn draft(candidate: &str, round: usize) -> String {
    round_file(round, &format!("-image-{candidate}.fits"))
}

impl RoundImages<'_> {
    /// The final name of the image of a round.
    fn target(&self, round: usize) -> PathBuf {
        self.out.suffixed(&round_file(round, "-image.fits"))
    }

    /// Make the images of the candidate `chosen` up to its last round outputs. All others vanish with the hidden folder.
    pub(super) fn choose(&self, chosen: &str, last: usize) -> Result<()> {
        let Some(drafts) = &self.drafts else { return Ok(()) };
        for (candidate, round) in self.kept.take().into_iter().filter(|(c, round)| *c == chosen && *round <= last) {
            drafts.publish(&draft(candidate, round), &self.target(round), self.out.overwrite)?;
        }
        Ok(())
    }
}

impl Keep for RoundImages<'_> {
    fn keep(&self, candidate: &'static str, round: usize, image: &Image) -> crate::Result<()> {
        let Some(drafts) = &self.drafts else { return Ok(()) };
        let mut image = image.clone();
        image.history.push(self.history.clone());
        let options = ImageOptions { overwrite: true, ..ImageOptions::default() };
        let named = |e| match e {
            // The draft has a hidden name.
            FormatError::Io { action, source, .. } => FormatError::Io { path: self.target(round), action, source },
            other => other,
        };
        let written = write_image(&drafts.path(&draft(candidate, round)), &image, options);
        written.map_err(|e| crate::ChainError::Other(Box::new(named(e))))?;
        self.kept.borrow_mut().insert((candidate, round));
        Ok(())
    }

    fn took(&self, seconds: f64) {
        self.seconds.set(self.seconds.get() + seconds);
    }
}
