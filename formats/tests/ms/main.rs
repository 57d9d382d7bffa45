//! Sets written and read back, and directories that are no Measurement Sets.

#![cfg(test)] // so that clippy takes the helpers for tests too

#[path = "../common/mod.rs"]
mod common;
mod endings;
mod hostile;
mod round_trip;

use cittert_arrays::{UvCoverage, VisibilityBlock, VisibilitySet, VisibilitySource};
use cittert_formats::ms::{MsSource, MsWriter};
use cittert_formats::{CreateOptions, VisColumn};
use std::path::{Path, PathBuf};

fn temp() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ms");
    (dir, path)
}

/// Write in blocks of `step` rows; what was said.
fn write(path: &Path, set: &VisibilitySet, step: usize) -> Vec<String> {
    let mut writer = MsWriter::create(path, &set.header, &CreateOptions::default()).unwrap();
    let n = set.data.n_rows();
    for start in (0..n).step_by(step) {
        writer.write(&set.data.rows(start..(start + step).min(n)).unwrap()).unwrap();
    }
    writer.complete().unwrap()
}

/// Read a column in blocks of `step` rows.
fn read(path: &Path, column: VisColumn, step: usize) -> VisibilitySet {
    let mut source = MsSource::open(path, column).unwrap();
    let (n, header) = (source.n_rows(), source.header().clone());
    let (_, n_chan, n_pol) = header.shape(0);
    let mut data = VisibilityBlock::zeros(UvCoverage::empty(), n_chan, n_pol);
    for start in (0..n).step_by(step) {
        data.append(&source.read(start..(start + step).min(n)).unwrap()).unwrap();
    }
    VisibilitySet::new(header, data).unwrap()
}
