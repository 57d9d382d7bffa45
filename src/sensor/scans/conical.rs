//! A beam that turns around an axis while the axis moves.

use super::kind::Field;
use super::samples::Samples;
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::Angle;

/// The columns of an arc lie below its middle by R - sqrt(R^2 - l^2), for the radius R and the distance l from the middle column. The samples of
/// a line have equal distances along the columns.
pub(super) fn make(field: Field) -> Result<Samples> {
    let (rows, columns) = field.dim;
    let radius = field.size_rad / field.pitch_rad;
    let half = (columns / 2) as f64;
    ensure!(
        radius > half,
        ChainError::bad_option(
            "scan",
            format!("conical={}", Angle(field.size_rad)),
            format!("an angle above half of the width of the image, {:.4} deg", (half * field.pitch_rad).to_degrees())
        )
    );
    let sag: Vec<f64> = (0..columns)
        .map(|c| {
            let x = c as f64 - half;
            // The difference of nearly equal numbers would lose digits for a large radius.
            x * x / (radius + (radius * radius - x * x).sqrt())
        })
        .collect();
    let more = sag.iter().fold(0.0_f64, |a, s| a.max(*s)).ceil() as usize;
    let mut samples = Samples::stepped((rows + more, columns), (field.beams.min(rows), 1), field.frame_s, field.efficiency);
    samples.moved = if field.step { (0.0, 0.0) } else { (1.0, 0.0) };
    samples.sag = sag;
    Ok(samples)
}
