//! What a receiver adds to the autocorrelation of its antenna.
//!
//! An autocorrelation is the power of one antenna: that of the scene, which is the zero spacing, and that of the receiver. Only a set that states
//! the receivers tells the two apart.

use crate::{ArrayLayout, Sensitivity, VisUnit, jy_per_kelvin_sr};

impl ArrayLayout {
    /// The power that the receiver of an antenna adds to its autocorrelation, in this unit at a frequency in Hz. `None` where it is not stated, or
    /// stated as a temperature while no pattern gives the solid angle that it fills.
    #[must_use]
    pub fn receiver_power(&self, antenna: usize, unit: VisUnit, freq_hz: f64) -> Option<f64> {
        let per_kelvin_sr = jy_per_kelvin_sr(freq_hz);
        let jy = match self.antennas().get(antenna)?.receiver? {
            Sensitivity::SefdJy(v) => v,
            Sensitivity::TsysK(0.0) => 0.0,
            Sensitivity::TsysK(t) => t * self.pattern.solid_angle_sr(freq_hz)? * per_kelvin_sr,
        };
        match unit {
            VisUnit::Jy => Some(jy),
            VisUnit::KelvinSr => Some(jy / per_kelvin_sr),
            VisUnit::Uncalibrated => None,
        }
    }

    /// State the receivers of all antennas.
    #[must_use]
    pub fn with_receivers(mut self, receivers: &[Sensitivity]) -> Self {
        for (antenna, receiver) in self.antennas_mut().iter_mut().zip(receivers) {
            antenna.receiver = Some(*receiver);
        }
        self
    }

    /// True if the receiver of every antenna is stated, so that autocorrelations measure total power.
    #[must_use]
    pub fn states_receivers(&self) -> bool {
        self.antennas().iter().all(|a| a.receiver.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Antenna, LayoutFrame};

    #[test]
    fn a_temperature_fills_the_solid_angle_of_the_pattern() {
        let antennas = (0..2_u32).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k), 0.0, 0.0])).collect();
        let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        assert_eq!(layout.receiver_power(0, VisUnit::Jy, 94e9), None);
        layout = layout.with_receivers(&[Sensitivity::TsysK(600.0), Sensitivity::SefdJy(5e8)]);
        assert!(layout.states_receivers());
        assert_eq!(layout.receiver_power(0, VisUnit::KelvinSr, 94e9), None, "no solid angle");
        layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
        let omega = layout.pattern.solid_angle_sr(94e9).unwrap();
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() / b - 1.0).abs() < 1e-12, "{a:?} {b}");
        near(layout.receiver_power(0, VisUnit::KelvinSr, 94e9), 600.0 * omega);
        near(layout.receiver_power(0, VisUnit::Jy, 94e9), 600.0 * omega * jy_per_kelvin_sr(94e9));
        near(layout.receiver_power(1, VisUnit::Jy, 94e9), 5e8);
        near(layout.receiver_power(1, VisUnit::KelvinSr, 94e9), 5e8 / jy_per_kelvin_sr(94e9));
        assert_eq!(layout.receiver_power(0, VisUnit::Uncalibrated, 94e9), None);
        assert_eq!(layout.receiver_power(2, VisUnit::Jy, 94e9), None, "no such antenna");
    }
}
