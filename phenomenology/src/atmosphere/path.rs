//! Emission and transmission of the air between any two points.
//!
//! Paths are straight and the air is plane-parallel, which is accurate for paths up to some tens of kilometres. Radiances add up, but Planck
//! temperatures do not. The results therefore hold radiance, and functions convert it to temperatures.

use super::error::{PhysicsError, check_frequencies, check_range};
use super::model::Atmosphere;
use super::ray::Ray;
use super::transfer::PathRadiation;

/// Height differences below this are a horizontal path, km.
pub(super) const LEVEL_PATH_KM: f64 = 1e-6;
/// Longest path, km.
pub(super) const LONGEST_PATH_KM: f64 = 2000.0;

/// Extent of a path, given by its length or by its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathExtent {
    /// Length, km; the only choice for a horizontal path.
    LengthKm(f64),
    /// Angle between the path and the vertical, 0 to below 90 degrees.
    ZenithDeg(f64),
}

/// A straight path from a target to an observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathEnds {
    observer_km: f64,
    target_km: f64,
    length_km: f64,
}

impl PathEnds {
    /// Builds a path from the heights of its ends, in any order, and its extent.
    ///
    /// # Errors
    /// [`PhysicsError::Refused`] for a length below the difference of the heights, or a horizontal direction between different heights;
    /// [`PhysicsError::OutOfRange`] for a height or length that is not finite.
    pub fn new(observer_km: f64, target_km: f64, extent: PathExtent) -> Result<Self, PhysicsError> {
        check_range("observer height", observer_km, "km", -1.0, 100.0)?;
        check_range("target height", target_km, "km", -1.0, 100.0)?;
        let height_km = (target_km - observer_km).abs();
        let length_km = match extent {
            PathExtent::LengthKm(length_km) => {
                check_range("path length", length_km, "km", 0.0, LONGEST_PATH_KM)?;
                // Lengths computed from coordinates may round below the height difference.
                if length_km < height_km * (1.0 - 1e-9) {
                    let height = format!("the height difference {height_km} km between its ends");
                    return Err(PhysicsError::Refused(format!("path length {length_km} km is shorter than {height}")));
                }
                length_km.max(height_km)
            }
            PathExtent::ZenithDeg(zenith_deg) => {
                if !(0.0..90.0).contains(&zenith_deg) {
                    let ends = format!("zenith angle {zenith_deg} deg cannot join heights {observer_km} km and {target_km} km");
                    let rule = "give an angle below 90 deg, or the path length for a horizontal path";
                    return Err(PhysicsError::Refused(format!("{ends}; {rule}")));
                }
                height_km / zenith_deg.to_radians().cos()
            }
        };
        Ok(Self { observer_km, target_km, length_km })
    }

    /// Height of the observer, km.
    #[must_use]
    pub fn observer_km(&self) -> f64 {
        self.observer_km
    }

    /// Height of the target, km.
    #[must_use]
    pub fn target_km(&self) -> f64 {
        self.target_km
    }

    /// Length, km.
    #[must_use]
    pub fn length_km(&self) -> f64 {
        self.length_km
    }

    pub(super) fn height_km(&self) -> f64 {
        (self.target_km - self.observer_km).abs()
    }
}

impl Atmosphere {
    /// Emission towards the observer and optical depth of a path, one for each frequency.
    ///
    /// This is the full integral, with line-by-line absorption at every level of the path.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency outside 1-1000 GHz or an end outside
    /// the profile; [`PhysicsError::Empty`] without a frequency.
    pub fn path(&self, freqs_ghz: &[f64], ends: &PathEnds) -> Result<Vec<PathRadiation>, PhysicsError> {
        check_frequencies(freqs_ghz)?;
        let (observer, target) = (ends.observer_km, ends.target_km);
        if ends.height_km() < LEVEL_PATH_KM {
            let t = self.profile().air_at(observer)?.temperature_k();
            return freqs_ghz
                .iter()
                .map(|&freq| {
                    let tau = self.absorption_np_per_km(freq, observer)? * ends.length_km;
                    Ok(PathRadiation::isothermal(freq, tau, t))
                })
                .collect();
        }
        let grid = self.air_grid(observer.min(target), observer.max(target), &[])?;
        let last = grid.levels().z_km.len() - 1;
        let (from, to) = if observer < target { (0, last) } else { (last, 0) };
        let ray = Ray::straight(grid.levels(), from, to, ends.length_km / ends.height_km());
        Ok(grid.columns(freqs_ghz)?.iter().map(|column| column.along(&ray)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ussa() -> Atmosphere {
        Atmosphere::reference("ussa", "mpm89").unwrap()
    }

    #[test]
    fn horizontal_path_is_the_limit_of_a_slant_one() {
        let level = PathEnds::new(1.0, 1.0, PathExtent::LengthKm(20.0)).unwrap();
        let tilted = PathEnds::new(1.0, 1.000_1, PathExtent::LengthKm(20.0)).unwrap();
        let (a, b) = (ussa().path(&[94.0], &level).unwrap()[0], ussa().path(&[94.0], &tilted).unwrap()[0]);
        assert!((a.tau_np / b.tau_np - 1.0).abs() < 1e-4);
        assert!((a.emission / b.emission - 1.0).abs() < 1e-4);
    }

    #[test]
    fn zenith_and_length_name_the_same_path() {
        let by_angle = PathEnds::new(5.0, 0.0, PathExtent::ZenithDeg(60.0)).unwrap();
        let by_length = PathEnds::new(5.0, 0.0, PathExtent::LengthKm(10.0)).unwrap();
        assert!((by_angle.length_km() - by_length.length_km()).abs() < 1e-12);
    }

    #[test]
    fn depth_is_the_same_both_ways_and_emission_is_not() {
        let extent = PathExtent::ZenithDeg(30.0);
        let up = ussa().path(&[60.0], &PathEnds::new(0.0, 5.0, extent).unwrap()).unwrap()[0];
        let down = ussa().path(&[60.0], &PathEnds::new(5.0, 0.0, extent).unwrap()).unwrap()[0];
        assert!((up.tau_np / down.tau_np - 1.0).abs() < 1e-12);
        // At 60 GHz the air is opaque: each end sees the air within some 0.3 km of it, and
        // 6.5 K/km makes that up to 2 K colder below and warmer above.
        let (low, high) = (288.2 - up.emission_planck_k(), down.emission_planck_k() - 255.7);
        assert!((0.5..3.0).contains(&low) && (0.5..3.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn impossible_paths_are_named() {
        let short = PathEnds::new(0.0, 5.0, PathExtent::LengthKm(4.0)).unwrap_err().to_string();
        assert!(short.contains("path length 4 km is shorter than the height difference 5 km"));
        let flat = PathEnds::new(0.0, 5.0, PathExtent::ZenithDeg(90.0)).unwrap_err().to_string();
        assert!(flat.contains("zenith angle 90 deg cannot join heights"), "{flat}");
        assert!(PathEnds::new(f64::NAN, 5.0, PathExtent::LengthKm(4.0)).is_err());
        assert!(PathEnds::new(0.0, 0.0, PathExtent::LengthKm(-4.0)).is_err());
        let outside = PathEnds::new(0.0, 40.0, PathExtent::LengthKm(50.0)).unwrap();
        assert!(ussa().path(&[94.0], &outside).is_err());
    }
}
