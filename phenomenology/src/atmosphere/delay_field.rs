//! Delays at many places in one atmosphere, of sources whose true directions are known: what an array of antennas needs.
//!
//! The refractivities of the grid are computed once for each frequency, and each ray once for all frequencies.

use super::air_grid::AirGrid;
use super::delay::{PathDelay, Segment, check_delay_frequencies, delay_through};
use super::error::{PhysicsError, check_range};
use super::model::Atmosphere;
use super::path::LEVEL_PATH_KM;
use super::ray::Ray;

/// Largest apparent zenith angle, degrees.
const LOWEST_ZENITH_DEG: f64 = 89.9;
/// The apparent direction is found to this, degrees: 1e-6 m of path at 5 degrees of elevation.
const DIRECTION_DEG: f64 = 1e-7;

/// The refractivities of an atmosphere at fixed frequencies, and the observers in it.
#[derive(Debug)]
pub struct DelayField {
    grid: AirGrid,
    /// Refractivities of the segments \[freq\]\[segment\].
    segments: Vec<(f64, Vec<Segment>)>,
    /// Level of each observer.
    levels: Vec<usize>,
}

impl Atmosphere {
    /// Delays from observers at heights in km (in any order) at frequencies in GHz (from 0), spherical and with refraction.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency outside 0-1000 GHz, a height outside the profile or rain above 150 mm/h;
    /// [`PhysicsError::Empty`] for an empty list.
    pub fn delay_field(&self, observers_km: &[f64], freqs_ghz: &[f64]) -> Result<DelayField, PhysicsError> {
        check_delay_frequencies(freqs_ghz)?;
        let (bottom_km, top_km) = (self.profile().bottom_km(), self.profile().top_km());
        for &height_km in observers_km {
            check_range("observer height", height_km, "km", bottom_km, top_km - LEVEL_PATH_KM)?;
        }
        let lowest_km = observers_km.iter().copied().reduce(f64::min).ok_or(PhysicsError::Empty { what: "observer" })?;
        let grid = self.air_grid(lowest_km, top_km, observers_km)?;
        let z_km = &grid.levels().z_km;
        let nearest = |z: f64| {
            let above = z_km.partition_point(|level| *level < z).min(z_km.len() - 1);
            if above > 0 && z - z_km[above - 1] < z_km[above] - z { above - 1 } else { above }
        };
        let levels = observers_km.iter().map(|z| nearest(*z)).collect();
        let segments = freqs_ghz.iter().map(|f| Ok((*f, grid.segments(*f)?))).collect::<Result<_, PhysicsError>>()?;
        Ok(DelayField { grid, segments, levels })
    }
}

impl DelayField {
    /// Delays at an observer of a source beyond the atmosphere whose true zenith angle (without refraction) is given in degrees \[freq\].
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a source that is seen beyond 89.9 degrees, [`PhysicsError::Ducting`] for a trapped ray.
    ///
    /// # Panics
    /// If there is no observer of this index.
    pub fn toward(&self, observer: usize, true_zenith_deg: f64) -> Result<Vec<PathDelay>, PhysicsError> {
        let from = self.levels[observer];
        let (ray, bending_m) = self.ray_toward(from, true_zenith_deg)?;
        let above_m = self.grid.dry_above_m(&ray);
        let delay = |(freq_ghz, segments): &(f64, Vec<Segment>)| {
            let mut delay = delay_through(segments, *freq_ghz, &ray);
            delay.dry_m += above_m;
            delay.bending_m = bending_m;
            delay
        };
        Ok(self.segments.iter().map(delay).collect())
    }

    /// The ray that ends in a true direction, and its excess length by bending in m. Refraction changes slowly with the direction, so that the
    /// apparent direction is the limit of true direction less refraction.
    fn ray_toward(&self, from: usize, true_zenith_deg: f64) -> Result<(Ray, f64), PhysicsError> {
        check_range("zenith angle of a delay", true_zenith_deg, "deg", 0.0, 180.0)?;
        let mut zenith_deg = true_zenith_deg.min(LOWEST_ZENITH_DEG);
        for _ in 0..60 {
            let ray = Ray::refracted(self.grid.levels(), from, zenith_deg)?;
            let (bending_m, turned_rad) = self.grid.bending(&ray, from, zenith_deg);
            let next = true_zenith_deg - turned_rad.to_degrees();
            check_range("zenith angle of a delay", next, "deg", 0.0 - turned_rad.to_degrees(), LOWEST_ZENITH_DEG)?;
            if (next - zenith_deg).abs() < DIRECTION_DEG {
                return Ok((ray, bending_m));
            }
            zenith_deg = next.max(0.0);
        }
        let ray = Ray::refracted(self.grid.levels(), from, zenith_deg)?;
        let (bending_m, _) = self.grid.bending(&ray, from, zenith_deg);
        Ok((ray, bending_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::Geometry;

    // `delay_from` takes the apparent direction: the true one is that and the refraction.
    #[test]
    fn a_field_has_the_delays_of_the_rows() {
        let air = Atmosphere::reference("mls", "mpm89").unwrap().with_layers(vec!["cloud:1km-2km:0.1g/m3".parse().unwrap()]).unwrap();
        let (heights, freqs) = ([2.345, 0.0, 5.058, 0.0017], [0.3, 94.0, 345.0]);
        let field = air.delay_field(&heights, &freqs).unwrap();
        for (k, height) in heights.iter().enumerate() {
            for zenith in [0.0, 45.0, 80.0, 85.0, 88.0] {
                let rows = air.delay_from(*height, &freqs, &[zenith], Geometry::Spherical).unwrap();
                let got = field.toward(k, zenith + rows[0].refraction_deg).unwrap();
                for (row, d) in rows.iter().zip(&got) {
                    // The levels of other observers divide the grid: 0.3 mm at 88 degrees.
                    let error = (row.delay.total_m() - d.total_m()).abs();
                    assert!(error < 1e-5 * row.delay.total_m(), "{height} km {zenith} deg: {row:?} {d:?}");
                }
            }
        }
    }

    #[test]
    fn what_lies_below_the_horizon_or_outside_of_the_profile_is_refused() {
        let air = Atmosphere::reference("ussa", "mpm89").unwrap();
        let fault = |heights: &[f64], zenith: f64| {
            let field = air.delay_field(heights, &[94.0]).map_err(|e| e.to_string())?;
            field.toward(0, zenith).map(|d| d[0].total_m()).map_err(|e| e.to_string())
        };
        assert!(fault(&[-0.4], 0.0).unwrap_err().starts_with("observer height -0.4 km"));
        assert!(fault(&[], 0.0).unwrap_err().starts_with("no observer given"));
        assert!(fault(&[0.0], 95.0).unwrap_err().starts_with("zenith angle of a delay"));
        assert!(fault(&[0.0], f64::NAN).is_err());
        // The Sun sets half a degree below the horizon.
        assert!((20.0..130.0).contains(&fault(&[0.0], 90.2).unwrap()));
    }
}
