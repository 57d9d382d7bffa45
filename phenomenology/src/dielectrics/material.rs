//! A material: its parameters, its models, and the permittivity they give.

use super::error::DielectricError;
use super::model::{Extrapolation, Model, Query};
use super::soil_texture::SoilTexture;
use super::state::{MaterialState, Parameter};
use super::table::MATERIALS;
use super::{MODELS, model_by_name};
use num_complex::Complex64;

/// A parameter of a material: its default, and the values such a material can have at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// The parameter.
    pub parameter: Parameter,
    /// Value where none is given.
    pub default: f64,
    /// Least possible value.
    pub min: f64,
    /// Greatest possible value.
    pub max: f64,
}

/// Numbers a material brings to a model that serves several materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constants {
    /// None needed.
    None,
    /// Row of the P.2040 table.
    P2040(&'static str),
    /// Conductivity, S/m.
    Conductivity(f64),
    /// Fixed permittivity: real part and loss.
    Fixed(f64, f64),
}

/// What limits the water a material can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pores {
    /// Nothing beyond the range of the parameter.
    None,
    /// Pores between solid grains of this density, kg/m3.
    Grains(f64),
}

/// One material of the data base.
#[derive(Debug, Clone, Copy)]
pub struct Material {
    /// Name.
    pub name: &'static str,
    /// Other names it answers to.
    pub aliases: &'static [&'static str],
    /// One line about it.
    pub describes: &'static str,
    /// Default models with the frequency in GHz up to which each is preferred: the first that
    /// is preferred and whose band holds the frequency is used.
    pub defaults: &'static [(&'static str, f64)],
    /// Further models that may be asked for by name.
    pub others: &'static [&'static str],
    /// Its parameters.
    pub parameters: &'static [ParameterSpec],
    /// Its numbers for shared models.
    pub constants: Constants,
    /// What limits its water.
    pub pores: Pores,
}

/// A permittivity and how it was made.
#[derive(Debug, Clone, Copy)]
pub struct Permittivity {
    /// `eps' - j eps''`.
    pub eps: Complex64,
    /// The model that gave it.
    pub model: &'static Model,
    /// Whether the documented extension of the model was used.
    pub extended: bool,
}

impl Material {
    /// The material of this name or alias; `_` and `-` are the same.
    ///
    /// # Errors
    /// [`DielectricError::UnknownMaterial`] with the known names.
    pub fn by_name(name: &str) -> Result<&'static Self, DielectricError> {
        let wanted = name.trim().to_ascii_lowercase().replace('_', "-");
        MATERIALS
            .iter()
            .find(|m| m.name == wanted || m.aliases.contains(&wanted.as_str()))
            .ok_or_else(|| DielectricError::UnknownMaterial {
                name: name.to_owned(),
                known: join(MATERIALS.iter().map(|m| m.name)),
            })
    }

    /// Every material, in table order.
    #[must_use]
    pub fn all() -> &'static [Self] {
        MATERIALS
    }

    /// The state with every parameter at its default.
    #[must_use]
    pub fn state(&self) -> MaterialState {
        let mut state = MaterialState {
            temperature_k: 290.0,
            salinity_psu: 0.0,
            moisture: 0.0,
            density_kg_m3: 0.0,
            sand: 0.0,
            clay: 0.0,
        };
        for spec in self.parameters {
            state.set(spec.parameter, spec.default);
        }
        state
    }

    /// Set a parameter of a state by its option name or file key (`salinity`, `salinity_psu`).
    ///
    /// Temperature may be set for every material, since every material emits.
    ///
    /// # Errors
    /// [`DielectricError::NotAParameter`] if this material has no such parameter.
    pub fn set(
        &self,
        state: &mut MaterialState,
        name: &str,
        value: f64,
    ) -> Result<(), DielectricError> {
        match Parameter::by_name(name) {
            Some(p) if p == Parameter::Temperature || self.spec(p).is_some() => {
                state.set(p, value);
                Ok(())
            }
            _ => Err(DielectricError::NotAParameter {
                material: self.name,
                parameter: name.to_owned(),
                known: join(self.parameters.iter().map(|s| s.parameter.name())),
            }),
        }
    }

    /// Set sand and clay of a state from a named soil texture.
    ///
    /// # Errors
    /// [`DielectricError::UnknownTexture`], or [`DielectricError::NotAParameter`] if this
    /// material is no soil.
    pub fn set_texture(
        &self,
        state: &mut MaterialState,
        texture: &str,
    ) -> Result<(), DielectricError> {
        let texture = SoilTexture::by_name(texture)?;
        self.set(state, "sand", texture.sand)?;
        self.set(state, "clay", texture.clay)
    }

    /// The parameter row of this material, if it has the parameter.
    #[must_use]
    pub fn spec(&self, parameter: Parameter) -> Option<&'static ParameterSpec> {
        self.parameters.iter().find(|s| s.parameter == parameter)
    }

    /// Names of its models, defaults first.
    pub fn model_names(&self) -> impl Iterator<Item = &'static str> {
        self.defaults
            .iter()
            .map(|d| d.0)
            .chain(self.others.iter().copied())
    }

    /// The model of this name, if it describes this material.
    ///
    /// # Errors
    /// [`DielectricError::UnknownModel`] or [`DielectricError::ModelNotForMaterial`].
    pub fn model(&self, name: &str) -> Result<&'static Model, DielectricError> {
        let model = model_by_name(name)?;
        if self.model_names().any(|n| n == model.name) {
            Ok(model)
        } else {
            Err(DielectricError::ModelNotForMaterial {
                model: name.to_owned(),
                material: self.name,
                known: join(self.model_names()),
            })
        }
    }

    /// The model used where none is named: the first preferred default whose band holds the
    /// frequency, or else the one whose band is nearest.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if a built-in table is damaged.
    pub fn default_model(&self, freq_hz: f64) -> Result<&'static Model, DielectricError> {
        let mut best: Option<(f64, &'static Model)> = None;
        let freq_ghz = freq_hz * 1e-9;
        for &(name, until_ghz) in self.defaults {
            if freq_ghz > until_ghz * (1.0 + 1e-9) {
                continue;
            }
            let model = model_by_name(name)?;
            for band in model.bands_of(self)? {
                let distance = band.distance(freq_ghz);
                if best.is_none_or(|(d, _)| distance < d) {
                    best = Some((distance, model));
                }
            }
        }
        best.map(|(_, model)| model).ok_or(DielectricError::Table {
            table: "materials",
            message: format!("`{}` has no default model", self.name),
        })
    }

    /// Permittivity `eps' - j eps''` of the default model, inside its range only.
    ///
    /// # Errors
    /// A state or frequency that cannot be, or one outside the range of the model.
    pub fn permittivity(
        &self,
        state: &MaterialState,
        freq_hz: f64,
    ) -> Result<Complex64, DielectricError> {
        self.evaluate(None, state, freq_hz, Extrapolation::Refuse)
            .map(|p| p.eps)
    }

    /// Permittivity of a chosen model (`None`: the default), with the extension if asked for.
    ///
    /// # Errors
    /// A state or frequency that cannot be; outside the range with [`Extrapolation::Refuse`].
    pub fn evaluate(
        &self,
        model: Option<&'static Model>,
        state: &MaterialState,
        freq_hz: f64,
        extrapolation: Extrapolation,
    ) -> Result<Permittivity, DielectricError> {
        if !(freq_hz.is_finite() && freq_hz > 0.0) {
            return Err(DielectricError::Frequency { value: freq_hz });
        }
        self.check_state(state)?;
        let model = match model {
            Some(model) => model,
            None => self.default_model(freq_hz)?,
        };
        let query = Query {
            material: self,
            state,
            freq_hz,
        };
        let extended = match model.check_range(&query) {
            Ok(()) => false,
            Err(DielectricError::OutOfBand { .. } | DielectricError::OutOfRange { .. })
                if extrapolation == Extrapolation::Documented =>
            {
                true
            }
            Err(error) => return Err(error),
        };
        let mut eps = (model.formula)(&query)?;
        if eps.im > 0.0 && eps.im < 1e-9 * eps.norm() {
            eps.im = 0.0; // a lossless limit, missed by rounding
        }
        if !(eps.re.is_finite() && eps.im.is_finite() && eps.im <= 0.0) {
            return Err(DielectricError::Unphysical {
                model: model.name,
                eps,
            });
        }
        Ok(Permittivity {
            eps,
            model,
            extended,
        })
    }

    /// Whether the state can exist at all, whatever the model.
    ///
    /// # Errors
    /// Temperatures at or below 0 K, values out of bounds or not numbers, moisture above porosity.
    pub fn check_state(&self, state: &MaterialState) -> Result<(), DielectricError> {
        if !(state.temperature_k.is_finite() && state.temperature_k > 0.0) {
            return Err(DielectricError::Temperature {
                value: state.temperature_k,
            });
        }
        for spec in self.parameters {
            let value = state.get(spec.parameter);
            if !(value >= spec.min && value <= spec.max) {
                return Err(DielectricError::Impossible {
                    material: self.name,
                    parameter: spec.parameter,
                    value,
                    unit: spec.parameter.unit(),
                    min: spec.min,
                    max: spec.max,
                });
            }
        }
        if self.spec(Parameter::Sand).is_some() && state.sand + state.clay > 1.0 + 1e-9 {
            return Err(DielectricError::TextureSum {
                sand: state.sand,
                clay: state.clay,
            });
        }
        if let Pores::Grains(solid) = self.pores {
            let porosity = 1.0 - state.density_kg_m3 / solid;
            if state.moisture > porosity + 1e-9 {
                return Err(DielectricError::MoistureAbovePorosity {
                    material: self.name,
                    moisture: state.moisture,
                    porosity,
                    density_kg_m3: state.density_kg_m3,
                });
            }
        }
        Ok(())
    }
}

/// A material that has the named model, its home where only a model is named.
///
/// # Errors
/// [`DielectricError::UnknownModel`].
pub fn material_of_model(name: &str) -> Result<&'static Material, DielectricError> {
    let model = model_by_name(name)?;
    MATERIALS
        .iter()
        .find(|m| m.defaults.iter().any(|d| d.0 == model.name))
        .or_else(|| MATERIALS.iter().find(|m| m.others.contains(&model.name)))
        .ok_or_else(|| DielectricError::UnknownModel {
            name: name.to_owned(),
            known: join(MODELS.iter().map(|m| m.name)),
        })
}

/// Names separated by commas, for messages.
pub(super) fn join<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
