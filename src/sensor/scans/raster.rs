//! Beams that scan line after line.

use super::kind::Field;
use super::samples::Samples;
use crate::Result;

pub(super) fn make(field: Field) -> Result<Samples> {
    let mut samples = Samples::stepped(field.dim, (field.beams.min(field.dim.0), 1), field.frame_s, field.efficiency);
    samples.moved = if field.step { (0.0, 0.0) } else { (1.0, 0.0) };
    Ok(samples)
}
