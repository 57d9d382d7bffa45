//! Sky temperatures against direction, at a few heights, found without a search.

use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::atmosphere::{Atmosphere, Geometry, PhysicsError, SkyTable, SkyTableOptions};

/// Intervals of a table.
const INTERVALS: usize = 1024;
/// Cosine at which half of the table is used up: with `u = c/(c + c0)` the sky is smooth in `u` from zenith to horizon.
const HALF_COSINE: f64 = 0.05;
/// Angle that stands for the horizon of plane-parallel air, degrees.
const NEARLY_HORIZONTAL_DEG: f64 = 89.9999;

/// Rayleigh-Jeans temperatures of the sky, K.
#[derive(Debug, Clone)]
pub struct SkyLookup {
    heights_km: Vec<f64>,
    /// // [height][chan][node]
    tables: Vec<Vec<Vec<f64>>>,
}

impl SkyLookup {
    /// Tables at heights in km (sorted, at least one) for frequencies in GHz.
    ///
    /// # Errors
    /// As [`Atmosphere::sky_from`] and [`SkyTable::for_frequencies`].
    pub fn new(atmosphere: &Atmosphere, geometry: Geometry, freqs_ghz: &[f64], heights_km: &[f64]) -> Result<Self, PhysicsError> {
        let bottom = atmosphere.profile().bottom_km();
        let zeniths: Vec<f64> =
            (0..=INTERVALS).map(|k| cosine_at(k).clamp(0.0, 1.0).acos().to_degrees().min(NEARLY_HORIZONTAL_DEG)).collect();
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
                        let options = SkyTableOptions { observer_km: Some(observer_km), tolerance_k: 2e-3, ..SkyTableOptions::default() };
                        let table = SkyTable::for_frequencies(atmosphere, freqs_ghz, &options)?;
                        (0..freqs_ghz.len()).map(|c| zeniths.iter().map(|z| table.rayleigh_jeans_k(c, *z)).collect()).collect()
                    }
                }
            })
            .collect::<Result<Vec<_>, PhysicsError>>()?;
        Ok(Self { heights_km: heights_km.to_vec(), tables })
    }

    /// The same temperature everywhere: space, in K.
    #[must_use]
    pub fn uniform(temperature_k: f64, freqs_ghz: &[f64]) -> Self {
        let rj = |f: &f64| rayleigh_jeans_temperature_k(*f, black_body_radiance(*f, temperature_k));
        Self { heights_km: vec![0.0], tables: vec![freqs_ghz.iter().map(|f| vec![rj(f); INTERVALS + 1]).collect()] }
    }

    /// The lowest height of a table at or above a height, and its number; the highest table for what lies above all.
    #[must_use]
    #[inline]
    pub fn level_above(&self, height_km: f64) -> (usize, f64) {
        let level = self.heights_km.iter().position(|h| *h >= height_km - 1e-7).unwrap_or(self.heights_km.len() - 1);
        (level, self.heights_km[level])
    }

    /// Temperature in a channel for a cosine of the zenith angle of 0 to 1, at the height of a table, K.
    #[must_use]
    #[inline]
    pub fn rj_k(&self, level: usize, channel: usize, cos_zenith: f64) -> f64 {
        let table = &self.tables[level][channel];
        let c = cos_zenith.clamp(0.0, 1.0);
        let u = c / (c + HALF_COSINE) * (1.0 + HALF_COSINE) * INTERVALS as f64;
        let k = (u as usize).min(INTERVALS - 1);
        let w = u - k as f64;
        table[k] + w * (table[k + 1] - table[k])
    }
}

fn cosine_at(node: usize) -> f64 {
    let u = node as f64 / INTERVALS as f64 / (1.0 + HALF_COSINE);
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
            let sky = SkyLookup::new(&air, geometry, &freqs, &[0.0, 0.3]).unwrap();
            for (level, height) in [0.0, 0.3].into_iter().enumerate() {
                assert_eq!(sky.level_above(height), (level, height));
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
