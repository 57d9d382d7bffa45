//! The permittivity of a material by one of its models.

use super::error::{DielectricError, join};
use super::material::Material;
use super::model::{Extrapolation, Model};
use super::state::MaterialState;
use num_complex::Complex64;

/// A permittivity and the model that gave it.
#[derive(Debug, Clone, Copy)]
pub struct Permittivity {
    /// `eps' - j eps''`.
    pub eps: Complex64,
    /// The model that gave it.
    pub model: &'static Model,
    /// Whether the documented extension of the model was used.
    pub extended: bool,
}

impl Permittivity {
    /// Relative standard uncertainty by the extension of the model; 0 inside its range, where the model is taken as it is.
    #[must_use]
    pub fn uncertainty(&self) -> f64 {
        if self.extended { self.model.uncertainty } else { 0.0 }
    }
}

impl Material {
    /// The model of this name, if it describes this material.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`] or [`DielectricError::Refused`].
    pub fn model(&self, name: &str) -> Result<&'static Model, DielectricError> {
        let model = Model::by_name(name)?;
        self.check_model(model)?;
        Ok(model)
    }

    fn check_model(&self, model: &Model) -> Result<(), DielectricError> {
        if self.model_names().any(|n| n == model.name) {
            return Ok(());
        }
        let known = join(self.model_names());
        Err(DielectricError::Refused(format!("model `{}` does not describe `{}`; its models are: {known}", model.name, self.name)))
    }

    /// The model that is used if none is named: the first preferred default whose band contains the frequency, or else the one whose band
    /// is nearest.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if a built-in table is damaged.
    pub fn default_model(&self, freq_hz: f64) -> Result<&'static Model, DielectricError> {
        let mut best: Option<(f64, &'static Model)> = None;
        let freq_ghz = freq_hz * 1e-9;
        for &(name, until_ghz) in &self.defaults {
            if freq_ghz > until_ghz * (1.0 + 1e-9) {
                continue;
            }
            let model = Model::by_name(name)?;
            for band in model.bands_of(self)? {
                let distance = band.distance(freq_ghz);
                if best.is_none_or(|(d, _)| distance < d) {
                    best = Some((distance, model));
                }
            }
        }
        best.map(|(_, model)| model)
            .ok_or(DielectricError::Table { table: "materials", message: format!("`{}` has no default model", self.name) })
    }

    /// Permittivity `eps' - j eps''` by the default model, inside its range only.
    ///
    /// # Errors
    /// An impossible state or frequency, or one outside the range of the model.
    pub fn permittivity(&self, state: &MaterialState, freq_hz: f64) -> Result<Complex64, DielectricError> {
        self.evaluate(None, state, freq_hz, Extrapolation::Refuse).map(|p| p.eps)
    }

    /// Permittivity of a chosen model (`None`: the default), with the extension if asked for.
    ///
    /// # Errors
    /// A model that does not describe the material; an impossible state or frequency; a state or frequency outside the range of the model,
    /// with [`Extrapolation::Refuse`].
    pub fn evaluate(
        &self,
        model: Option<&'static Model>,
        state: &MaterialState,
        freq_hz: f64,
        extrapolation: Extrapolation,
    ) -> Result<Permittivity, DielectricError> {
        if !(freq_hz.is_finite() && freq_hz > 0.0) {
            return Err(DielectricError::Refused(format!("frequency is {freq_hz} Hz; it must be a finite number above 0 Hz")));
        }
        self.check_state(state)?;
        let model = match model {
            Some(model) => {
                self.check_model(model)?;
                model
            }
            None => self.default_model(freq_hz)?,
        };
        let extended = match model.check_range(self, state, freq_hz) {
            Ok(()) => false,
            Err(DielectricError::OutOfBand { .. } | DielectricError::OutOfRange { .. }) if extrapolation == Extrapolation::Documented => {
                true
            }
            Err(error) => return Err(error),
        };
        let mut eps = model.permittivity(self, state, freq_hz)?;
        if eps.im > 0.0 && eps.im < 1e-9 * eps.norm() {
            eps.im = 0.0; // rounding error of a lossless material
        }
        if !(eps.re.is_finite() && eps.im.is_finite() && eps.im <= 0.0) {
            let fault = "for this state, which is not the permittivity of a lossy material";
            return Err(DielectricError::Refused(format!("model `{}` gives eps = {eps} {fault}", model.name)));
        }
        Ok(Permittivity { eps, model, extended })
    }
}

/// The first material of the table that has the named model. It is used if only a model is named.
///
/// # Errors
/// [`DielectricError::Unknown`].
pub fn material_of_model(name: &str) -> Result<&'static Material, DielectricError> {
    let model = Model::by_name(name)?;
    let materials = Material::all();
    let default = materials.iter().find(|m| m.defaults.iter().any(|d| d.0 == model.name));
    default
        .or_else(|| materials.iter().find(|m| m.others.contains(&model.name)))
        .ok_or_else(|| DielectricError::Table { table: "materials", message: format!("no material has the model `{name}`") })
}
