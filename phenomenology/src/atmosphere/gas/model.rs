//! The interface of a model of gas absorption.

use super::lines::GasSpectrum;
use crate::atmosphere::air::AirState;

/// A line-by-line model of gas absorption, 1-1000 GHz.
pub trait GasModel: std::fmt::Debug + Send + Sync {
    /// Name of the model in [`super::GAS_MODELS`].
    fn name(&self) -> &'static str;

    /// Lines and continua of the model for one state of air.
    fn spectrum(&self, air: &AirState) -> GasSpectrum;
}
