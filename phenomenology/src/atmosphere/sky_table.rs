//! A table of sky temperatures against zenith angle, one for each frequency.
//!
//! Rays are refracted around a spherical Earth and cover every direction: up, near the horizon, through a tangent height, and down to the
//! ground. Intervals are halved until the error of linear interpolation in Rayleigh-Jeans temperature is below the tolerance in Planck
//! temperature. The error that is left is reported.

use super::adaptive::{bracket, refine};
use super::air_grid::{AirGrid, Column};
use super::error::{PhysicsError, check_frequencies, check_range};
use super::model::Atmosphere;
use super::planck::{black_body_radiance, planck_of_rayleigh_jeans_k, rayleigh_jeans_temperature_k};
use super::ray::{Ray, RayEnd};

/// Distance kept from the exact horizon, degrees.
const HORIZON_GAP_DEG: f64 = 1e-7;
/// How a sky table is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyTableOptions {
    /// Height of the observer, km; `None` for the lowest level.
    pub observer_km: Option<f64>,
    /// Temperature of the black ground that rays below the horizon meet, K; `None` for the
    /// temperature of the lowest air.
    pub ground_k: Option<f64>,
    /// Largest interpolation error, K.
    pub tolerance_k: f64,
}

impl Default for SkyTableOptions {
    fn default() -> Self {
        Self { observer_km: None, ground_k: None, tolerance_k: 0.05 }
    }
}

/// Sky temperatures against zenith angle for a list of frequencies.
#[derive(Debug, Clone)]
pub struct SkyTable {
    freqs_ghz: Vec<f64>,
    horizon_deg: f64,
    sky: Axis,
    ground: Axis,
    angle_error_k: f64,
}

/// One side of the horizon.
#[derive(Debug, Clone)]
struct Axis {
    zenith_deg: Vec<f64>,
    /// Rayleigh-Jeans temperatures, K // [chan][node]
    rj_k: Vec<Vec<f64>>,
}

impl SkyTable {
    /// Builds a table for a list of frequencies in GHz; the index is the channel.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency, height, tolerance (1e-3 to 10 K) or
    /// ground temperature; [`PhysicsError::Refused`] for a table that gets too large; [`PhysicsError::Ducting`].
    pub fn for_frequencies(atmosphere: &Atmosphere, freqs_ghz: &[f64], options: &SkyTableOptions) -> Result<Self, PhysicsError> {
        check_frequencies(freqs_ghz)?;
        Builder::new(atmosphere, options)?.build(freqs_ghz)
    }

    /// The zenith angle beyond which rays meet the ground, degrees.
    #[must_use]
    pub fn horizon_deg(&self) -> f64 {
        self.horizon_deg
    }

    /// Bound of the interpolation error, K: the largest error at the middle of an interval. These middles are nodes of the table.
    #[must_use]
    pub fn interpolation_error_k(&self) -> f64 {
        self.angle_error_k
    }

    /// Rayleigh-Jeans temperature in K in a channel, for zenith angles of 0 to 180 degrees.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a channel or zenith angle not in the table.
    pub fn rayleigh_jeans_k(&self, channel: usize, zenith_deg: f64) -> Result<f64, PhysicsError> {
        check_range("zenith angle", zenith_deg, "deg", 0.0, 180.0)?;
        let axis = if zenith_deg <= self.horizon_deg { &self.sky } else { &self.ground };
        let Some(values) = axis.rj_k.get(channel) else {
            return Err(PhysicsError::OutOfRange {
                quantity: "channel",
                value: channel as f64,
                min: 0.0,
                max: self.freqs_ghz.len() as f64 - 1.0,
                unit: "(index)",
            });
        };
        let (left, w) = bracket(&axis.zenith_deg, zenith_deg);
        Ok(values[left] + w * (values[left + 1] - values[left]))
    }
}

#[cfg(test)]
impl SkyTable {
    /// Planck temperature of the sky in a direction, at a frequency of the list.
    pub(super) fn temperature_k(&self, zenith_deg: f64, freq_ghz: f64) -> Result<f64, PhysicsError> {
        let channel = self.freqs_ghz.iter().position(|f| *f == freq_ghz).unwrap();
        Ok(planck_of_rayleigh_jeans_k(freq_ghz, self.rayleigh_jeans_k(channel, zenith_deg)?))
    }
}

/// The grid and the options of a table under construction.
struct Builder {
    grid: AirGrid,
    observer: usize,
    horizon_deg: f64,
    background_k: f64,
    ground_k: f64,
    tolerance_k: f64,
}

impl Builder {
    fn new(atmosphere: &Atmosphere, options: &SkyTableOptions) -> Result<Self, PhysicsError> {
        let profile = atmosphere.profile();
        let (bottom, top) = (profile.bottom_km(), profile.top_km());
        check_range("tolerance of the sky table", options.tolerance_k, "K", 1e-3, 10.0)?;
        let observer_km = options.observer_km.unwrap_or(bottom);
        check_range("observer height", observer_km, "km", bottom, top)?;
        let ground_k = options.ground_k.unwrap_or_else(|| profile.surface().temperature_k());
        check_range("ground temperature", ground_k, "K", 0.1, 2000.0)?;
        let grid = atmosphere.air_grid(bottom, top, &[observer_km])?;
        // The observer is a level of the grid; the grid joins levels that are closer than half of this.
        let observer = grid.levels().z_km.partition_point(|z| *z < observer_km - 2e-7);
        let horizon_deg = Ray::horizon_deg(grid.levels(), observer);
        Ok(Self { grid, observer, horizon_deg, background_k: atmosphere.background_k(), ground_k, tolerance_k: options.tolerance_k })
    }

    fn ray(&self, zenith_deg: f64) -> Result<Ray, PhysicsError> {
        Ray::refracted(self.grid.levels(), self.observer, zenith_deg)
    }

    fn seen_rj_k(&self, column: &Column, ray: &Ray) -> f64 {
        let behind_k = match ray.end {
            RayEnd::Space => self.background_k,
            RayEnd::Ground => self.ground_k,
        };
        let behind = black_body_radiance(column.freq_ghz, behind_k);
        rayleigh_jeans_temperature_k(column.freq_ghz, column.along(ray).seen_before(behind))
    }

    /// Largest zenith angle of the sky. It is the horizon itself for an observer at the lowest level.
    fn lowest_sky_deg(&self) -> f64 {
        if self.observer == 0 { 90.0 } else { self.horizon_deg - HORIZON_GAP_DEG }
    }

    fn build(&self, freqs_ghz: &[f64]) -> Result<SkyTable, PhysicsError> {
        let columns = self.grid.columns(freqs_ghz)?;
        let lowest = self.lowest_sky_deg();
        let up: Vec<f64> = [0.0, 30.0, 60.0, 80.0, 88.0, 89.9, 90.0].into_iter().filter(|z| *z < lowest).chain([lowest]).collect();
        let below = self.horizon_deg + HORIZON_GAP_DEG;
        let down: Vec<f64> = [below, below + 0.1, below + 1.0]
            .into_iter()
            .chain([100.0, 120.0, 150.0, 180.0].into_iter().filter(|z| *z > below + 2.0))
            .collect();
        let (sky, sky_error) = self.axis(&columns, &up)?;
        let (ground, ground_error) = self.axis(&columns, &down)?;
        Ok(SkyTable {
            freqs_ghz: freqs_ghz.to_vec(),
            horizon_deg: self.horizon_deg,
            sky,
            ground,
            angle_error_k: sky_error.max(ground_error),
        })
    }

    fn axis(&self, columns: &[Column], start: &[f64]) -> Result<(Axis, f64), PhysicsError> {
        let evaluate = |zenith: f64| {
            let ray = self.ray(zenith)?;
            Ok(columns.iter().map(|column| self.seen_rj_k(column, &ray)).collect())
        };
        let refined = refine(start, self.tolerance_k, evaluate, |a, b| {
            columns.iter().zip(a.iter().zip(b)).map(|(column, (x, y))| planck_distance_k(column.freq_ghz, *x, *y)).fold(0.0, f64::max)
        })?;
        let rj_k = (0..columns.len()).map(|channel| refined.values.iter().map(|node| node[channel]).collect()).collect();
        Ok((Axis { zenith_deg: refined.nodes, rj_k }, refined.worst_k))
    }
}

fn planck_distance_k(freq_ghz: f64, a_rj_k: f64, b_rj_k: f64) -> f64 {
    let planck = |rj| planck_of_rayleigh_jeans_k(freq_ghz, rj);
    (planck(a_rj_k) - planck(b_rj_k)).abs()
}
