//! Options of the figures of merit.

use crate::quantity::{Duration, FluxDensity, Frequency, Length, Temperature};
use crate::{ArrayError, Result, Weighting};
use serde::{Deserialize, Serialize};

/// Side lobes count to this many wavelengths over the aperture, unless an option says otherwise.
pub const WITHIN: f64 = 30.0;

/// For which band, weights and receivers figures of merit hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Figures of merit"))]
pub struct FigureOptions {
    /// Full width of the band around the frequency: the beam is the mean over its channels, and the noise follows from it.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub bandwidth: Option<Frequency>,
    /// Number of equal channels in the band.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = FigureOptions::default().channels))]
    pub channels: usize,
    /// Scheme of the weights of the beam: natural, uniform or briggs. The density counts baselines in the cells of the u-v fill.
    #[cfg_attr(feature = "cli", arg(long, value_name = "SCHEME", value_enum, hide_possible_values = true, default_value_t = FigureOptions::default().weighting))]
    pub weighting: Weighting,
    /// Robustness of briggs weights, from -2 (close to uniform) to 2 (close to natural) [default: 0].
    #[cfg_attr(feature = "cli", arg(long, value_name = "R", allow_negative_numbers = true))]
    pub robust: Option<f64>,
    /// Distance from the centre to which side lobes count, in wavelengths over the aperture.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = FigureOptions::default().within))]
    pub within: f64,
    /// Diameter of the aperture, the unit of the distance to which side lobes count [default: that of the layout, else its longest baseline].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub aperture: Option<Length>,
    /// Width of a cell of the u-v fill, as a length in the aperture [default: smallest diameter, or shortest baseline].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub uv_cell: Option<Length>,
    /// Observing time of the noise.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = FigureOptions::default().time))]
    pub time: Duration,
    /// System temperature of all elements, instead of the layout's.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP", conflicts_with = "sefd"))]
    pub tsys: Option<Temperature>,
    /// System equivalent flux density of all elements, instead of the layout's.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FLUX"))]
    pub sefd: Option<FluxDensity>,
    /// Diameter of all elements, instead of the layout's.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub diameter: Option<Length>,
}

impl Default for FigureOptions {
    fn default() -> Self {
        Self {
            bandwidth: None,
            channels: 1,
            weighting: Weighting::Natural,
            robust: None,
            within: WITHIN,
            aperture: None,
            uv_cell: None,
            time: Duration(10.0),
            tsys: None,
            sefd: None,
            diameter: None,
        }
    }
}

impl FigureOptions {
    /// Check the numbers.
    ///
    /// # Errors
    /// A number out of its range, or an option without the one that it belongs to.
    pub fn check(&self, freq_hz: f64) -> Result<()> {
        let band = self.bandwidth.unwrap_or(Frequency(0.0));
        ArrayError::need(
            "bandwidth",
            band,
            self.bandwidth.is_none_or(|b| b.si() > 0.0 && b.si() < 2.0 * freq_hz),
            "a width above 0 that leaves all frequencies above 0",
        )?;
        ArrayError::need("channels", self.channels, (1..=4096).contains(&self.channels), "1 to 4096")?;
        ArrayError::need("channels", self.channels, self.channels == 1 || self.bandwidth.is_some(), "1, or a bandwidth that they divide")?;
        let robust = self.robust.unwrap_or(0.0);
        ArrayError::need("robust", robust, (-2.0..=2.0).contains(&robust), "a number from -2 (uniform) to 2 (natural)")?;
        let used = self.robust.is_none() || self.weighting == Weighting::Briggs;
        ArrayError::need("robust", robust, used, "no robustness, or the weighting briggs, which alone uses it")?;
        let within = self.within;
        ArrayError::need("within", within, within.is_finite() && within > 0.0, "a positive number of wavelengths over the aperture")?;
        for (option, length) in [("aperture", self.aperture), ("uv_cell", self.uv_cell), ("diameter", self.diameter)] {
            let length = length.unwrap_or(Length(1.0));
            ArrayError::need(option, length, length.si() > 0.0, "a positive length")?;
        }
        ArrayError::need("time", self.time, self.time.si() > 0.0, "a positive time")?;
        let (tsys, sefd) = (self.tsys.unwrap_or(Temperature(1.0)), self.sefd.unwrap_or(FluxDensity(1.0)));
        ArrayError::need("tsys", tsys, tsys.si() > 0.0, "a positive temperature")?;
        ArrayError::need("tsys", tsys, self.tsys.is_none() || self.sefd.is_none(), "no system temperature beside an SEFD")?;
        ArrayError::need("sefd", sefd, sefd.si() > 0.0, "a positive flux density")
    }

    /// Frequencies of the channels over the middle of the band.
    pub(super) fn scales(&self, freq_hz: f64) -> Vec<f64> {
        let width = self.bandwidth.map_or(0.0, |b| b.si() / freq_hz);
        let n = self.channels as f64;
        (0..self.channels).map(|c| 1.0 + width * ((c as f64 + 0.5) / n - 0.5)).collect()
    }
}
