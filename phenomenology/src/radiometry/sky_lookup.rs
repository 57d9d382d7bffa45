//! Sky temperatures against direction, at a few heights. A look-up needs no search.

use super::options::TableOptions;
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::atmosphere::{Atmosphere, Geometry, PhysicsError, SkyTable, SkyTableOptions, check_range};

/// Cosine `c0` of the zenith angle at the middle of a table. The sky is smooth in `u = c/(c + c0)` from zenith to horizon, so the nodes lie
/// evenly in `u`. Only the speed at which the error falls depends on this value.
const HALF_COSINE: f64 = 0.05;
/// Height by which a ray may start above the highest table, km: rounding, and the offset of a ray from the surface that reflects it.
const MARGIN_KM: f64 = 1e-5;
/// Angle that stands for the horizon of plane-parallel air, degrees. At 90 degrees the path is infinitely long.
const NEARLY_HORIZONTAL_DEG: f64 = 89.9999;

/// Rayleigh-Jeans temperatures of the sky, K.
#[derive(Debug, Clone)]
pub struct SkyLookup {
    /// Heights of the tables, km, rising; infinite for a sky that is the same at every height.
    heights_km: Vec<f64>,
    intervals: f64,
    /// // [height][chan][node]
    tables: Vec<Vec<Vec<f64>>>,
}

impl SkyLookup {
    /// Tables at heights in km (sorted, at least one) for frequencies in GHz.
    ///
    /// # Errors
    /// As [`Atmosphere::sky_from`] and [`SkyTable::for_frequencies`].
    pub fn new(
        atmosphere: &Atmosphere,
        geometry: Geometry,
        freqs_ghz: &[f64],
        heights_km: &[f64],
        options: &TableOptions,
    ) -> Result<Self, PhysicsError> {
        let intervals = options.sky_intervals;
        let bottom = atmosphere.profile().bottom_km();
        let zeniths: Vec<f64> = (0..=intervals)
            .map(|k| cosine_at(k as f64 / intervals as f64).clamp(0.0, 1.0).acos().to_degrees().min(NEARLY_HORIZONTAL_DEG))
            .collect();
        let tables = heights_km
            .iter()
            .map(|height| {
                let observer_km = height.max(bottom);
                match geometry {
                    Geometry::Plane => {
                        let rows = atmosphere.sky_from(observer_km, freqs_ghz, &zeniths, Geometry::Plane)?;
                        Ok(rows.chunks_exact(zeniths.len()).map(|c| c.iter().map(|r| r.tb_rj_k).collect()).collect())
                    }
                    Geometry::Spherical => {
                        let options =
                            SkyTableOptions { observer_km: Some(observer_km), tolerance_k: options.sky_k, ..SkyTableOptions::default() };
                        let table = SkyTable::for_frequencies(atmosphere, freqs_ghz, &options)?;
                        (0..freqs_ghz.len()).map(|c| zeniths.iter().map(|z| table.rayleigh_jeans_k(c, *z)).collect()).collect()
                    }
                }
            })
            .collect::<Result<Vec<_>, PhysicsError>>()?;
        Ok(Self { heights_km: heights_km.to_vec(), intervals: intervals as f64, tables })
    }

    /// A sky of the same temperature in every direction and at every height, K.
    #[must_use]
    pub fn uniform(temperature_k: f64, freqs_ghz: &[f64]) -> Self {
        let rj = |f: &f64| rayleigh_jeans_temperature_k(*f, black_body_radiance(*f, temperature_k));
        Self { heights_km: vec![f64::INFINITY], intervals: 1.0, tables: vec![freqs_ghz.iter().map(|f| vec![rj(f); 2]).collect()] }
    }

    /// Number and height in km of the lowest table at or above a height.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a height above all tables.
    #[inline]
    pub fn level_above(&self, height_km: f64) -> Result<(usize, f64), PhysicsError> {
        let last = self.heights_km.len() - 1;
        let highest = self.heights_km[last];
        if let Some(level) = self.heights_km.iter().position(|h| *h >= height_km - 1e-7) {
            return Ok((level, self.heights_km[level]));
        }
        check_range("height of a ray", height_km, "km", self.heights_km[0], highest + MARGIN_KM)?;
        Ok((last, highest))
    }

    /// Temperature in a channel for a cosine of the zenith angle of 0 to 1, at the height of a table, K.
    #[must_use]
    #[inline]
    pub fn rj_k(&self, level: usize, channel: usize, cos_zenith: f64) -> f64 {
        let table = &self.tables[level][channel];
        let c = cos_zenith.clamp(0.0, 1.0);
        let u = c / (c + HALF_COSINE) * (1.0 + HALF_COSINE) * self.intervals;
        let k = (u as usize).min(table.len() - 2);
        let w = u - k as f64;
        table[k] + w * (table[k + 1] - table[k])
    }
}

/// The cosine of the zenith angle at a fraction of the table.
fn cosine_at(fraction: f64) -> f64 {
    let u = fraction / (1.0 + HALF_COSINE);
    HALF_COSINE * u / (1.0 - u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_geometries_agree_with_the_integral() {
        let air = Atmosphere::reference("mls", "mpm89").unwrap();
        let freqs = [10.0, 94.0];
        for geometry in [Geometry::Plane, Geometry::Spherical] {
            let sky = SkyLookup::new(&air, geometry, &freqs, &[0.0, 0.3], &TableOptions::default()).unwrap();
            assert!(sky.level_above(0.31).unwrap_err().to_string().contains("height of a ray 0.31 km"));
            for (level, height) in [0.0, 0.3].into_iter().enumerate() {
                assert_eq!(sky.level_above(height).unwrap(), (level, height));
                for zenith in [0.0_f64, 17.3, 45.2, 61.7, 80.3, 86.1, 88.9, 89.6] {
                    let rows = air.sky_from(height, &freqs, &[zenith], geometry).unwrap();
                    for (channel, row) in rows.iter().enumerate() {
                        let off = sky.rj_k(level, channel, zenith.to_radians().cos()) - row.tb_rj_k;
                        assert!(off.abs() < 4e-3, "{geometry} {height} km {zenith} deg {}: {off}", row.freq_ghz);
                    }
                }
            }
        }
    }
}
