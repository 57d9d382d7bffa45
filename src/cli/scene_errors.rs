//! What errors that need the scene read and write: measured bands, and the true pointings and receivers.

use super::context::Outcome;
use super::failure::Result;
use crate::corrupt::{Error, SceneErrors};
use crate::simulate::BandShape;
use cittert_arrays::ArrayLayout;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Read the files that bands name, beside a folder.
///
/// # Errors
/// A file that is no response of receivers.
pub(super) fn read_bands(errors: &mut [Error], folder: &Path) -> Result<()> {
    for error in errors {
        if let Error::Band(band) = error
            && let BandShape::File(path) = &band.shape
        {
            band.shape = BandShape::Table(Arc::new(cittert_formats::read_band(&folder.join(path))?));
        }
    }
    Ok(())
}

/// The files that bands name.
pub(super) fn band_files(errors: &[Error]) -> Vec<PathBuf> {
    let of = |e: &Error| match e {
        Error::Band(band) => match &band.shape {
            BandShape::File(path) => Some(path.clone()),
            _ => None,
        },
        _ => None,
    };
    errors.iter().filter_map(of).collect()
}

/// The files of the true pointings and receivers.
pub(super) struct TruthFiles {
    pointings: PathBuf,
    receivers: PathBuf,
}

impl TruthFiles {
    /// Beside a file: `a/vis.uvh5` gives `a/vis-pointing.csv` and `a/vis-receivers.csv`.
    pub(super) fn beside(path: &Path) -> Self {
        let named = |suffix: &str| {
            let mut name = path.file_stem().unwrap_or_default().to_os_string();
            name.push(suffix);
            path.with_file_name(name)
        };
        Self { pointings: named("-pointing.csv"), receivers: named("-receivers.csv") }
    }

    /// The files that these errors make.
    pub(super) fn of(&self, errors: &[Error]) -> Vec<&Path> {
        let turned = errors.iter().any(|e| matches!(e, Error::Pointing(_) | Error::Width(_)));
        let received = errors.iter().any(|e| matches!(e, Error::Band(_)));
        [(turned, &self.pointings), (received, &self.receivers)].into_iter().filter(|(made, _)| *made).map(|(_, p)| p.as_path()).collect()
    }

    /// Write them, and name them in the outcome.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn write(&self, truth: &SceneErrors, layout: &ArrayLayout, overwrite: bool, mut outcome: Outcome) -> Result<Outcome> {
        if let Some(pointings) = &truth.pointings {
            cittert_formats::write_pointings(&self.pointings, layout, pointings, overwrite)?;
            outcome = outcome.wrote(&self.pointings);
        }
        if let Some(receivers) = truth.receivers.as_ref().filter(|r| r.shaped) {
            let of: Vec<[f64; 3]> = receivers.of.iter().map(|r| [r.offset_hz, r.width, r.jitter_s]).collect();
            cittert_formats::write_receivers(&self.receivers, layout, &of, overwrite)?;
            outcome = outcome.wrote(&self.receivers);
        }
        Ok(outcome)
    }
}
