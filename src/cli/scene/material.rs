//! A material of the dielectric data base and its states, as options.

use super::values::{Fraction, Salinity, exact, or_absent};
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::quantity::{Density, Temperature};
use cittert_phenomenology::dielectrics::{DielectricError, Extrapolation, Material, MaterialState, Model, Parameter, material_of_model};
use cittert_phenomenology::surfaces::SurfaceError;
use clap::Args;

/// Options that describe a material.
#[derive(Debug, Args)]
pub(super) struct MaterialArgs {
    /// Material, as `scene list materials` names it [default: that of --model].
    #[arg(long, value_name = "NAME")]
    pub(super) material: Option<String>,
    /// Permittivity model, as `scene list models` names it [default: that of the material at the frequency].
    #[arg(long, value_name = "NAME")]
    pub(super) model: Option<String>,
    /// Physical temperatures [default: that of the material].
    #[arg(long, value_name = "TEMP", value_delimiter = ',', allow_hyphen_values = true)]
    pub(super) temperature: Vec<Temperature>,
    /// Salinities in psu (parts per thousand).
    #[arg(long, value_name = "PSU", value_delimiter = ',', allow_hyphen_values = true)]
    salinity: Vec<Salinity>,
    /// Water as a fraction of the volume (leaves: of the mass), 0.2 or 20%.
    #[arg(long, value_name = "FRACTION", value_delimiter = ',', allow_hyphen_values = true)]
    moisture: Vec<Fraction>,
    /// Dry bulk densities.
    #[arg(long, value_name = "DENSITY", value_delimiter = ',', allow_hyphen_values = true)]
    density: Vec<Density>,
    /// Soil texture, as `scene list textures` names it.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["sand", "clay"])]
    texture: Option<String>,
    /// Mass fraction of sand.
    #[arg(long, value_name = "FRACTION", allow_hyphen_values = true)]
    sand: Option<Fraction>,
    /// Mass fraction of clay.
    #[arg(long, value_name = "FRACTION", allow_hyphen_values = true)]
    clay: Option<Fraction>,
    /// Outside the range of a model use its documented extension instead of refusing.
    #[arg(long)]
    pub(super) extrapolate: bool,
}

/// A material, the model asked for, and every state.
pub(super) struct Sample {
    /// The material.
    pub(super) material: &'static Material,
    /// The model, if one was named.
    pub(super) model: Option<&'static Model>,
    /// Every combination of the parameters.
    pub(super) states: Vec<MaterialState>,
}

impl MaterialArgs {
    /// Number of states.
    pub(super) fn count(&self) -> [usize; 4] {
        [self.temperature.len(), self.salinity.len(), self.moisture.len(), self.density.len()]
    }

    /// Whether anything but the temperature of a layer was said.
    pub(super) fn is_silent(&self) -> bool {
        self.model.is_none()
            && self.count()[1..].iter().all(|n| *n == 0)
            && self.texture.is_none()
            && self.sand.is_none()
            && self.clay.is_none()
    }

    /// What to do outside the range of a model.
    pub(super) fn extrapolation(&self) -> Extrapolation {
        if self.extrapolate { Extrapolation::Documented } else { Extrapolation::Refuse }
    }

    /// The material in every state.
    ///
    /// # Errors
    /// Neither material nor model, unknown names, a parameter the material does not have.
    pub(super) fn sample(&self) -> Result<Sample> {
        let material = match (&self.material, &self.model) {
            (Some(name), _) => Material::by_name(name)?,
            (None, Some(model)) => material_of_model(model)?,
            (None, None) => {
                return Err(Failure::usage("give --material, or --model for the material it describes; `scene list` names them all"));
            }
        };
        let model = self.model.as_deref().map(|m| material.model(m)).transpose()?;
        let mut base = material.state();
        if let Some(texture) = &self.texture {
            material.set_texture(&mut base, texture)?;
        }
        for (parameter, value) in [(Parameter::Sand, self.sand), (Parameter::Clay, self.clay)] {
            if let Some(Fraction(x)) = value {
                material.set(&mut base, parameter.name(), x)?;
            }
        }
        let temperatures: Vec<f64> = self.temperature.iter().map(|t| t.si()).collect();
        let salinities: Vec<f64> = self.salinity.iter().map(|s| s.0).collect();
        let moistures: Vec<f64> = self.moisture.iter().map(|m| exact(m.0)).collect();
        let densities: Vec<f64> = self.density.iter().map(|d| exact(d.si())).collect();
        let lists = [
            (Parameter::Temperature, temperatures),
            (Parameter::Salinity, salinities),
            (Parameter::Moisture, moistures),
            (Parameter::Density, densities),
        ];
        let mut states = vec![base];
        for (parameter, values) in lists {
            let mut more = Vec::new();
            for state in &states {
                for value in or_absent(&values) {
                    let mut state = *state;
                    if let Some(value) = value {
                        material.set(&mut state, parameter.name(), value)?;
                    }
                    more.push(state);
                }
            }
            states = more;
        }
        Ok(Sample { material, model, states })
    }
}

/// Say how to get the extension, where a value lies outside the range of a model.
pub(super) fn with_hint<T>(result: Result<T, SurfaceError>) -> Result<T> {
    let outside = match &result {
        Err(SurfaceError::Dielectric(e) | SurfaceError::LayerMaterial { source: e, .. }) => {
            matches!(e, DielectricError::OutOfBand { .. } | DielectricError::OutOfRange { .. })
        }
        _ => false,
    };
    if outside { result.context("outside the range of the model; --extrapolate uses its documented extension") } else { Ok(result?) }
}
