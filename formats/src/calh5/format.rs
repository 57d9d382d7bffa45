//! CalH5 in the table of formats.

use super::read::{is_gains, read_gains};
use super::write::write_gains;
use crate::format::{Format, GainFormat, Holds, Label};
use crate::{Result, h5};
use cittert_arrays::GainTable;
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
        Holds::Gains(self)
    }
}

impl GainFormat for CalH5 {
    fn read(&self, path: &Path) -> Result<GainTable> {
        read_gains(path)
    }

    fn write(&self, path: &Path, table: &GainTable, overwrite: bool) -> Result<()> {
        write_gains(path, table, overwrite)
    }
}
