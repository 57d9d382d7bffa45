//! The shape of the band of each receiver, and bands that are out of tune.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use crate::simulate::{BandShape, Receivers};
use cittert_arrays::quantity::Frequency;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Each channel is the integral of H_p conj(H_q) V over the frequency, with the responses H of the two receivers, over the root of the product of
/// their powers. The response of a receiver is its shape, moved by a Gaussian offset and wider by exp(a) with a Gaussian a.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BandError {
    /// Shape over a channel.
    pub shape: BandShape,
    /// Standard deviation of the offset of a receiver, Hz.
    pub offset_rms_hz: f64,
    /// Standard deviation of a.
    pub width_rms: f64,
}

/// Options of bands.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct BandErrorOptions {
    /// Shape of the band of the receivers over each channel: flat, gaussian, butterworth:ORDER, chebyshev:ORDER,RIPPLE (dB) or a CSV file with
    /// the complex response of all or of each antenna.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND|FILE"))]
    pub band_shape: Option<BandShape>,
    /// Rms of the frequency by which the bands of the receivers are off.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub band_offset_rms: Option<Frequency>,
    /// Rms of the logarithm of the widths of the bands.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub band_width_rms: Option<f64>,
}

impl BandErrorOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<BandError>> {
        let asked = *self != Self::default();
        Ok(asked.then(|| BandError {
            shape: self.band_shape.clone().unwrap_or_default(),
            offset_rms_hz: self.band_offset_rms.map_or(0.0, Frequency::si),
            width_rms: self.band_width_rms.unwrap_or(0.0),
        }))
    }
}

impl Corruption for BandError {
    fn check(&self) -> Result<()> {
        if !matches!(self.shape, BandShape::File(_)) {
            self.shape.check()?;
        }
        need_size("band offset rms in Hz", self.offset_rms_hz)?;
        need_size("band width rms", self.width_rms)
    }

    fn of_scene(&self) -> bool {
        true
    }

    fn receivers(&self, context: &Context<'_>, receivers: &mut Receivers) -> Result<()> {
        self.shape.check()?;
        receivers.shaped = true;
        for (ant, receiver) in receivers.of.iter_mut().enumerate() {
            let mut rng = context.rng(ant as u64);
            let [offset, width]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            receiver.shape = self.shape.clone();
            receiver.offset_hz += self.offset_rms_hz * offset;
            receiver.width *= (self.width_rms * width).exp();
        }
        Ok(())
    }
}
