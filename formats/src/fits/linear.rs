//! Two-dimensional arrays with linear axes, such as u-v masks and gridded weights.

use super::header::HeaderWriter;
use super::input::padding;
use crate::atomic::AtomicFile;
use crate::{FormatError, Result};
use ndarray::ArrayView2;
use std::io::{BufWriter, Write};
use std::path::Path;

/// A linear axis of a FITS array: value = crval + (pixel - crpix) cdelt, pixels counted from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearAxis {
    /// CTYPE, such as `UU` or `FREQ`.
    pub ctype: String,
    /// CUNIT, such as `lambda` or `Hz`.
    pub cunit: String,
    /// Pixel of the reference value, counted from 1.
    pub crpix: f64,
    /// Value at the reference pixel.
    pub crval: f64,
    /// Step from one pixel to the next.
    pub cdelt: f64,
}

impl LinearAxis {
    /// Write the five keywords of axis `k`.
    pub(crate) fn write(&self, header: &mut HeaderWriter, k: usize) {
        header.text(&format!("CTYPE{k}"), &self.ctype, "");
        header.real(&format!("CRPIX{k}"), self.crpix, "");
        header.real(&format!("CRVAL{k}"), self.crval, "");
        header.real(&format!("CDELT{k}"), self.cdelt, "");
        if !self.cunit.is_empty() {
            header.text(&format!("CUNIT{k}"), &self.cunit, "");
        }
    }
}

/// Write one plane \[row, column\] with linear axes (columns first) as 32-bit floats.
///
/// # Errors
/// As [`AtomicFile::create`], or a full disk.
pub fn write_plane(
    path: &Path,
    plane: ArrayView2<'_, f64>,
    axes: &[LinearAxis; 2],
    bunit: &str,
    history: &[String],
    overwrite: bool,
) -> Result<()> {
    let mut header = HeaderWriter::default();
    header.logical("SIMPLE", true, "conforms to FITS standard");
    header.integer("BITPIX", -32, "32-bit floating point");
    header.integer("NAXIS", 2, "");
    header.integer("NAXIS1", plane.ncols() as i64, "");
    header.integer("NAXIS2", plane.nrows() as i64, "");
    for (k, axis) in axes.iter().enumerate() {
        axis.write(&mut header, k + 1);
    }
    header.text("BUNIT", bunit, "");
    header.text("ORIGIN", "cittert", "");
    header.history(history);
    let out = AtomicFile::create(path, overwrite)?;
    let io = |e| FormatError::io(path, "write", e);
    let mut file = BufWriter::new(out.open()?);
    file.write_all(&header.finish()).map_err(io)?;
    for value in &plane {
        file.write_all(&(*value as f32).to_be_bytes()).map_err(io)?;
    }
    let len = 4 * plane.len() as u64;
    file.write_all(&vec![0; padding(len) as usize]).and_then(|()| file.flush()).map_err(io)?;
    drop(file);
    out.commit()
}
