//! Leakage between the feeds of an antenna.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::{ChainError, Result, ensure};
use cittert_arrays::GainTable;
use cittert_arrays::feeds::FourProducts;
use ndarray::{Array4, s};
use num_complex::Complex64;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Each feed receives d times the field of the other feed too, with a complex Gaussian d for each antenna and feed, constant in time and over the
/// band. It acts before the gains.
///
/// # Reference
/// Hamaker & Bregman 1996, A&AS 117, 161 (D-terms); Sault, Hamaker & Bregman 1996, A&AS 117, 149.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LeakageError {
    /// Rms of |d|.
    pub rms: f64,
}

/// Options of leakage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct LeakageOptions {
    /// Rms of the part of the field of the other feed that each feed receives, for sets of four products.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub leakage_rms: Option<f64>,
}

impl LeakageOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<LeakageError>> {
        Ok(self.leakage_rms.map(|rms| LeakageError { rms }))
    }
}

impl Corruption for LeakageError {
    fn check(&self) -> Result<()> {
        need_size("leakage-rms", self.rms)
    }

    fn tells_feeds_apart(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        ensure!(FourProducts::of(&context.header.polarizations).is_some(), needs_four("leakage"));
        let mut leakages = table.leakages.take().unwrap_or_else(|| Array4::zeros(table.gains.dim()));
        for ant in 0..table.gains.dim().1 {
            for feed in 0..2 {
                let mut rng = context.rng((2 * ant + feed) as u64);
                let (re, im): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                let d = Complex64::new(re, im) * (self.rms * std::f64::consts::FRAC_1_SQRT_2);
                leakages.slice_mut(s![.., ant, .., feed]).mapv_inplace(|v| v + d);
            }
        }
        table.leakages = Some(leakages);
        Ok(())
    }
}

/// The error of a set that lacks products.
pub(super) fn needs_four(kind: &str) -> ChainError {
    ChainError::Incompatible(format!(
        "the error {kind} needs the four products of two feeds, such as RR,RL,LR,LL: simulate the set with them"
    ))
}
