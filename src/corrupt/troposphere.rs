//! A turbulent atmosphere: a frozen phase screen that the wind carries over the array.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::variation::Variation;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::quantity::{Angle, Length, Speed};
use cittert_arrays::{GainTable, LayoutFrame, VisUnit};
use num_complex::Complex64;
use rand::RngExt;
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
    /// Speed of the wind, m/s.
    pub wind_m_s: f64,
    /// Direction that the wind blows to, rad: from north (y) towards east (x).
    pub wind_to_rad: f64,
    /// Height of the screen over the array, m.
    pub height_m: f64,
    /// Outer scale L0, m.
    pub outer_scale_m: f64,
}

/// Number of rings of wave numbers per decade.
const RINGS_A_DECADE: f64 = 16.0;
/// Number of waves in each ring.
const WAVES_A_RING: usize = 24;
/// Smallest sine of the elevation. Below 3 degrees the path through a flat screen is wrong because of the curvature of the Earth.
const LOWEST_SINE: f64 = 0.05;

/// One plane wave of the screen.
#[derive(Debug)]
struct Wave {
    /// Wave vector, rad/m.
    kx: f64,
    ky: f64,
    /// Amplitude and phase, rad.
    size: f64,
    phase: f64,
}

/// The screen as a sum of plane waves. It has no grid, so it has no edge and no period, however far the wind moves it.
#[derive(Debug)]
struct Screen {
    waves: Vec<Wave>,
}

impl Screen {
    /// Draw a screen. `finest_m` is the smallest distance that matters.
    fn new(model: &Troposphere, finest_m: f64, rng: &mut impl rand::Rng) -> Self {
        let rings = rings(model, finest_m);
        let mut waves = Vec::with_capacity(rings.len() * WAVES_A_RING);
        for (k, variance) in rings {
            // Directions spread evenly with a random start keep each ring isotropic.
            let start: f64 = rng.random::<f64>();
            for j in 0..WAVES_A_RING {
                let angle = std::f64::consts::TAU * (start + j as f64) / WAVES_A_RING as f64;
                let amplitude = (2.0 * variance / WAVES_A_RING as f64).sqrt();
                // Two quadratures with Gaussian sizes give a Gaussian phase at every point.
                let (a, b): (f64, f64) = (normal(rng), normal(rng));
                let size = amplitude * a.hypot(b) / std::f64::consts::SQRT_2;
                waves.push(Wave { kx: k * angle.cos(), ky: k * angle.sin(), size, phase: b.atan2(a) });
            }
        }
        Self { waves }
    }

    /// Phase at a point of the screen, rad.
    fn at(&self, x: f64, y: f64) -> f64 {
        self.waves.iter().map(|w| w.size * (w.kx * x + w.ky * y + w.phase).cos()).sum()
    }
}

fn normal(rng: &mut impl rand::Rng) -> f64 {
    rand_distr::Distribution::sample(&rand_distr::StandardNormal, rng)
}

/// Wave numbers (rad/m) of the rings and the variance of the phase in each, scaled to D(baseline) = rms^2.
fn rings(model: &Troposphere, finest_m: f64) -> Vec<(f64, f64)> {
    let k0 = std::f64::consts::TAU / model.outer_scale_m;
    // Wave numbers below an eighth of that of the outer scale contain a hundredth of the plateau. Waves shorter than a quarter of the finest
    // distance contain (1/4)^(5/3), a tenth, of the variance at that distance.
    let (low, high) = (k0 / 8.0, (std::f64::consts::TAU * 4.0 / finest_m).max(100.0 * k0));
    let n = ((high / low).log10() * RINGS_A_DECADE).ceil().max(1.0);
    let step = (high / low).powf(1.0 / n);
    let mut rings: Vec<(f64, f64)> = (0..n as usize)
        .map(|i| {
            let k = low * step.powf(i as f64 + 0.5);
            let width = k * (step.sqrt() - 1.0 / step.sqrt());
            (k, (k * k + k0 * k0).powf(-11.0 / 6.0) * k * width)
        })
        .collect();
    let structure: f64 = rings.iter().map(|(k, v)| 2.0 * v * (1.0 - libm::j0(k * model.baseline_m))).sum();
    let scale = model.rms_rad * model.rms_rad / structure;
    rings.iter_mut().for_each(|r| r.1 *= scale);
    rings
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
    /// Speed of the wind that carries the screen, such as 10m/s.
    #[cfg_attr(feature = "cli", arg(long, value_name = "SPEED", default_value_t = TroposphereOptions::default().wind))]
    pub wind: Speed,
    /// Direction that the wind blows to, from north towards east.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true, default_value_t = TroposphereOptions::default().wind_to))]
    pub wind_to: Angle,
    /// Height of the screen over the array.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = TroposphereOptions::default().screen_height))]
    pub screen_height: Length,
    /// Outer scale of the turbulence.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = TroposphereOptions::default().outer_scale))]
    pub outer_scale: Length,
}

impl Default for TroposphereOptions {
    fn default() -> Self {
        Self {
            troposphere: None,
            troposphere_baseline: Length(1000.0),
            wind: Speed(10.0),
            wind_to: Angle(45.0_f64.to_radians()),
            screen_height: Length(1000.0),
            outer_scale: Length(10_000.0),
        }
    }
}

impl TroposphereOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _variation: Variation, _unit: VisUnit) -> Result<Option<Troposphere>> {
        Ok(self.troposphere.map(|rms| self.model(rms)))
    }

    fn model(&self, rms: Angle) -> Troposphere {
        Troposphere {
            rms_rad: rms.si(),
            baseline_m: self.troposphere_baseline.si(),
            wind_m_s: self.wind.si(),
            wind_to_rad: self.wind_to.si(),
            height_m: self.screen_height.si(),
            outer_scale_m: self.outer_scale.si(),
        }
    }
}

impl Default for Troposphere {
    /// One radian over 1 km, as at centimetre wavelengths in moderate weather, in a layer 1 km up.
    fn default() -> Self {
        TroposphereOptions::default().model(Angle(1.0))
    }
}

impl Corruption for Troposphere {
    fn check(&self) -> Result<()> {
        need_size("phase rms of the troposphere in rad", self.rms_rad)?;
        need_size("wind speed in m/s", self.wind_m_s)?;
        need_size("height of the screen in m", self.height_m)?;
        need("wind direction in rad", self.wind_to_rad, self.wind_to_rad.is_finite(), "a finite angle")?;
        for (option, v) in [("baseline of the troposphere in m", self.baseline_m), ("outer scale in m", self.outer_scale_m)] {
            need(option, v, (1e-3..=1e8).contains(&v), "a length from 1 mm to 100,000 km")?;
        }
        Ok(())
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn needs_direction(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let layout = &context.header.layout;
        let shortest = shortest_distance(layout.antennas().iter().map(|a| a.position_m));
        let screen = Screen::new(self, shortest.min(self.baseline_m), &mut context.rng(0));
        let (sin, cos) = self.wind_to_rad.sin_cos();
        let middle = context.header.spectrum.mean_hz();
        let on_earth = matches!(layout.frame, LayoutFrame::EastNorthUp(_));
        let (n_time, n_ant, n_chan, n_feed) = table.gains.dim();
        for time in 0..n_time {
            let blown = self.wind_m_s * context.seconds[time];
            // The line of sight crosses the screen beside the antenna and at an angle.
            let s = context.toward[time];
            let (shift, secant) = if on_earth {
                let up = s[2];
                if !(up >= LOWEST_SINE) {
                    return Err(ChainError::Incompatible(format!(
                        "the phase centre is {:.2} deg above the horizon at JD {}: a flat troposphere needs at least {:.2} deg",
                        up.asin().to_degrees(),
                        context.time_jd[time],
                        LOWEST_SINE.asin().to_degrees()
                    )));
                }
                ([self.height_m * s[0] / up, self.height_m * s[1] / up], 1.0 / up)
            } else {
                ([0.0, 0.0], 1.0)
            };
            for ant in 0..n_ant {
                let p = layout.antennas()[ant].position_m;
                let phase = secant * screen.at(p[0] + shift[0] - blown * sin, p[1] + shift[1] - blown * cos);
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

/// Smallest horizontal distance of two antennas, m. It is 1 m if all antennas are at one position.
fn shortest_distance(positions: impl Iterator<Item = [f64; 3]>) -> f64 {
    let positions: Vec<[f64; 3]> = positions.collect();
    let mut shortest = f64::INFINITY;
    for (i, a) in positions.iter().enumerate() {
        for b in &positions[..i] {
            let d = (a[0] - b[0]).hypot(a[1] - b[1]);
            if d > 0.0 {
                shortest = shortest.min(d);
            }
        }
    }
    if shortest.is_finite() { shortest.max(1e-3) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    /// Mean squared phase difference at each distance, over screens and directions.
    fn structure(model: &Troposphere, distances: &[f64], screens: u64) -> Vec<f64> {
        let mut sums = vec![0.0; distances.len()];
        for seed in 0..screens {
            let screen = Screen::new(model, 10.0, &mut stream(seed, "screen", 0));
            for (sum, r) in sums.iter_mut().zip(distances) {
                for j in 0..4 {
                    let angle = f64::from(j) * 0.8;
                    *sum += (screen.at(r * angle.cos(), r * angle.sin()) - screen.at(0.0, 0.0)).powi(2) / 4.0;
                }
            }
        }
        sums.iter().map(|s| s / screens as f64).collect()
    }

    #[test]
    fn the_structure_function_has_its_size_and_rises_with_the_five_thirds_power() {
        // The squared difference, averaged over four directions, scatters by 0.94 of its mean from screen to screen, because most of it is
        // a gradient over the array. The mean of 1000 screens has an error of 3 per cent. The test allows four times as much.
        let model = Troposphere { rms_rad: 0.5, baseline_m: 100.0, outer_scale_m: 1e5, ..Troposphere::default() };
        let d = structure(&model, &[100.0], 1000)[0];
        assert!((d / 0.25 - 1.0).abs() < 0.12, "{d}");
        let wide = Troposphere { outer_scale_m: 1e8, ..model };
        let d = structure(&wide, &[30.0, 1000.0], 250);
        let slope = (d[1] / d[0]).ln() / (1000.0_f64 / 30.0).ln();
        // Each of the two ends is accurate to 6 per cent (one sigma), over 3.5 e-folds.
        assert!((slope - 5.0 / 3.0).abs() < 0.07, "{slope}");
    }

    #[test]
    fn the_structure_function_levels_off_beyond_the_outer_scale() {
        let model = Troposphere { outer_scale_m: 300.0, ..Troposphere::default() };
        let d = structure(&model, &[3000.0, 9000.0], 250);
        assert!((d[1] / d[0] - 1.0).abs() < 0.3, "{d:?}");
    }

    #[test]
    fn the_phase_at_a_point_is_gaussian() {
        let model = Troposphere { outer_scale_m: 500.0, ..Troposphere::default() };
        let values: Vec<f64> = (0..1500).map(|k| Screen::new(&model, 100.0, &mut stream(k, "screen", 0)).at(3.0, 4.0)).collect();
        let moment = |p: i32| values.iter().map(|v| v.powi(p)).sum::<f64>() / values.len() as f64;
        // Kurtosis 3 with a standard error of sqrt(24 / 1500) = 0.13.
        let kurtosis = moment(4) / moment(2).powi(2);
        assert!((kurtosis - 3.0).abs() < 0.5, "{kurtosis}");
    }

    #[test]
    fn impossible_screens_are_refused() {
        assert!(Troposphere { outer_scale_m: 0.0, ..Troposphere::default() }.check().is_err());
        assert!(Troposphere { rms_rad: -1.0, ..Troposphere::default() }.check().is_err());
        assert!(Troposphere::default().check().is_ok());
    }
}
