//! A stack of plane layers on a half-space, resolved at one frequency.

use super::coherent::{coherent_absorption, coherent_reflection};
use super::error::{SurfaceError, cos_incidence};
use super::fresnel::{Reflection, fresnel_cos};
use super::incoherent::{incoherent_absorption, incoherent_reflection};
use super::layer::{Layer, check_layer};
use super::volume::{Scatterer, StreamOptions, VolumeReflection};
use crate::constants::SPEED_OF_LIGHT_M_S;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Layers from the top; the last is a half-space.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    layers: Vec<Layer>,
    coherent: bool,
    /// The temperature, if all layers have the same.
    isothermal_k: Option<f64>,
    k0: f64,
    freq_hz: f64,
    /// Its solution, if a layer scatters.
    volume: Option<Arc<VolumeReflection>>,
}

impl Stack {
    /// A stack at one frequency: layers from the top, the last of infinite thickness.
    ///
    /// # Errors
    /// No layers; a permittivity with negative loss or not a number, a thickness that is
    /// negative or infinite above the last layer, a temperature at or below 0 K, a bad frequency.
    pub fn new(layers: Vec<Layer>, coherent: bool, freq_hz: f64) -> Result<Self, SurfaceError> {
        if !(freq_hz.is_finite() && freq_hz > 0.0) {
            return Err(SurfaceError::Refused(format!("frequency is {freq_hz} Hz; it must be a finite number above 0 Hz")));
        }
        let Some(bottom) = layers.last() else {
            return Err(SurfaceError::NoLayers);
        };
        for (i, layer) in layers.iter().enumerate() {
            check_layer(layer, i + 1 == layers.len()).map_err(|message| SurfaceError::Layer {
                layer: i + 1,
                place: String::new(),
                message,
            })?;
        }
        let isothermal_k = layers.iter().all(|l| l.temperature_k == bottom.temperature_k).then_some(bottom.temperature_k);
        Ok(Self { layers, coherent, isothermal_k, k0: TAU * freq_hz / SPEED_OF_LIGHT_M_S, freq_hz, volume: None })
    }

    /// A stack in which layers scatter, each by its scatterer. The equation of transfer is solved here.
    ///
    /// # Errors
    /// As [`Stack::new`]; a coherent stack, because scattered radiation has no phase; another number of scatterers than of layers.
    pub fn scattering(
        layers: Vec<Layer>,
        scatterers: &[Option<Scatterer>],
        coherent: bool,
        freq_hz: f64,
        options: StreamOptions,
    ) -> Result<Self, SurfaceError> {
        let mut stack = Self::new(layers, coherent, freq_hz)?;
        let Some(first) = scatterers.iter().position(Option::is_some) else { return Ok(stack) };
        if coherent {
            let message = "it scatters, and the stack is coherent; scattered radiation has no phase, so set coherent = false".to_owned();
            return Err(SurfaceError::Layer { layer: first + 1, place: String::new(), message });
        }
        if scatterers.len() != stack.layers.len() {
            let message = format!("{} scatterers for {} layers; give one or none for each layer", scatterers.len(), stack.layers.len());
            return Err(SurfaceError::Refused(message));
        }
        stack.volume = Some(Arc::new(VolumeReflection::new(&stack.layers, scatterers, stack.k0, options)));
        Ok(stack)
    }

    /// The same stack with other temperatures in K. What it absorbs and scatters does not change.
    ///
    /// # Errors
    /// A temperature at or below 0 K.
    pub fn with_temperatures(&self, temperature_k: impl Fn(f64) -> f64) -> Result<Self, SurfaceError> {
        let layers = self.layers.iter().map(|l| Layer { temperature_k: temperature_k(l.temperature_k), ..*l }).collect();
        Ok(Self { volume: self.volume.clone(), ..Self::new(layers, self.coherent, self.freq_hz)? })
    }

    /// The solution of the equation of transfer, if a layer scatters.
    #[must_use]
    pub fn volume(&self) -> Option<&VolumeReflection> {
        self.volume.as_deref()
    }

    /// A bare half-space.
    ///
    /// # Errors
    /// As [`Stack::new`].
    pub fn half_space(eps: Complex64, temperature_k: f64, freq_hz: f64) -> Result<Self, SurfaceError> {
        let layer = Layer { eps, thickness_m: f64::INFINITY, temperature_k };
        Self::new(vec![layer], true, freq_hz)
    }

    /// The layers, from the top.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Whether reflections of different layers interfere.
    #[must_use]
    pub fn is_coherent(&self) -> bool {
        self.coherent
    }

    /// Frequency, Hz.
    #[must_use]
    pub fn freq_hz(&self) -> f64 {
        self.freq_hz
    }

    /// Temperature of the top layer, K.
    #[must_use]
    pub fn top_temperature_k(&self) -> f64 {
        self.layers[0].temperature_k
    }

    /// Reflection at an angle of incidence in radians.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`].
    pub fn reflection(&self, theta_rad: f64) -> Result<Reflection, SurfaceError> {
        Ok(self.reflection_cos(cos_incidence(theta_rad)?))
    }

    /// Fraction of incident power that each layer absorbs, from the top, `[h, v]`. It is the weight of the temperature of the layer. The
    /// sum over layers and the reflectivity is 1.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`].
    pub fn absorption(&self, theta_rad: f64) -> Result<Vec<[f64; 2]>, SurfaceError> {
        Ok(self.absorption_cos(cos_incidence(theta_rad)?))
    }

    /// Emitted brightness `[h, v]`, K: the sum of the temperatures of the layers times their weights.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`].
    pub fn emission_k(&self, theta_rad: f64) -> Result<[f64; 2], SurfaceError> {
        Ok(self.emission_cos(cos_incidence(theta_rad)?))
    }

    pub(super) fn reflection_cos(&self, cos_theta: f64) -> Reflection {
        if let Some(volume) = &self.volume {
            return volume.reflection(cos_theta);
        }
        match self.layers.as_slice() {
            [only] => fresnel_cos(only.eps, cos_theta),
            layers if self.coherent => coherent_reflection(layers, self.k0, cos_theta),
            layers => incoherent_reflection(layers, self.k0, cos_theta),
        }
    }

    fn absorption_cos(&self, cos_theta: f64) -> Vec<[f64; 2]> {
        if let Some(volume) = &self.volume {
            volume.budget(cos_theta).absorbed
        } else if self.coherent {
            coherent_absorption(&self.layers, self.k0, cos_theta)
        } else {
            incoherent_absorption(&self.layers, self.k0, cos_theta)
        }
    }

    pub(super) fn emission_cos(&self, cos_theta: f64) -> [f64; 2] {
        if let Some(t) = self.isothermal_k {
            let r = self.reflection_cos(cos_theta);
            return [(1.0 - r.power_h) * t, (1.0 - r.power_v) * t];
        }
        let mut emitted = [0.0; 2];
        for (w, layer) in self.absorption_cos(cos_theta).iter().zip(&self.layers) {
            emitted[0] += w[0] * layer.temperature_k;
            emitted[1] += w[1] * layer.temperature_k;
        }
        emitted
    }

    /// Reflection and emission together, for a facet of a rough surface.
    pub(super) fn local_cos(&self, cos_theta: f64) -> (Reflection, [f64; 2]) {
        let reflection = self.reflection_cos(cos_theta);
        let emission = match self.isothermal_k {
            Some(t) => reflection.emissivities().map(|e| e * t),
            None => self.emission_cos(cos_theta),
        };
        (reflection, emission)
    }
}
