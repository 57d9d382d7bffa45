//! An atmosphere: a profile, layers on it and the absorption models in use.

use std::sync::Arc;

use super::error::{PhysicsError, check_range};
use super::gas::{GasModel, gas_model};
use super::layer::{Layer, check_layers};
use super::planck::COSMIC_BACKGROUND_K;
use super::profile::Profile;
use super::rain::{RainModel, rain_model};
use super::reference::reference_profile;

/// A complete description of the air for the computation of sky and paths.
#[derive(Debug, Clone)]
pub struct Atmosphere {
    profile: Profile,
    layers: Vec<Layer>,
    gas: Arc<GasModel>,
    rain: Arc<dyn RainModel>,
    background_k: f64,
}

impl Atmosphere {
    /// A profile without layers, with the given gas model, P.838-3 rain and the
    /// cosmic background.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if the rain table is damaged.
    pub fn new(profile: Profile, gas: Arc<GasModel>) -> Result<Self, PhysicsError> {
        Ok(Self { profile, layers: Vec::new(), gas, rain: rain_model("p838")?, background_k: COSMIC_BACKGROUND_K })
    }

    /// A reference atmosphere and a gas model by name.
    ///
    /// # Errors
    /// [`PhysicsError::UnknownName`] with the known names.
    pub fn reference(atmosphere: &str, gas: &str) -> Result<Self, PhysicsError> {
        Self::new(reference_profile(atmosphere)?, gas_model(gas)?)
    }

    /// The same atmosphere with layers.
    ///
    /// # Errors
    /// [`PhysicsError::Refused`] for layers that overlap, or that reach outside the profile.
    pub fn with_layers(mut self, layers: Vec<Layer>) -> Result<Self, PhysicsError> {
        check_layers(&layers)?;
        let (bottom, top) = (self.profile.bottom_km(), self.profile.top_km());
        for layer in &layers {
            if layer.base_km() < bottom || layer.top_km() > top {
                return Err(layer.extent_error(bottom, top));
            }
        }
        self.layers = layers;
        Ok(self)
    }

    /// The same atmosphere with another rain model.
    #[must_use]
    pub fn with_rain_model(mut self, rain: Arc<dyn RainModel>) -> Self {
        self.rain = rain;
        self
    }

    /// The same atmosphere with another background than the cosmic one, for tests of the isothermal world.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside 0.1-1000 K.
    pub fn with_background(mut self, background_k: f64) -> Result<Self, PhysicsError> {
        self.background_k = check_range("background temperature", background_k, "K", 0.1, 1e3)?;
        Ok(self)
    }

    /// The profile.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The layers.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The gas model.
    #[must_use]
    pub fn gas(&self) -> &GasModel {
        self.gas.as_ref()
    }

    /// The rain model.
    #[must_use]
    pub fn rain(&self) -> &dyn RainModel {
        self.rain.as_ref()
    }

    pub(super) fn shared_rain(&self) -> Arc<dyn RainModel> {
        Arc::clone(&self.rain)
    }

    /// Temperature of the background behind the atmosphere, K.
    #[must_use]
    pub fn background_k(&self) -> f64 {
        self.background_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_must_fit_the_profile() {
        let mls = Atmosphere::reference("mls", "mpm89").unwrap();
        let below: Layer = "fog:-0.2km-0.1km:0.1g/m3".parse().unwrap();
        let message = mls.with_layers(vec![below]).unwrap_err().to_string();
        assert!(message.contains("0 km <= base < top <= 30 km"), "{message}");
    }

    #[test]
    fn layer_adds_its_attenuation() {
        let clear = Atmosphere::reference("mls", "mpm89").unwrap();
        let cloudy = clear.clone().with_layers(vec!["cloud:1km-2km:0.3g/m3".parse().unwrap()]).unwrap();
        let t = clear.profile().air_at(1.5).unwrap().temperature_k();
        let droplets = crate::atmosphere::droplet_attenuation_liebe93(94.0, t, 0.3).unwrap() * crate::atmosphere::NEPER_PER_DECIBEL;
        let gain = cloudy.absorption_np_per_km(94.0, 1.5).unwrap() - clear.absorption_np_per_km(94.0, 1.5).unwrap();
        assert!((gain / droplets - 1.0).abs() < 1e-9);
        assert_eq!(cloudy.absorption_np_per_km(94.0, 2.5).unwrap(), clear.absorption_np_per_km(94.0, 2.5).unwrap());
    }

    #[test]
    fn cold_liquid_cloud_is_refused() {
        let saw = Atmosphere::reference("saw", "mpm89").unwrap();
        let cold = saw.with_layers(vec!["cloud:8km-9km:0.1g/m3".parse().unwrap()]).unwrap();
        let message = cold.absorption_np_per_km(94.0, 8.5).unwrap_err().to_string();
        assert!(message.contains("temperature of liquid droplets"), "{message}");
    }
}
