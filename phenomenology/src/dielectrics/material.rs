//! A material: its parameters, and the states it can have.

use super::error::{DielectricError, join};
use super::soil_texture::SoilTexture;
use super::state::{MaterialState, Parameter, ParameterSpec};
use serde::Deserialize;

/// Constants of a material for a model that describes several materials.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Constants {
    /// No constants.
    #[default]
    None,
    /// Row of the P.2040 table.
    P2040(&'static str),
    /// Conductivity, S/m.
    Conductivity(f64),
    /// Fixed permittivity: real part and loss.
    Fixed(f64, f64),
}

/// One material of the data base.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name.
    pub name: &'static str,
    /// Other names of the material.
    #[serde(default)]
    pub aliases: Vec<&'static str>,
    /// Description in one line.
    pub describes: &'static str,
    /// Default models, each with the frequency in GHz up to which it is preferred. The first preferred model whose band contains the
    /// frequency is used.
    pub defaults: Vec<(&'static str, f64)>,
    /// Other models, which are used only if they are named.
    #[serde(default)]
    pub others: Vec<&'static str>,
    /// Its parameters.
    pub parameters: Vec<ParameterSpec>,
    /// Constants for a model that describes several materials.
    #[serde(default)]
    pub constants: Constants,
    /// Density of its solid grains, kg/m3, if water fills the pores between them.
    pub grains_kg_m3: Option<f64>,
}

impl Material {
    /// The state with every parameter at its default.
    #[must_use]
    pub fn state(&self) -> MaterialState {
        let mut state = MaterialState { temperature_k: 290.0, salinity_psu: 0.0, moisture: 0.0, density_kg_m3: 0.0, sand: 0.0, clay: 0.0 };
        for spec in &self.parameters {
            state.set(spec.parameter, spec.default);
        }
        state
    }

    /// Sets a parameter of a state by its option name or file key (`salinity`, `salinity_psu`).
    ///
    /// The temperature may be set for every material, because every material emits.
    ///
    /// # Errors
    /// [`DielectricError::Refused`] if this material has no such parameter.
    pub fn set(&self, state: &mut MaterialState, name: &str, value: f64) -> Result<(), DielectricError> {
        match Parameter::by_name(name) {
            Some(p) if p == Parameter::Temperature || self.spec(p).is_some() => {
                state.set(p, value);
                Ok(())
            }
            _ => {
                let known = join(self.parameters.iter().map(|s| s.parameter.name()));
                Err(DielectricError::Refused(format!("`{}` has no parameter `{name}`; its parameters are: {known}", self.name)))
            }
        }
    }

    /// Sets sand and clay of a state from a named soil texture.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`], or [`DielectricError::Refused`] if this
    /// material is no soil.
    pub fn set_texture(&self, state: &mut MaterialState, texture: &str) -> Result<(), DielectricError> {
        let texture = SoilTexture::by_name(texture)?;
        self.set(state, "sand", texture.sand)?;
        self.set(state, "clay", texture.clay)
    }

    /// The parameter row of this material, if it has the parameter.
    #[must_use]
    pub fn spec(&self, parameter: Parameter) -> Option<&ParameterSpec> {
        self.parameters.iter().find(|s| s.parameter == parameter)
    }

    /// Names of its models, defaults first.
    pub fn model_names(&self) -> impl Iterator<Item = &'static str> {
        self.defaults.iter().map(|d| d.0).chain(self.others.iter().copied())
    }

    /// Checks that a state is possible. The ranges of the models are not checked.
    ///
    /// # Errors
    /// Temperatures at or below 0 K, values out of bounds or not numbers, moisture above porosity.
    pub fn check_state(&self, state: &MaterialState) -> Result<(), DielectricError> {
        let refused = |message: String| Err(DielectricError::Refused(message));
        if !(state.temperature_k.is_finite() && state.temperature_k > 0.0) {
            return refused(format!("temperature is {} K; it must be a finite number above 0 K", state.temperature_k));
        }
        for ParameterSpec { parameter, min, max, .. } in &self.parameters {
            let (value, unit) = (state.get(*parameter), parameter.unit());
            if !(value >= *min && value <= *max) {
                return refused(format!("{parameter} of `{}` is {value} {unit}; it must lie in {min} to {max} {unit}", self.name));
            }
        }
        let MaterialState { sand, clay, moisture, density_kg_m3, .. } = *state;
        if self.spec(Parameter::Sand).is_some() && sand + clay > 1.0 + 1e-9 {
            return refused(format!("sand {sand} and clay {clay} add up to more than 1"));
        }
        if let Some(solid) = self.grains_kg_m3 {
            let porosity = 1.0 - density_kg_m3 / solid;
            if moisture > porosity + 1e-9 {
                let dry = format!("(dry density {density_kg_m3} kg/m3); give less moisture or a lower density");
                return refused(format!("moisture {moisture} of `{}` is above its porosity {porosity:.4} {dry}", self.name));
            }
        }
        Ok(())
    }
}
