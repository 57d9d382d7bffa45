//! Frozen turbulence on a plane over the array, which the wind carries.
//!
//! # Reference
//! Power spectrum (k^2 + k0^2)^(-11/6), k0 = 2 pi / L0: von Karman 1948, PNAS 34, 530; frozen flow: Taylor 1938, Proc. R. Soc. A
//! 164, 476; for radio arrays: Thompson, Moran & Swenson 2017, sect. 13.1.7 and 13.2.2.

use super::context::Context;
use super::corruption::need_size;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::LayoutFrame;
use cittert_arrays::quantity::{Angle, Length, Speed};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Number of rings of wave numbers per decade.
const RINGS_A_DECADE: f64 = 16.0;
/// Number of waves in each ring.
const WAVES_A_RING: usize = 24;
/// Smallest sine of the elevation. Below 3 degrees the path through a flat screen is wrong because of the curvature of the Earth.
const LOWEST_SINE: f64 = 0.05;

/// The wind that carries a screen, and the height and outer scale of the screen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wind {
    /// Speed of the wind, m/s.
    pub wind_m_s: f64,
    /// Direction that the wind blows to, rad: from north (y) towards east (x).
    pub wind_to_rad: f64,
    /// Height of the screen over the array, m.
    pub height_m: f64,
    /// Outer scale L0, m.
    pub outer_scale_m: f64,
}

/// Options of the wind and its screen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct WindOptions {
    /// Speed of the wind that carries the screen, such as 10m/s.
    #[cfg_attr(feature = "cli", arg(long, value_name = "SPEED", default_value_t = WindOptions::default().wind))]
    pub wind: Speed,
    /// Direction that the wind blows to, from north towards east.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true, default_value_t = WindOptions::default().wind_to))]
    pub wind_to: Angle,
    /// Height of the screen over the array.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = WindOptions::default().screen_height))]
    pub screen_height: Length,
    /// Outer scale of the turbulence.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = WindOptions::default().outer_scale))]
    pub outer_scale: Length,
}

impl Default for WindOptions {
    fn default() -> Self {
        Self { wind: Speed(10.0), wind_to: Angle(45.0_f64.to_radians()), screen_height: Length(1000.0), outer_scale: Length(10_000.0) }
    }
}

impl WindOptions {
    pub(super) fn model(&self) -> Wind {
        Wind {
            wind_m_s: self.wind.si(),
            wind_to_rad: self.wind_to.si(),
            height_m: self.screen_height.si(),
            outer_scale_m: self.outer_scale.si(),
        }
    }
}

impl Default for Wind {
    fn default() -> Self {
        WindOptions::default().model()
    }
}

impl Wind {
    pub(super) fn check(&self) -> Result<()> {
        need_size("wind speed in m/s", self.wind_m_s)?;
        need_size("height of the screen in m", self.height_m)?;
        need("wind direction in rad", self.wind_to_rad, self.wind_to_rad.is_finite(), "a finite angle")?;
        need_span("outer scale in m", self.outer_scale_m)
    }

    /// Way of the wind in a time, m: east and north.
    pub(super) fn way(&self, seconds: f64) -> [f64; 2] {
        let (sin, cos) = self.wind_to_rad.sin_cos();
        [self.wind_m_s * seconds * sin, self.wind_m_s * seconds * cos]
    }

    /// Where the lines of sight of an integration cross the screen, east and north of the antenna in m, and the secant of the zenith angle.
    ///
    /// # Errors
    /// The phase centre is too low for a flat screen.
    pub(super) fn crossing(&self, context: &Context<'_>, time: usize) -> Result<([f64; 2], f64)> {
        if !matches!(context.header.layout.frame, LayoutFrame::EastNorthUp(_)) {
            return Ok(([0.0, 0.0], 1.0));
        }
        let [east, north, up] = context.toward[time];
        if !(up >= LOWEST_SINE) {
            return Err(ChainError::Incompatible(format!(
                "the phase centre is {:.2} deg above the horizon at JD {}: a flat troposphere needs at least {:.2} deg",
                up.asin().to_degrees(),
                context.time_jd[time],
                LOWEST_SINE.asin().to_degrees()
            )));
        }
        Ok(([self.height_m * east / up, self.height_m * north / up], 1.0 / up))
    }
}

/// Check a length of turbulence.
pub(super) fn need_span(option: &'static str, value: f64) -> Result<()> {
    need(option, value, (1e-3..=1e8).contains(&value), "a length from 1 mm to 100,000 km")
}

/// One plane wave of the screen.
#[derive(Debug)]
struct Wave {
    /// Wave vector, rad/m.
    kx: f64,
    ky: f64,
    /// Amplitude, and phase in rad.
    size: f64,
    phase: f64,
}

/// The screen as a sum of plane waves. It has no grid, so it has no edge and no period, however far the wind moves it.
#[derive(Debug)]
pub(super) struct Screen {
    waves: Vec<Wave>,
}

impl Screen {
    /// Draw a screen whose values at two points `baseline_m` apart differ by `rms`. `finest_m` is the smallest distance that matters.
    pub(super) fn new(rms: f64, baseline_m: f64, outer_scale_m: f64, finest_m: f64, rng: &mut impl rand::Rng) -> Self {
        let rings = rings(rms, baseline_m, outer_scale_m, finest_m);
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

    /// Value at a point of the screen.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> f64 {
        self.waves.iter().map(|w| w.size * (w.kx * x + w.ky * y + w.phase).cos()).sum()
    }

    /// Mean over a straight line whose middle is a point and whose ends are `d` before and behind it.
    pub(super) fn mean_along(&self, [x, y]: [f64; 2], d: [f64; 2]) -> f64 {
        let mean = |w: &Wave| {
            let half = w.kx * d[0] + w.ky * d[1];
            let sinc = if half.abs() < 1e-6 { 1.0 } else { half.sin() / half };
            w.size * sinc * (w.kx * x + w.ky * y + w.phase).cos()
        };
        self.waves.iter().map(mean).sum()
    }
}

fn normal(rng: &mut impl rand::Rng) -> f64 {
    rand_distr::Distribution::sample(&rand_distr::StandardNormal, rng)
}

/// Wave numbers (rad/m) of the rings and the variance in each, scaled to D(baseline) = rms^2.
fn rings(rms: f64, baseline_m: f64, outer_scale_m: f64, finest_m: f64) -> Vec<(f64, f64)> {
    let k0 = std::f64::consts::TAU / outer_scale_m;
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
    let structure: f64 = rings.iter().map(|(k, v)| 2.0 * v * (1.0 - libm::j0(k * baseline_m))).sum();
    let scale = rms * rms / structure;
    rings.iter_mut().for_each(|r| r.1 *= scale);
    rings
}

/// Smallest horizontal distance of two antennas, m. It is 1 m if all antennas are at one position.
pub(super) fn shortest_distance(positions: impl Iterator<Item = [f64; 3]>) -> f64 {
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
