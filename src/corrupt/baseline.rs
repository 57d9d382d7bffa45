//! Constants that are added to the visibilities of a baseline. No antenna gain can remove them.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use crate::values::DataFlux;
use cittert_arrays::{GainTable, VisibilityBlock};
use num_complex::Complex;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// V + c, with a complex c for each baseline and product. c is constant in time and over the band. It describes leakage between the signal
/// paths of the two antennas, or an offset of the correlator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BaselineOffset {
    /// Standard deviation of the real and of the imaginary part, in the unit of the set.
    pub rms: f64,
}

/// Options of baseline offsets.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct BaselineOptions {
    /// Rms of a constant added to each baseline, such as 10mJy, or 1e-6Ksr for a set in K sr.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FLUX"))]
    pub baseline_offset: Option<DataFlux>,
}

impl BaselineOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<BaselineOffset>> {
        self.baseline_offset.map(|rms| Ok(BaselineOffset { rms: rms.in_unit("baseline-offset", shared.unit)? })).transpose()
    }
}

impl Corruption for BaselineOffset {
    fn check(&self) -> Result<()> {
        need_size("baseline offset", self.rms)
    }

    fn data(&self, context: &Context<'_>, _table: &GainTable, block: &mut VisibilityBlock, _first_row: u64) -> Result<()> {
        let n_pol = block.vis.shape()[2];
        for row in 0..block.n_rows() {
            let (a, b) = (block.coverage.ant1[row], block.coverage.ant2[row]);
            if a == b {
                continue;
            }
            // The offset does not depend on which antenna is first, except that it is conjugated.
            let mut rng = context.rng(u64::from(a.min(b)) << 32 | u64::from(a.max(b)));
            for pol in 0..n_pol {
                let (re, im): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                let im = if a < b { im } else { -im };
                let offset = Complex::new((self.rms * re) as f32, (self.rms * im) as f32);
                block.vis.slice_mut(ndarray::s![row, .., pol]).iter_mut().for_each(|v| *v += offset);
            }
        }
        Ok(())
    }
}
