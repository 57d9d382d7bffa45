//! A focal-plane array.

use super::kind::Field;
use super::samples::Samples;
use crate::Result;

pub(super) fn make(field: Field) -> Result<Samples> {
    Ok(Samples::stepped(field.dim, field.dim, field.frame_s, field.efficiency))
}
