//! What is read first of an HDF5 file, read in the child process that looks at it: the library crashes in the conversion of damaged
//! types too, so the child must ask for the same types as the reader.

use crate::VisColumn;
use crate::calh5::{is_gains, read_gains};
use crate::uvh5::Uvh5Reader;
use cittert_arrays::VisibilitySource;
use std::path::Path;

/// Elements of visibilities that are read.
const SMALL: usize = 1 << 17;

/// Read gains, or the first and last rows of visibilities. Errors are for the program to meet and to word.
pub(crate) fn rehearse(path: &Path) {
    for column in Uvh5Reader::columns(path).unwrap_or_default().into_iter().chain([VisColumn::Data]) {
        if let Ok(reader) = Uvh5Reader::open_column(path, column) {
            let (_, n_chan, n_pol) = reader.header().shape(0);
            let (n, some) = (reader.n_rows(), (SMALL / (n_chan * n_pol).max(1)).max(1));
            let _ = reader.read(0..some.min(n));
            let _ = reader.read(n.saturating_sub(1)..n);
        }
    }
    if is_gains(path) {
        let _ = read_gains(path);
    }
}
