//! The air over the array: each antenna receives the wave through its own path.

use super::air::{Air, AirPaths, ExcessPath};
use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::radiometer::Radiometer;
use super::screen::{Screen, Wind, shortest_distance};
use super::shared::Shared;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::quantity::{Duration, Length};
use cittert_arrays::{GainTable, LayoutFrame, SPEED_OF_LIGHT_M_S};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// An antenna whose path is longer than that of the origin of the layout by L receives the wave later: g = exp(+2 pi i f L / c). The path of
/// each antenna follows from its height above sea level and from the zenith angle of the phase centre there, so that the curvature of the Earth
/// is included. What all antennas have in common cancels and is left out.
///
/// Turbulence makes the wet path w(f) of the zenith fluctuate by a part x of itself: a screen of which x at two points one outer scale apart
/// differs by the stated rms. The path is x w(f) sec z, and has the dispersion of water vapour.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, sect. 13.1 and 13.2; radiometers: the same, sect. 13.3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Atmosphere {
    /// The air.
    pub air: Air,
    /// Its turbulence.
    pub turbulence: Option<Turbulence>,
    /// Water vapour radiometers at the antennas.
    pub radiometer: Option<Radiometer>,
}

/// Fluctuations of the wet path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Turbulence {
    /// Rms difference of the zenith path at two points one outer scale apart, as a fraction of the wet path of the zenith.
    pub fraction: f64,
    /// The wind that carries the screen, its height and outer scale.
    #[serde(flatten)]
    pub wind: Wind,
}

/// Options of the air over the array.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct AtmosphereOptions {
    /// The air over the array: a built-in atmosphere such as ussa, or a CSV file with a profile, as for scene delay. Each antenna has the path of
    /// its height and of the elevation there.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME|CSV"))]
    pub atmosphere: Option<String>,
    /// Turbulence of the water vapour: rms difference of the zenith path over one outer scale, as a fraction of the wet path.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", allow_hyphen_values = true))]
    pub turbulence: Option<f64>,
    /// Correct the wet path by a water vapour radiometer at each antenna, whose paths have this rms error, such as 0.1mm.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", allow_hyphen_values = true))]
    pub wvr_rms: Option<Length>,
    /// Time over which the radiometers average.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = AtmosphereOptions::default().wvr_averaging))]
    pub wvr_averaging: Duration,
}

impl Default for AtmosphereOptions {
    fn default() -> Self {
        Self { atmosphere: None, turbulence: None, wvr_rms: None, wvr_averaging: Duration(1.0) }
    }
}

impl AtmosphereOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<Atmosphere>> {
        let Some(name) = self.atmosphere.clone() else { return Ok(None) };
        if self.wvr_rms.is_none() && self.wvr_averaging != Self::default().wvr_averaging {
            return Err(ChainError::Incompatible(
                "wvr-averaging is given, but wvr-rms is not: give it too, or leave wvr-averaging out".into(),
            ));
        }
        let turbulence = self.turbulence.map(|fraction| Turbulence { fraction, wind: shared.wind.model() });
        let radiometer = self.wvr_rms.map(|rms| Radiometer { rms_m: rms.si(), averaging_s: self.wvr_averaging.si() });
        let air = Air { model: shared.airs.air(&name)?, name };
        Ok(Some(Atmosphere { air, turbulence, radiometer }))
    }
}

/// Mean radius of the Earth, m.
const EARTH_RADIUS_M: f64 = 6_370_950.0;

/// Height above sea level in m and vertical of a place, which is given in east, north and up at a site.
pub(super) fn height_and_vertical([east, north, up]: [f64; 3], site_height_m: f64) -> (f64, [f64; 3]) {
    let from_centre = EARTH_RADIUS_M + site_height_m + up;
    let flat2 = east * east + north * north;
    let radius = flat2.sqrt().hypot(from_centre);
    // The radius less that at the site, without loss of digits.
    let height = site_height_m + up + flat2 / (radius + from_centre);
    (height, [east / radius, north / radius, from_centre / radius])
}

/// Zenith angle of a direction.
pub(super) fn zenith_rad(vertical: [f64; 3], toward: [f64; 3]) -> f64 {
    let [a, b] = [vertical, toward];
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let along: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    across.iter().map(|x| x * x).sum::<f64>().sqrt().atan2(along)
}

impl Atmosphere {
    fn screen(&self, context: &Context<'_>) -> Option<(Turbulence, Screen)> {
        self.turbulence.map(|t| {
            let scale = t.wind.outer_scale_m;
            let finest = shortest_distance(context.header.layout.antennas().iter().map(|a| a.position_m)).min(scale);
            (t, Screen::new(t.fraction, scale, scale, finest, &mut context.rng(0)))
        })
    }
}

impl Corruption for Atmosphere {
    fn check(&self) -> Result<()> {
        if let Some(t) = &self.turbulence {
            need_size("turbulence as a fraction of the wet path", t.fraction)?;
            need("turbulence as a fraction of the wet path", t.fraction, t.fraction <= 1.0, "at most 1")?;
            t.wind.check()?;
        }
        self.radiometer.map_or(Ok(()), |r| r.check())
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn needs_direction(&self) -> bool {
        true
    }

    fn blows(&self) -> bool {
        self.turbulence.is_some()
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let layout = &context.header.layout;
        let LayoutFrame::EastNorthUp(site) = layout.frame else {
            return Err(ChainError::Incompatible(format!(
                "the atmosphere {} needs an array at a site on the Earth, and the layout {} is in the frame of its boresight: use --troposphere, or \
                 a layout with frame = \"enu\"",
                self.air.name, layout.name
            )));
        };
        let antennas: Vec<[f64; 3]> = layout.antennas().iter().map(|a| a.position_m).collect();
        // The origin of the layout comes first.
        let places: Vec<(f64, [f64; 3])> = [[0.0; 3]].iter().chain(&antennas).map(|p| height_and_vertical(*p, site.altitude_m)).collect();
        let heights: Vec<f64> = places.iter().map(|p| p.0).collect();
        let paths = self.air.model.paths(&heights, context.freq_hz)?;
        let overhead = paths.toward(0, 0.0)?;
        let screen = self.screen(context);
        let (n_time, _, n_chan, n_feed) = table.gains.dim();
        for time in 0..n_time {
            let path =
                |place: usize| self.path(paths.as_ref(), place, zenith_rad(places[place].1, context.toward[time]), context.time_jd[time]);
            let origin = path(0)?;
            for (ant, position) in antennas.iter().enumerate() {
                let here = path(ant + 1)?;
                let moment = Moment { context, time, ant, position: *position };
                let (fluctuation, error_m) = self.fluctuation(&screen, &moment)?;
                for chan in 0..n_chan {
                    // Radiometers measure all of the wet path, so that only what they miss is left.
                    let still = if self.radiometer.is_some() { 0.0 } else { here[chan].wet_m - origin[chan].wet_m };
                    let excess = here[chan].other_m - origin[chan].other_m + still + fluctuation * overhead[chan].wet_m + error_m;
                    let g = Complex64::cis(std::f64::consts::TAU * context.freq_hz[chan] * excess / SPEED_OF_LIGHT_M_S);
                    for feed in 0..n_feed {
                        table.gains[[time, ant, chan, feed]] *= g;
                    }
                }
            }
        }
        Ok(())
    }
}

/// An antenna in an integration.
struct Moment<'a> {
    context: &'a Context<'a>,
    time: usize,
    ant: usize,
    position: [f64; 3],
}

impl Atmosphere {
    fn path(&self, paths: &dyn AirPaths, place: usize, zenith_rad: f64, time_jd: f64) -> Result<Vec<ExcessPath>> {
        paths.toward(place, zenith_rad).map_err(|e| ChainError::Incompatible(format!("atmosphere {} at JD {time_jd}: {e}", self.air.name)))
    }

    /// What turbulence adds to the path, as a part of the wet path of the zenith, and what the error of the radiometer adds, m.
    fn fluctuation(&self, screen: &Option<(Turbulence, Screen)>, at: &Moment<'_>) -> Result<(f64, f64)> {
        let context = at.context;
        let seconds = context.seconds[at.time];
        let error_m = self.radiometer.map_or(0.0, |r| r.error_m(context, at.time, at.ant));
        let Some((turbulence, screen)) = screen else { return Ok((0.0, error_m)) };
        let (shift, secant) = turbulence.wind.crossing(context, at.time)?;
        let point = |t: f64| {
            let blown = turbulence.wind.way(t);
            [0, 1].map(|k| at.position[k] + shift[k] - blown[k])
        };
        let mut x = screen.at(point(seconds));
        if let Some(radiometer) = self.radiometer {
            x -= screen.mean_along(point(radiometer.middle_s(seconds)), turbulence.wind.way(0.5 * radiometer.averaging_s));
        }
        Ok((secant * x, error_m))
    }
}
