//! Options that name a material of the dielectric database and its states.

use super::table::Cell;
use super::values::{Fraction, Salinity, exact};
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::quantity::{Density, Temperature};
use cittert_phenomenology::dielectrics::{DielectricError, Extrapolation, Material, MaterialState, Model, Parameter, material_of_model};
use cittert_phenomenology::surfaces::SurfaceError;
use clap::Args;

/// Options that name a material.
#[derive(Debug, Args)]
pub(super) struct MaterialArgs {
    /// Material, as `scene list materials` names it [default: the material that --model describes].
    #[arg(long, value_name = "NAME")]
    pub(super) material: Option<String>,
    /// Permittivity model, as `scene list models` names it [default: the material's own at the frequency].
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
    /// Outside the range of a model, use the extension that the model documents instead of stopping with an error.
    #[arg(long)]
    pub(super) extrapolate: bool,
}

/// A material, the model that was named, and every state.
pub(super) struct Sample {
    /// The material.
    pub(super) material: &'static Material,
    /// The model, if one was named.
    pub(super) model: Option<&'static Model>,
    /// Every combination of the parameters.
    pub(super) states: Vec<MaterialState>,
}

impl Sample {
    /// The cell of a parameter in a state, empty where the material has no such parameter.
    pub(super) fn cell(&self, state: &MaterialState, parameter: Parameter) -> Cell {
        self.material.spec(parameter).map_or(Cell::Absent, |_| Cell::Number(state.get(parameter)))
    }
}

impl MaterialArgs {
    /// Number of values of each parameter.
    pub(super) fn lengths(&self) -> [usize; 4] {
        [self.temperature.len(), self.salinity.len(), self.moisture.len(), self.density.len()]
    }

    /// Whether no model and no parameter but the temperature is given.
    pub(super) fn is_silent(&self) -> bool {
        let named = [&self.model, &self.texture].into_iter().any(Option::is_some);
        !(named || self.sand.is_some() || self.clay.is_some() || self.lengths()[1..].iter().any(|n| *n > 0))
    }

    /// The behaviour outside the range of a model.
    pub(super) fn extrapolation(&self) -> Extrapolation {
        if self.extrapolate { Extrapolation::Documented } else { Extrapolation::Refuse }
    }

    /// The material in every state.
    ///
    /// # Errors
    /// Neither material nor model, unknown names, a parameter that the material does not have.
    pub(super) fn sample(&self) -> Result<Sample> {
        let material = match (&self.material, &self.model) {
            (Some(name), _) => Material::by_name(name)?,
            (None, Some(model)) => material_of_model(model)?,
            (None, None) => {
                return Err(Failure::usage(
                    "give --material, or --model for the material that it describes; `scene list` names all of them",
                ));
            }
        };
        let model = self.model.as_deref().map(|m| material.model(m)).transpose()?;
        let mut base = material.state();
        if let Some(texture) = &self.texture {
            material.set_texture(&mut base, texture)?;
        }
        let one = |value: Option<Fraction>| value.map(|x| x.0).into_iter().collect();
        let lists: [(Parameter, Vec<f64>); 6] = [
            (Parameter::Sand, one(self.sand)),
            (Parameter::Clay, one(self.clay)),
            (Parameter::Temperature, self.temperature.iter().map(|t| t.si()).collect()),
            (Parameter::Salinity, self.salinity.iter().map(|s| s.0).collect()),
            (Parameter::Moisture, self.moisture.iter().map(|m| exact(m.0)).collect()),
            (Parameter::Density, self.density.iter().map(|d| exact(d.si())).collect()),
        ];
        let mut states = vec![base];
        // A list that is left out keeps the value of the material.
        for (parameter, values) in lists.into_iter().filter(|(_, values)| !values.is_empty()) {
            let mut more = Vec::with_capacity(states.len() * values.len());
            for (state, value) in states.iter().flat_map(|state| values.iter().map(move |value| (state, value))) {
                let mut state = *state;
                material.set(&mut state, parameter.name(), *value)?;
                more.push(state);
            }
            states = more;
        }
        Ok(Sample { material, model, states })
    }
}

/// Name `--extrapolate` in the error where a value lies outside the range of a model.
pub(super) fn with_hint<T>(result: Result<T, SurfaceError>) -> Result<T> {
    use DielectricError::{OutOfBand, OutOfRange};
    match result {
        Err(
            e @ (SurfaceError::Dielectric(OutOfBand { .. } | OutOfRange { .. })
            | SurfaceError::LayerMaterial { source: OutOfBand { .. } | OutOfRange { .. }, .. }),
        ) => Err(e).context("a value lies outside the range of the model; --extrapolate uses the extension that the model documents"),
        other => Ok(other?),
    }
}
