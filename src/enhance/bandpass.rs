//! Temperature bandpass.

use super::step::{Given, Step};
use crate::Result;
use crate::values::need;
use ndarray::{Array2, ArrayView2};

#[derive(Debug)]
struct Bandpass {
    low: f64,
    high: f64,
}

impl Step for Bandpass {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(bandpass(frame.view(), self.low, self.high))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    let (low, high) = (given.number(0), given.number(1));
    need("steps", format!("bandpass={low}:{high}"), low < high, "a low limit below the high one")?;
    Ok(Box::new(Bandpass { low, high }))
}

/// Values below `low` become `low`, values above `high` become `high`, so that the colours of a picture are left to what lies between.
#[must_use]
pub fn bandpass(plane: ArrayView2<'_, f64>, low: f64, high: f64) -> Array2<f64> {
    plane.mapv(|v| v.clamp(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_band_is_kept_and_the_rest_has_its_limits() {
        assert_eq!(bandpass(array![[1.0, 2.5, 9.0]].view(), 2.0, 3.0), array![[2.0, 2.5, 3.0]]);
    }
}
