//! What a scan pattern is.

use super::samples::Samples;
use crate::Result;

/// One row of the table of patterns.
#[derive(Debug, Clone, Copy)]
pub struct ScanKind {
    /// Its name.
    pub name: &'static str,
    /// The angle that it needs, if any.
    pub size: Option<&'static str>,
    /// Function that lays it over rows and columns of samples.
    pub(super) make: fn(Field) -> Result<Samples>,
    /// What it is.
    pub about: &'static str,
}

/// What a pattern covers, and in which time.
#[derive(Debug, Clone, Copy)]
pub(in crate::sensor) struct Field {
    /// Number of rows and columns of the image.
    pub(in crate::sensor) dim: (usize, usize),
    /// Distance of neighbouring samples, rad.
    pub(in crate::sensor) pitch_rad: f64,
    /// Time of the whole image, s, and the part of it in which detectors look at the scene.
    pub(in crate::sensor) frame_s: f64,
    pub(in crate::sensor) efficiency: f64,
    /// Number of lines that are taken at once.
    pub(in crate::sensor) beams: usize,
    /// The scan stands still during a sample.
    pub(in crate::sensor) step: bool,
    /// The angle of the pattern, rad; 0 if it has none.
    pub(in crate::sensor) size_rad: f64,
}
