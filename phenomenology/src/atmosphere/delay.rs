//! Excess path length and phase of the air: how much later a wave arrives than in vacuum.
//!
//! The excess is the integral of `n - 1` along the ray. A bent ray is also longer than the straight one, which adds `1 - cos` of the angle
//! that it still has to turn. Refractivities depend on the frequency, and lengths are of the phase, not of a group of waves.

use std::f64::consts::TAU;

use super::air_grid::{AirGrid, logarithmic_mean};
use super::error::{MAX_FREQ_GHZ, PhysicsError, check_range};
use super::gas::GasRefractivity;
use super::hydrosol::{crystal_refractivity_liebe93, droplet_refractivity_liebe93};
use super::layer::{Layer, Phase};
use super::model::Atmosphere;
use super::path::{LEVEL_PATH_KM, PathEnds};
use super::rain::rain_refractivity_liebe89;
use super::ray::{EARTH_RADIUS_KM, Ray};
use super::sky::Geometry;
use crate::constants::SPEED_OF_LIGHT_M_S;

/// `R/(M g)` of dry air at sea level, km/K.
const SCALE_HEIGHT_KM_PER_K: f64 = 287.054 / 9.80665 / 1e3;
/// Metres of excess from 1 ppm along 1 km.
const M_PER_PPM_KM: f64 = 1e-3;

/// Excess path length by its causes, at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PathDelay {
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Dry air, m.
    pub dry_m: f64,
    /// Water vapour, m.
    pub wet_m: f64,
    /// Droplets, ice crystals and rain, m.
    pub liquid_m: f64,
    /// What a bent ray is longer than a straight one, m.
    pub bending_m: f64,
    /// The part of `dry_m` and `wet_m` that changes with the frequency, m. It is 0 at zero frequency.
    pub dispersive_m: f64,
}

impl PathDelay {
    /// Excess path length of all causes, m.
    #[must_use]
    pub fn total_m(&self) -> f64 {
        self.dry_m + self.wet_m + self.liquid_m + self.bending_m
    }

    /// Delay, s.
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        self.total_m() / SPEED_OF_LIGHT_M_S
    }

    /// Phase by which the wave lags, rad.
    #[must_use]
    pub fn phase_rad(&self) -> f64 {
        TAU * self.freq_ghz * 1e9 * self.delay_s()
    }
}

/// Delay of a source beyond the atmosphere, at one frequency and direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayRow {
    /// Apparent zenith angle at the observer, degrees.
    pub zenith_deg: f64,
    /// Angle by which refraction lifts the source, degrees; 0 in plane geometry.
    pub refraction_deg: f64,
    /// The delay.
    pub delay: PathDelay,
}

impl DelayRow {
    /// The numbers with the names of their columns, units included.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, f64); 11] {
        let d = &self.delay;
        [
            ("freq_ghz", d.freq_ghz),
            ("zenith_deg", self.zenith_deg),
            ("excess_m", d.total_m()),
            ("dry_m", d.dry_m),
            ("wet_m", d.wet_m),
            ("liquid_m", d.liquid_m),
            ("bending_m", d.bending_m),
            ("dispersive_m", d.dispersive_m),
            ("delay_ns", d.delay_s() * 1e9),
            ("phase_rad", d.phase_rad()),
            ("refraction_deg", self.refraction_deg),
        ]
    }
}

/// Mean refractivities between two levels, ppm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    dry: f64,
    wet: f64,
    liquid: f64,
    dispersive: f64,
}

pub(super) fn check_delay_frequencies(freqs_ghz: &[f64]) -> Result<(), PhysicsError> {
    if freqs_ghz.is_empty() {
        return Err(PhysicsError::Empty { what: "frequency" });
    }
    freqs_ghz.iter().try_for_each(|f| check_range("frequency", *f, "GHz", 0.0, MAX_FREQ_GHZ).map(drop))
}

/// Refractivity of a layer where it is present, ppm.
fn layer_refractivity_ppm(layer: &Layer, freq_ghz: f64, temperature_k: f64) -> Result<f64, PhysicsError> {
    let amount = layer.amount();
    match layer.kind().entry().phase {
        Phase::Droplets => Ok(droplet_refractivity_liebe93(freq_ghz, temperature_k, amount)?.re),
        Phase::Crystals => crystal_refractivity_liebe93(temperature_k, amount),
        Phase::Rain => rain_refractivity_liebe89(freq_ghz, amount),
    }
}

/// Delay along a ray through segments of one frequency, without the air above the top and without bending.
pub(super) fn delay_through(segments: &[Segment], freq_ghz: f64, ray: &Ray) -> PathDelay {
    let mut delay = PathDelay { freq_ghz, ..PathDelay::default() };
    for step in &ray.steps {
        let (n, m) = (&segments[step.segment], step.length_km * M_PER_PPM_KM);
        delay.dry_m += n.dry * m;
        delay.wet_m += n.wet * m;
        delay.liquid_m += n.liquid * m;
        delay.dispersive_m += n.dispersive * m;
    }
    delay
}

impl AirGrid {
    /// Mean refractivities of the segments. Static ones are exponential in height, dispersion may change its sign and is linear.
    pub(super) fn segments(&self, freq_ghz: f64) -> Result<Vec<Segment>, PhysicsError> {
        let gas: Vec<GasRefractivity> = self.spectra.iter().map(|s| s.refractivity(freq_ghz)).collect();
        let t_k = &self.levels().t_k;
        (0..self.layers.len())
            .map(|i| {
                let (a, b) = (&gas[i], &gas[i + 1]);
                let mut liquid = 0.0;
                for layer in &self.layers[i] {
                    for t in [t_k[i], t_k[i + 1]] {
                        liquid += 0.5 * layer_refractivity_ppm(layer, freq_ghz, t)?;
                    }
                }
                let (dry, wet) = (0.5 * (a.dry.re + b.dry.re), 0.5 * (a.wet.re + b.wet.re));
                Ok(Segment {
                    dry: logarithmic_mean(a.dry_static, b.dry_static) + dry,
                    wet: logarithmic_mean(a.wet_static, b.wet_static) + wet,
                    liquid,
                    dispersive: dry + wet,
                })
            })
            .collect()
    }

    fn delay_along(&self, freq_ghz: f64, ray: &Ray) -> Result<PathDelay, PhysicsError> {
        Ok(delay_through(&self.segments(freq_ghz)?, freq_ghz, ray))
    }

    /// Excess of the dry air above the top level along the last direction of a rising ray, m: hydrostatic air of any temperature. Its
    /// gravity is that at its centre of mass, a scale height above the top; it varies by 0.5 % over the profiles that end at 10 to 30 km.
    pub(super) fn dry_above_m(&self, ray: &Ray) -> f64 {
        let z_km = &self.levels().z_km;
        let last = z_km.len() - 1;
        let stretch = ray.steps.last().map_or(1.0, |step| step.length_km / (z_km[last] - z_km[last - 1]));
        let static_ppm = self.spectra[last].refractivity(0.0).dry_static;
        let at_sea_level = self.levels().t_k[last] * SCALE_HEIGHT_KM_PER_K;
        let weaker = (1.0 + (z_km[last] + at_sea_level) / EARTH_RADIUS_KM).powi(2);
        static_ppm * at_sea_level * weaker * stretch * M_PER_PPM_KM
    }

    /// Excess length by bending, m, and the whole angle that a rising ray from a level turns on its way out, rad.
    pub(super) fn bending(&self, ray: &Ray, from: usize, zenith_deg: f64) -> (f64, f64) {
        let levels = self.levels();
        let q = |i: usize| levels.index[i] * (EARTH_RADIUS_KM + levels.z_km[i]);
        let invariant = q(from) * zenith_deg.to_radians().sin();
        // q cos z, with Snell's law in a sphere.
        let s = |i: usize| ((q(i) - invariant) * (q(i) + invariant)).max(0.0).sqrt();
        let last = levels.z_km.len() - 1;
        // From the top down: the angle that is left.
        let mut left = invariant * levels.index[last].ln() / s(last);
        let mut bending_m = 0.0;
        for step in ray.steps.iter().rev() {
            let (low, high) = (step.segment, step.segment + 1);
            let turn = 2.0 * invariant * (levels.index[low] / levels.index[high]).ln() / (s(low) + s(high));
            let half = 0.5 * (left + 0.5 * turn);
            bending_m += 2.0 * half.sin().powi(2) * step.length_km * 1e3;
            left += turn;
        }
        (bending_m, left)
    }
}

impl Atmosphere {
    /// Delay of sources beyond the atmosphere at the surface for every pair of frequency (GHz, from 0) and apparent zenith angle (degrees),
    /// frequencies outermost.
    ///
    /// Dry air above the top of the profile is included as hydrostatic air.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency outside 0-1000 GHz, a zenith angle outside 0-89.9 degrees or rain above 150 mm/h;
    /// [`PhysicsError::Empty`] for an empty list; [`PhysicsError::Ducting`] for a trapped ray.
    pub fn delay(&self, freqs_ghz: &[f64], zeniths_deg: &[f64], geometry: Geometry) -> Result<Vec<DelayRow>, PhysicsError> {
        self.delay_from(self.profile().bottom_km(), freqs_ghz, zeniths_deg, geometry)
    }

    /// As [`Atmosphere::delay`], for an observer at any height in km.
    ///
    /// # Errors
    /// As [`Atmosphere::delay`]; [`PhysicsError::OutOfRange`] for a height outside the profile.
    pub fn delay_from(
        &self,
        observer_km: f64,
        freqs_ghz: &[f64],
        zeniths_deg: &[f64],
        geometry: Geometry,
    ) -> Result<Vec<DelayRow>, PhysicsError> {
        check_delay_frequencies(freqs_ghz)?;
        if zeniths_deg.is_empty() {
            return Err(PhysicsError::Empty { what: "zenith angle" });
        }
        for &zenith_deg in zeniths_deg {
            check_range("zenith angle of a delay", zenith_deg, "deg", 0.0, 89.9)?;
        }
        let top_km = self.profile().top_km();
        check_range("observer height", observer_km, "km", self.profile().bottom_km(), top_km - LEVEL_PATH_KM)?;
        let grid = self.air_grid(observer_km, top_km, &[])?;
        let last = grid.levels().z_km.len() - 1;
        let rays = zeniths_deg
            .iter()
            .map(|zenith| match geometry {
                Geometry::Plane => Ok((Ray::straight(grid.levels(), 0, last, 1.0 / zenith.to_radians().cos()), (0.0, 0.0))),
                Geometry::Spherical => {
                    let ray = Ray::refracted(grid.levels(), 0, *zenith)?;
                    let bending = grid.bending(&ray, 0, *zenith);
                    Ok((ray, bending))
                }
            })
            .collect::<Result<Vec<_>, PhysicsError>>()?;
        let mut rows = Vec::with_capacity(freqs_ghz.len() * zeniths_deg.len());
        for &freq_ghz in freqs_ghz {
            for ((ray, (bending_m, turned_rad)), &zenith_deg) in rays.iter().zip(zeniths_deg) {
                let mut delay = grid.delay_along(freq_ghz, ray)?;
                delay.dry_m += grid.dry_above_m(ray);
                delay.bending_m = *bending_m;
                rows.push(DelayRow { zenith_deg, refraction_deg: turned_rad.to_degrees(), delay });
            }
        }
        Ok(rows)
    }

    /// Excess path between two points in the air, one for each frequency in GHz. The path is straight and the air plane-parallel.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency outside 0-1000 GHz, an end outside the profile or rain above 150 mm/h;
    /// [`PhysicsError::Empty`] without a frequency.
    pub fn path_delay(&self, freqs_ghz: &[f64], ends: &PathEnds) -> Result<Vec<PathDelay>, PhysicsError> {
        check_delay_frequencies(freqs_ghz)?;
        let (low, high) = (ends.observer_km().min(ends.target_km()), ends.observer_km().max(ends.target_km()));
        // A horizontal path is the limit of a short climb: the air of a grid of two levels, and the length of the path.
        let flat = high - low < LEVEL_PATH_KM;
        let (low, high) = match flat {
            true if low + LEVEL_PATH_KM > self.profile().top_km() => (low - LEVEL_PATH_KM, low),
            true => (low, low + LEVEL_PATH_KM),
            false => (low, high),
        };
        let grid = self.air_grid(low, high, &[])?;
        let last = grid.levels().z_km.len() - 1;
        let ray = Ray::straight(grid.levels(), 0, last, ends.length_km() / (high - low));
        freqs_ghz.iter().map(|freq| grid.delay_along(*freq, &ray)).collect()
    }
}
