//! Air on the vertical grid, and the absorption column of one frequency on it.
//!
//! The line parameters depend only on the air, so they are computed once for each level and used for every frequency. A column is used
//! for every ray.

use std::sync::Arc;

use super::air::AirState;
use super::error::{PhysicsError, check_frequency, check_range};
use super::gas::{GasSpectrum, NEPER_PER_DECIBEL};
use super::grid::grid_levels;
use super::hydrosol::{crystal_attenuation_liebe93, droplet_attenuation_liebe93};
use super::layer::{Layer, Phase};
use super::model::Atmosphere;
use super::planck::black_body_radiance;
use super::rain::{RainModel, rain_attenuation};
use super::refractivity::refractive_index;

/// Air at the levels of a grid, lowest first.
#[derive(Debug)]
pub(super) struct AirGrid {
    levels: Arc<Levels>,
    pub(super) spectra: Vec<GasSpectrum>,
    /// Layers present between level i and i + 1.
    pub(super) layers: Vec<Vec<Layer>>,
    rain: Arc<dyn RainModel>,
}

/// Heights, temperatures and refractive indices of the levels.
#[derive(Debug)]
pub(super) struct Levels {
    /// Heights, km.
    pub(super) z_km: Vec<f64>,
    /// Temperatures, K.
    pub(super) t_k: Vec<f64>,
    /// Refractive indices.
    pub(super) index: Vec<f64>,
}

/// Absorption and source of one frequency on the levels of a grid.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// Frequency, GHz.
    pub(super) freq_ghz: f64,
    /// The levels.
    pub(super) levels: Arc<Levels>,
    /// Gas absorption at the levels, Np/km.
    pub(super) gas: Vec<f64>,
    /// Absorption of layers between levels i and i + 1, Np/km.
    pub(super) hydrosol: Vec<f64>,
    /// Mean absorption between levels i and i + 1, Np/km.
    pub(super) mean: Vec<f64>,
    /// Black-body radiance at the levels.
    pub(super) radiance: Vec<f64>,
}

impl AirGrid {
    fn new(atmosphere: &Atmosphere, z_km: Vec<f64>) -> Result<Self, PhysicsError> {
        let air: Vec<AirState> = z_km.iter().map(|z| atmosphere.profile().air_at(*z)).collect::<Result<_, _>>()?;
        let spectra = air.iter().map(|state| atmosphere.gas().spectrum(state)).collect();
        let layers = z_km
            .windows(2)
            .map(|pair| {
                let middle = 0.5 * (pair[0] + pair[1]);
                let inside = |l: &&Layer| l.base_km() < middle && middle < l.top_km();
                atmosphere.layers().iter().filter(inside).copied().collect()
            })
            .collect();
        let levels =
            Levels { t_k: air.iter().map(AirState::temperature_k).collect(), index: air.iter().map(refractive_index).collect(), z_km };
        Ok(Self { levels: Arc::new(levels), spectra, layers, rain: atmosphere.shared_rain() })
    }

    pub(super) fn levels(&self) -> &Arc<Levels> {
        &self.levels
    }

    /// Absorption and source at one frequency.
    pub(super) fn column(&self, freq_ghz: f64) -> Result<Column, PhysicsError> {
        check_frequency(freq_ghz)?;
        let gas: Vec<f64> = self.spectra.iter().map(|s| s.absorption(freq_ghz).total_np_per_km()).collect();
        let mut hydrosol = Vec::with_capacity(self.layers.len());
        for (i, layers) in self.layers.iter().enumerate() {
            let mut sum = 0.0;
            for layer in layers {
                for t in [self.levels.t_k[i], self.levels.t_k[i + 1]] {
                    let rain = self.rain.as_ref();
                    sum += 0.5 * layer_absorption_np_per_km(layer, rain, freq_ghz, t)?;
                }
            }
            hydrosol.push(sum);
        }
        let mean = gas.windows(2).zip(&hydrosol).map(|(pair, layer)| logarithmic_mean(pair[0], pair[1]) + layer).collect();
        let radiance = self.levels.t_k.iter().map(|t| black_body_radiance(freq_ghz, *t)).collect();
        Ok(Column { freq_ghz, levels: Arc::clone(&self.levels), gas, hydrosol, mean, radiance })
    }

    /// Columns of several frequencies.
    pub(super) fn columns(&self, freqs_ghz: &[f64]) -> Result<Vec<Column>, PhysicsError> {
        freqs_ghz.iter().map(|f| self.column(*f)).collect()
    }
}

impl Atmosphere {
    /// Power absorption at a height, Np/km, gas and layers together.
    ///
    /// The edges belong to the layer.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a frequency or height out of range.
    pub fn absorption_np_per_km(&self, freq_ghz: f64, z_km: f64) -> Result<f64, PhysicsError> {
        check_frequency(freq_ghz)?;
        let air = self.profile().air_at(z_km)?;
        let gas = self.gas().spectrum(&air).absorption(freq_ghz).total_np_per_km();
        let inside = |layer: &&Layer| (layer.base_km()..=layer.top_km()).contains(&z_km);
        let mut sum = gas;
        for layer in self.layers().iter().filter(inside) {
            sum += layer_absorption_np_per_km(layer, self.rain(), freq_ghz, air.temperature_k())?;
        }
        Ok(sum)
    }

    /// The grid of air between two heights, with layer edges and `extra_km` as levels.
    pub(super) fn air_grid(&self, from_km: f64, to_km: f64, extra_km: &[f64]) -> Result<AirGrid, PhysicsError> {
        let (bottom, top) = (self.profile().bottom_km(), self.profile().top_km());
        check_range("height", from_km, "km", bottom, top)?;
        check_range("height", to_km, "km", bottom, top)?;
        let mut extra = extra_km.to_vec();
        extra.extend(self.layers().iter().flat_map(|l| [l.base_km(), l.top_km()]));
        extra.extend(self.profile().levels().iter().map(|level| level.z_km));
        AirGrid::new(self, grid_levels(from_km, to_km, &extra))
    }
}

/// Absorption of a layer where it is present, Np/km.
fn layer_absorption_np_per_km(layer: &Layer, rain: &dyn RainModel, freq_ghz: f64, temperature_k: f64) -> Result<f64, PhysicsError> {
    let amount = layer.amount();
    let db_per_km = match layer.kind().entry().phase {
        Phase::Droplets => droplet_attenuation_liebe93(freq_ghz, temperature_k, amount)?,
        Phase::Crystals => crystal_attenuation_liebe93(freq_ghz, temperature_k, amount)?,
        Phase::Rain => rain_attenuation(rain, freq_ghz, amount)?.mean_db_per_km(),
    };
    Ok(db_per_km * NEPER_PER_DECIBEL)
}

/// Mean of a quantity that is exponential between two values: `(b - a)/ln(b/a)`.
pub(super) fn logarithmic_mean(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 {
        let u = b / a - 1.0;
        // If the values are nearly equal, the quotient loses digits and the series does not.
        if u.abs() < 1e-4 { a * (1.0 + u * (0.5 - u / 12.0)) } else { (b - a) / u.ln_1p() }
    } else {
        0.5 * (a + b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_mean_of_an_exponential() {
        assert!((logarithmic_mean(1.0, std::f64::consts::E) - (std::f64::consts::E - 1.0)).abs() < 1e-12);
        assert_eq!(logarithmic_mean(2.0, 2.0), 2.0);
        assert_eq!(logarithmic_mean(0.0, 2.0), 1.0);
        let (below, above) = (logarithmic_mean(1.0, 1.000_099_9), logarithmic_mean(1.0, 1.000_100_1));
        assert!((above - below - 1e-7).abs() < 1e-11);
    }
}
