//! Downwelling sky temperatures against zenith angle.

use std::fmt;
use std::str::FromStr;

use super::error::{PhysicsError, check_frequencies, check_range, find_by_name};
use super::model::Atmosphere;
use super::planck::{black_body_radiance, planck_temperature_k, rayleigh_jeans_temperature_k};
use super::ray::Ray;

/// Shape of the path through the air.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Geometry {
    /// Plane-parallel air, `ds = dz sec z`; overestimates the depth beyond 85 degrees.
    #[default]
    Plane,
    /// Spherical Earth with refraction.
    Spherical,
}

/// Every geometry with its name and a summary for help texts and the book.
pub const GEOMETRIES: &[(&str, Geometry, &str)] = &[
    ("plane", Geometry::Plane, "plane-parallel air (default); good to 85 degrees from zenith"),
    ("spherical", Geometry::Spherical, "spherical Earth with refraction; to the horizon"),
];

impl FromStr for Geometry {
    type Err = PhysicsError;

    fn from_str(name: &str) -> Result<Self, PhysicsError> {
        Ok(find_by_name("geometry", name, GEOMETRIES, |row| row.0)?.1)
    }
}

impl fmt::Display for Geometry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plane => "plane",
            Self::Spherical => "spherical",
        })
    }
}

/// The sky in one direction at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyRow {
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Zenith angle at the observer, degrees.
    pub zenith_deg: f64,
    /// Planck brightness temperature, K.
    pub tb_planck_k: f64,
    /// Rayleigh-Jeans brightness temperature, K.
    pub tb_rj_k: f64,
    /// Optical depth of the atmosphere, Np.
    pub tau_np: f64,
    /// Mean radiating temperature (Planck), K.
    pub mean_radiating_k: f64,
    /// Length of the path to the top of the atmosphere, km.
    pub path_km: f64,
}

impl SkyRow {
    /// The numbers with the names of their columns, units included.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, f64); 7] {
        [
            ("freq_ghz", self.freq_ghz),
            ("zenith_deg", self.zenith_deg),
            ("tb_planck_k", self.tb_planck_k),
            ("tb_rj_k", self.tb_rj_k),
            ("tau_np", self.tau_np),
            ("mean_radiating_k", self.mean_radiating_k),
            ("path_km", self.path_km),
        ]
    }
}

impl Atmosphere {
    /// Sky temperatures at the surface for every pair of frequency (GHz) and zenith
    /// angle (degrees), frequencies outermost.
    ///
    /// # Errors
    /// [`PhysicsError::Refused`] at 90 degrees or beyond; [`PhysicsError::OutOfRange`]
    /// for a frequency outside 1-1000 GHz; [`PhysicsError::Empty`] for an empty list;
    /// [`PhysicsError::Ducting`] for a trapped ray.
    pub fn sky(&self, freqs_ghz: &[f64], zeniths_deg: &[f64], geometry: Geometry) -> Result<Vec<SkyRow>, PhysicsError> {
        self.sky_from(self.profile().bottom_km(), freqs_ghz, zeniths_deg, geometry)
    }

    /// As [`Atmosphere::sky`], for an observer at any height in km.
    ///
    /// # Errors
    /// As [`Atmosphere::sky`]; [`PhysicsError::OutOfRange`] for a height outside the profile.
    pub fn sky_from(
        &self,
        observer_km: f64,
        freqs_ghz: &[f64],
        zeniths_deg: &[f64],
        geometry: Geometry,
    ) -> Result<Vec<SkyRow>, PhysicsError> {
        check_frequencies(freqs_ghz)?;
        if zeniths_deg.is_empty() {
            return Err(PhysicsError::Empty { what: "zenith angle" });
        }
        for &zenith_deg in zeniths_deg {
            if !(0.0..90.0).contains(&zenith_deg) {
                let rule = "is outside the valid range 0 to below 90 deg; a sky temperature needs a direction above the horizon";
                return Err(PhysicsError::Refused(format!("zenith angle {zenith_deg} deg {rule}")));
            }
        }
        let top_km = self.profile().top_km();
        check_range("observer height", observer_km, "km", self.profile().bottom_km(), top_km)?;
        let grid = self.air_grid(observer_km, top_km, &[])?;
        let last = grid.levels().z_km.len() - 1;
        let rays = zeniths_deg
            .iter()
            .map(|zenith| match geometry {
                Geometry::Plane => Ok(Ray::straight(grid.levels(), 0, last, 1.0 / zenith.to_radians().cos())),
                Geometry::Spherical => Ray::refracted(grid.levels(), 0, *zenith),
            })
            .collect::<Result<Vec<_>, PhysicsError>>()?;

        let mut rows = Vec::with_capacity(freqs_ghz.len() * zeniths_deg.len());
        for &freq_ghz in freqs_ghz {
            let column = grid.column(freq_ghz)?;
            let background = black_body_radiance(freq_ghz, self.background_k());
            for (ray, &zenith_deg) in rays.iter().zip(zeniths_deg) {
                let path = column.along(ray);
                let radiance = path.seen_before(background);
                rows.push(SkyRow {
                    freq_ghz,
                    zenith_deg,
                    tb_planck_k: planck_temperature_k(freq_ghz, radiance),
                    tb_rj_k: rayleigh_jeans_temperature_k(freq_ghz, radiance),
                    tau_np: path.tau_np,
                    mean_radiating_k: path.mean_radiating_k(),
                    path_km: ray.length_km(),
                });
            }
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_input_is_one_clear_error_each() {
        let ussa = Atmosphere::reference("ussa", "mpm89").unwrap();
        let sky = |f: &[f64], z: &[f64]| ussa.sky(f, z, Geometry::Plane).unwrap_err().to_string();
        assert!(sky(&[94.0], &[90.0]).starts_with("zenith angle 90 deg is outside"));
        assert!(sky(&[94.0], &[-1.0]).starts_with("zenith angle -1 deg"));
        assert!(sky(&[94.0], &[f64::NAN]).starts_with("zenith angle NaN deg"));
        assert!(sky(&[1200.0], &[0.0]).starts_with("frequency 1200 GHz"));
        assert!(sky(&[f64::NAN], &[0.0]).starts_with("frequency NaN GHz"));
        assert!(sky(&[], &[0.0]).starts_with("no frequency given"));
        assert!(sky(&[94.0], &[]).starts_with("no zenith angle given"));
        let high = ussa.sky_from(31.0, &[94.0], &[0.0], Geometry::Plane).unwrap_err().to_string();
        assert!(high.starts_with("observer height 31 km"), "{high}");
    }

    #[test]
    fn geometry_reads_its_own_name() {
        for (name, geometry, _) in GEOMETRIES {
            assert_eq!(name.parse::<Geometry>().unwrap(), *geometry);
            assert_eq!(geometry.to_string(), *name);
        }
        assert!("flat".parse::<Geometry>().is_err());
    }

    #[test]
    fn above_all_air_only_the_background_is_left() {
        let ussa = Atmosphere::reference("ussa", "mpm89").unwrap();
        let rows = ussa.sky_from(29.99, &[94.0], &[0.0], Geometry::Plane).unwrap();
        assert!((rows[0].tb_planck_k - ussa.background_k()).abs() < 0.01);
    }

    #[test]
    fn rows_run_over_angles_first() {
        let ussa = Atmosphere::reference("ussa", "mpm89").unwrap();
        let rows = ussa.sky(&[10.0, 94.0], &[0.0, 60.0], Geometry::Spherical).unwrap();
        let order: Vec<_> = rows.iter().map(|r| (r.freq_ghz, r.zenith_deg)).collect();
        assert_eq!(order, vec![(10.0, 0.0), (10.0, 60.0), (94.0, 0.0), (94.0, 60.0)]);
    }
}
