//! Amplitude errors of the antennas.

use super::phase::multiply;
use super::{Context, Corruption, Variation, need_size};
use crate::Result;
use cittert_arrays::GainTable;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// g = exp(a) with a Gaussian a, so that amplitudes stay positive; for small errors `rms` is the relative error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeError {
    /// Standard deviation of ln |g|.
    pub rms: f64,
    /// Its behaviour in time.
    #[serde(default, flatten)]
    pub variation: Variation,
}

impl Corruption for AmplitudeError {
    fn check(&self) -> Result<()> {
        need_size("amplitude rms", self.rms)?;
        self.variation.check()
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        multiply(context, table, &self.variation, |x| Complex64::new((self.rms * x).exp(), 0.0));
        Ok(())
    }
}
