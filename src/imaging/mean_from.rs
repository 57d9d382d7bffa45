//! Where the mean of an image is known from: total power, or nothing.

use super::imager::Imager;
use super::split::BackgroundChoice;
use super::total_power::ZeroSpacing;
use crate::progress::{Event, Observer};
use cittert_arrays::VisUnit;

/// Where the mean brightness of an image is known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeanFrom {
    /// Autocorrelations of antennas whose receivers are stated.
    Autocorrelations,
    /// The antenna temperature that the set states.
    Stated,
    /// The constant that was removed from the scene.
    Pedestal,
    /// The user gave the background.
    Given,
    /// Nothing measured it.
    Unknown,
}

impl MeanFrom {
    /// Name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Autocorrelations => "autocorrelations",
            Self::Stated => "stated",
            Self::Pedestal => "pedestal",
            Self::Given => "given",
            Self::Unknown => "unknown",
        }
    }
}

impl Imager<'_> {
    /// The zero spacing of an output channel by total power, if the set has autocorrelations and states what the receivers add to them.
    #[must_use]
    pub fn zero_spacing(&self, channel: usize) -> Option<ZeroSpacing> {
        self.survey().total_power.zero_spacing(self.channels()[channel].clone())
    }

    /// Where the mean of the image is known from.
    #[must_use]
    pub fn mean_from(&self) -> MeanFrom {
        let header = self.header();
        let thermal = header.unit == VisUnit::KelvinSr;
        let angle = || header.layout.pattern.solid_angle_sr(header.spectrum.mean_hz());
        if self.zero_spacing(0).is_some() {
            MeanFrom::Autocorrelations
        } else if header.pedestal_k.is_some() {
            MeanFrom::Pedestal
        } else if matches!(self.options().background, BackgroundChoice::Kelvin(_)) {
            MeanFrom::Given
        } else if thermal && header.antenna_temperature_k.is_some() && angle().is_some() {
            MeanFrom::Stated
        } else {
            MeanFrom::Unknown
        }
    }

    /// Say where the mean of an image in kelvin is known from, if it is measured or not known at all.
    pub fn say_mean(&self, observer: &dyn Observer) {
        if self.header().unit != VisUnit::KelvinSr {
            return;
        }
        if self.mean_from() == MeanFrom::Unknown {
            observer.event(Event::Note(
                "no total power was measured: the mean of the scene is unknown, and the level of the image only an estimate",
            ));
        }
        let Some(zero) = self.zero_spacing(0) else { return };
        let used = self.survey().total_power.used;
        observer.event(Event::Note(&format!(
            "{used} autocorrelations of {} antennas measure the zero spacing: {:.6e} {}, +- {:.1e}",
            zero.antennas,
            zero.value,
            self.header().unit.name(),
            zero.sigma
        )));
        if !zero.is_calibrated() {
            observer.event(Event::Warning(&format!(
                "the autocorrelations of the antennas differ by {:.0} times their noise: the amplitudes are not calibrated, and the zero spacing is \
                 uncertain by {:.1} %",
                zero.scatter,
                100.0 * zero.sigma / zero.value.abs()
            )));
        }
    }
}
