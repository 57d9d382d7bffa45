//! A turbulent atmosphere: a frozen phase screen that the wind carries over the array.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::screen::{Screen, Wind, need_span, shortest_distance};
use super::shared::Shared;
use crate::Result;
use cittert_arrays::GainTable;
use cittert_arrays::quantity::{Angle, Length};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A thin screen of water vapour. The phase difference between two antennas at a distance r has the variance (structure function) D(r) =
/// rms^2 (r / baseline)^(5/3) while r is far below the outer scale (the exponent is 1.59 at a hundredth of it), and levels off beyond it.
/// The path is the same at all frequencies, so phases are proportional to the frequency. They are also proportional to the secant of the
/// zenith angle.
///
/// # Reference
/// Power spectrum (k^2 + k0^2)^(-11/6), k0 = 2 pi / L0: von Karman 1948, PNAS 34, 530; frozen flow: Taylor 1938, Proc. R. Soc. A
/// 164, 476; for radio arrays: Thompson, Moran & Swenson 2017, sect. 13.1.7 and 13.2.2.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Troposphere {
    /// Rms of the phase difference of two antennas `baseline_m` apart at the middle of the band and the zenith, rad.
    pub rms_rad: f64,
    /// Distance between two antennas with the phase difference `rms_rad`, m.
    pub baseline_m: f64,
    /// The wind that carries the screen, its height and outer scale.
    #[serde(flatten)]
    pub wind: Wind,
}

/// Options of the troposphere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct TroposphereOptions {
    /// A turbulent atmosphere: rms phase between two antennas that are one troposphere baseline apart.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub troposphere: Option<Angle>,
    /// Distance between two antennas at which the rms phase of the troposphere holds.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = TroposphereOptions::default().troposphere_baseline))]
    pub troposphere_baseline: Length,
}

impl Default for TroposphereOptions {
    fn default() -> Self {
        Self { troposphere: None, troposphere_baseline: Length(1000.0) }
    }
}

impl TroposphereOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<Troposphere>> {
        Ok(self.troposphere.map(|rms| self.model(rms, shared.wind.model())))
    }

    fn model(&self, rms: Angle, wind: Wind) -> Troposphere {
        Troposphere { rms_rad: rms.si(), baseline_m: self.troposphere_baseline.si(), wind }
    }
}

impl Troposphere {
    fn screen(&self, finest_m: f64, rng: &mut impl rand::Rng) -> Screen {
        Screen::new(self.rms_rad, self.baseline_m, self.wind.outer_scale_m, finest_m.min(self.baseline_m), rng)
    }
}

impl Default for Troposphere {
    /// One radian over 1 km, as at centimetre wavelengths in moderate weather, in a layer 1 km up.
    fn default() -> Self {
        TroposphereOptions::default().model(Angle(1.0), Wind::default())
    }
}

impl Corruption for Troposphere {
    fn check(&self) -> Result<()> {
        need_size("phase rms of the troposphere in rad", self.rms_rad)?;
        self.wind.check()?;
        need_span("baseline of the troposphere in m", self.baseline_m)
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn needs_direction(&self) -> bool {
        true
    }

    fn blows(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let layout = &context.header.layout;
        let shortest = shortest_distance(layout.antennas().iter().map(|a| a.position_m));
        let screen = self.screen(shortest, &mut context.rng(0));
        let middle = context.header.spectrum.mean_hz();
        let (n_time, n_ant, n_chan, n_feed) = table.gains.dim();
        for time in 0..n_time {
            let blown = self.wind.way(context.seconds[time]);
            // The line of sight crosses the screen beside the antenna and at an angle.
            let (shift, secant) = self.wind.crossing(context, time)?;
            for ant in 0..n_ant {
                let p = layout.antennas()[ant].position_m;
                let phase = secant * screen.at([0, 1].map(|k| p[k] + shift[k] - blown[k]));
                for chan in 0..n_chan {
                    let g = Complex64::cis(phase * context.freq_hz[chan] / middle);
                    for feed in 0..n_feed {
                        table.gains[[time, ant, chan, feed]] *= g;
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    fn outer(outer_scale_m: f64) -> Wind {
        Wind { outer_scale_m, ..Wind::default() }
    }

    /// Mean squared phase difference at each distance, over screens and directions.
    fn structure(model: &Troposphere, distances: &[f64], screens: u64) -> Vec<f64> {
        let mut sums = vec![0.0; distances.len()];
        for seed in 0..screens {
            let screen = model.screen(10.0, &mut stream(seed, "screen", 0));
            for (sum, r) in sums.iter_mut().zip(distances) {
                for j in 0..4 {
                    let angle = f64::from(j) * 0.8;
                    *sum += (screen.at([r * angle.cos(), r * angle.sin()]) - screen.at([0.0, 0.0])).powi(2) / 4.0;
                }
            }
        }
        sums.iter().map(|s| s / screens as f64).collect()
    }

    #[test]
    fn the_structure_function_has_its_size_and_rises_with_the_five_thirds_power() {
        // The squared difference, averaged over four directions, scatters by 0.94 of its mean from screen to screen, because most of it is
        // a gradient over the array. The mean of 1000 screens has an error of 3 per cent. The test allows four times as much.
        let model = Troposphere { rms_rad: 0.5, baseline_m: 100.0, wind: outer(1e5) };
        let d = structure(&model, &[100.0], 1000)[0];
        assert!((d / 0.25 - 1.0).abs() < 0.12, "{d}");
        let wide = Troposphere { wind: outer(1e8), ..model };
        let d = structure(&wide, &[30.0, 1000.0], 250);
        let slope = (d[1] / d[0]).ln() / (1000.0_f64 / 30.0).ln();
        // Each of the two ends is accurate to 6 per cent (one sigma), over 3.5 e-folds.
        assert!((slope - 5.0 / 3.0).abs() < 0.07, "{slope}");
    }

    #[test]
    fn the_structure_function_levels_off_beyond_the_outer_scale() {
        let model = Troposphere { wind: outer(300.0), ..Troposphere::default() };
        let d = structure(&model, &[3000.0, 9000.0], 250);
        assert!((d[1] / d[0] - 1.0).abs() < 0.3, "{d:?}");
    }

    #[test]
    fn the_phase_at_a_point_is_gaussian() {
        let model = Troposphere { wind: outer(500.0), ..Troposphere::default() };
        let values: Vec<f64> = (0..1500).map(|k| model.screen(100.0, &mut stream(k, "screen", 0)).at([3.0, 4.0])).collect();
        let moment = |p: i32| values.iter().map(|v| v.powi(p)).sum::<f64>() / values.len() as f64;
        // Kurtosis 3 with a standard error of sqrt(24 / 1500) = 0.13.
        let kurtosis = moment(4) / moment(2).powi(2);
        assert!((kurtosis - 3.0).abs() < 0.5, "{kurtosis}");
    }

    #[test]
    fn impossible_screens_are_refused() {
        assert!(Troposphere { wind: outer(0.0), ..Troposphere::default() }.check().is_err());
        assert!(Troposphere { rms_rad: -1.0, ..Troposphere::default() }.check().is_err());
        assert!(Troposphere::default().check().is_ok());
    }
}
