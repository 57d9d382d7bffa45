//! CalH5 in the table of formats.

use super::read::{is_gains, read_gains};
use super::write::write_gains;
use crate::format::{Format, GainFormat, Holds, Label};
use crate::h5;
use std::path::Path;

pub(crate) struct CalH5;

impl Format for CalH5 {
    fn label(&self) -> Label {
        Label {
            name: "CalH5",
            extensions: &["calh5"],
            description: "antenna gains and delays (HDF5), as pyuvdata's UVCal reads and applies them",
        }
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        start.starts_with(h5::SIGNATURE) && is_gains(path)
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Gains(GainFormat { read: read_gains, write: write_gains })
    }
}
