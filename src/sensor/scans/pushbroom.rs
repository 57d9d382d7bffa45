//! A line of detectors that moves across its direction.

use super::kind::Field;
use super::samples::Samples;
use crate::Result;

pub(super) fn make(field: Field) -> Result<Samples> {
    let mut samples = Samples::stepped(field.dim, (1, field.dim.1), field.frame_s, field.efficiency);
    samples.moved = if field.step { (0.0, 0.0) } else { (0.0, field.efficiency) };
    Ok(samples)
}
