//! `--freq`, `--bandwidth`, `--channels`.

use crate::cli::failure::Result;
use cittert_arrays::SpectralWindow;
use cittert_arrays::quantity::Frequency;
use clap::Args;

/// The receiver's band and its channels.
#[derive(Debug, Clone, Args)]
pub struct BandArgs {
    /// Centre of the band.
    #[arg(long, value_name = "FREQ")]
    pub freq: Frequency,
    /// Full width of the band.
    #[arg(long, value_name = "FREQ")]
    pub bandwidth: Frequency,
    /// Number of equal channels in the band.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub channels: usize,
}

impl BandArgs {
    /// The channels.
    ///
    /// # Errors
    /// Zero channels, a width that is not positive, a band that reaches below 0 Hz.
    pub fn spectrum(&self) -> Result<SpectralWindow> {
        Ok(SpectralWindow::band(self.freq.si(), self.bandwidth.si(), self.channels)?)
    }
}
