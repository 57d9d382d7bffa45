//! Stacks described in TOML by materials and thicknesses. They do not depend on frequency.

use super::error::SurfaceError;
use super::layer::Layer;
use super::stack::Stack;
use super::volume::{Described, Scatter, Scatterer, StreamOptions};
use crate::dielectrics::{DielectricError, Extrapolation, Material, MaterialState, Model, permittivity_of};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use toml::Spanned;

/// Temperature of a layer given as `eps` alone, K.
pub const DEFAULT_TEMPERATURE_K: f64 = 290.0;

/// Material of a layer.
#[derive(Debug, Clone)]
pub enum Substance {
    /// A material of the data base in some state, with a model (`None`: its default).
    Material {
        /// The material.
        material: &'static Material,
        /// Its state.
        state: MaterialState,
        /// The model.
        model: Option<&'static Model>,
    },
    /// A permittivity that does not depend on frequency.
    Fixed(Complex64),
}

/// One layer of a description.
#[derive(Debug, Clone)]
pub struct LayerDescription {
    /// Its material.
    pub substance: Substance,
    /// Thickness, m; infinite for the last layer.
    pub thickness_m: f64,
    /// Physical temperature, K.
    pub temperature_k: f64,
    /// Scattering inside it.
    pub scatter: Option<Scatter>,
    /// Volume fraction of air bubbles, in ice that scatters.
    pub porosity: f64,
    /// Its line in the file, such as ` (line 7)`. It is empty for a layer made in memory.
    pub place: String,
}

/// The description of a stack at any frequency.
#[derive(Debug, Clone)]
pub struct StackDescription {
    /// Whether reflections of different layers interfere.
    pub coherent: bool,
    /// Layers from the top.
    pub layers: Vec<LayerDescription>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStack {
    coherent: bool,
    #[serde(default)]
    layer: Vec<Spanned<RawLayer>>,
}

/// One layer as it is written in a file; which keys it may have depends on its substance.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLayer {
    /// Name of a material.
    pub material: Option<String>,
    /// Name of a permittivity model.
    pub model: Option<String>,
    /// Permittivity `[real, loss]` instead of a material.
    pub eps: Option<[f64; 2]>,
    /// Thickness, m; none for the last layer.
    pub thickness_m: Option<f64>,
    /// Physical temperature, K.
    pub temperature_k: Option<f64>,
    /// Salinity, psu.
    #[serde(alias = "salinity")]
    pub salinity_psu: Option<f64>,
    /// Volume fraction of water.
    pub moisture: Option<f64>,
    /// Dry density, kg/m3.
    #[serde(alias = "density")]
    pub density_kg_m3: Option<f64>,
    /// Soil texture by name.
    pub texture: Option<String>,
    /// Mass fraction of sand.
    pub sand: Option<f64>,
    /// Mass fraction of clay.
    pub clay: Option<f64>,
    /// Scattering inside the layer in its short form, such as `iba:0.1mm`; `cittert scene list surfaces` explains the kinds.
    pub scatter: Option<String>,
    /// Volume fraction of air bubbles in ice that scatters.
    pub porosity: Option<f64>,
}

impl StackDescription {
    /// A bare half-space of one material.
    #[must_use]
    pub fn of_material(material: &'static Material, state: MaterialState, model: Option<&'static Model>) -> Self {
        Self {
            coherent: true,
            layers: vec![LayerDescription {
                substance: Substance::Material { material, state, model },
                thickness_m: f64::INFINITY,
                temperature_k: state.temperature_k,
                scatter: None,
                porosity: 0.0,
                place: String::new(),
            }],
        }
    }

    /// Read a stack file.
    ///
    /// `coherent = true|false`, then one `[[layer]]` each from the top, with `material` and its
    /// parameters (`temperature_k`, `salinity_psu`, `moisture`, `density_kg_m3`, `texture`,
    /// `sand`, `clay`, `model`) or `eps = [real, loss]`; `thickness_m` on all but the last; `scatter` on
    /// layers that scatter, with `porosity` in ice with bubbles.
    /// If no temperature is given, it is the default of the material, or 290 K.
    ///
    /// # Errors
    /// [`SurfaceError::Refused`] with line and column, [`SurfaceError::Layer`] or
    /// [`SurfaceError::LayerMaterial`] with the line of the layer.
    pub fn from_toml(text: &str) -> Result<Self, SurfaceError> {
        let raw: RawStack = toml::from_str(text).map_err(|e| SurfaceError::Refused(format!("stack file: {}", e.to_string().trim_end())))?;
        Self::from_layers(text, raw.coherent, raw.layer)
    }

    /// A stack from layers that are part of another file. `text` is the text of that file, for line numbers.
    ///
    /// # Errors
    /// As [`StackDescription::from_toml`].
    pub fn from_layers(text: &str, coherent: bool, raw: Vec<Spanned<RawLayer>>) -> Result<Self, SurfaceError> {
        let count = raw.len();
        if count == 0 {
            return Err(SurfaceError::NoLayers);
        }
        let mut layers = Vec::with_capacity(count);
        for (i, spanned) in raw.into_iter().enumerate() {
            let place = place_of(text, &spanned.span());
            layers.push(read_layer(spanned.into_inner(), i + 1, i + 1 == count, place)?);
        }
        Ok(Self { coherent, layers })
    }

    /// The stack at one frequency.
    ///
    /// # Errors
    /// A layer whose permittivity cannot be found there, or as [`Stack::new`].
    pub fn resolve(&self, freq_hz: f64, extrapolation: Extrapolation) -> Result<Stack, SurfaceError> {
        let mut layers = Vec::with_capacity(self.layers.len());
        let mut scatterers = Vec::with_capacity(self.layers.len());
        for (i, layer) in self.layers.iter().enumerate() {
            let (eps, scatterer) = self.scatterer(i, freq_hz, extrapolation)?;
            scatterers.push(scatterer);
            layers.push(Layer { eps, thickness_m: layer.thickness_m, temperature_k: layer.temperature_k });
        }
        Stack::scattering(layers, &scatterers, self.coherent, freq_hz, StreamOptions::default()).map_err(|e| match e {
            SurfaceError::Layer { layer, message, .. } => {
                SurfaceError::Layer { layer, place: self.layers.get(layer - 1).map_or_else(String::new, |l| l.place.clone()), message }
            }
            other => other,
        })
    }

    /// Permittivity of a layer at one frequency, and what scatters in it. Layers are counted from 0.
    ///
    /// # Errors
    /// As [`StackDescription::resolve`].
    pub fn scatterer(
        &self,
        number: usize,
        freq_hz: f64,
        extrapolation: Extrapolation,
    ) -> Result<(Complex64, Option<Scatterer>), SurfaceError> {
        let layer = &self.layers[number];
        let (eps, material) = match &layer.substance {
            Substance::Fixed(eps) => (*eps, None),
            Substance::Material { material, state, model } => {
                let found = material.evaluate(*model, state, freq_hz, extrapolation).map_err(|source| match self.layers.len() {
                    1 if layer.place.is_empty() => source.into(),
                    _ => SurfaceError::LayerMaterial { layer: number + 1, place: layer.place.clone(), source },
                })?;
                (found.eps, Some((*material, state)))
            }
        };
        let Some(scatter) = &layer.scatter else { return Ok((eps, None)) };
        let described = Described { material, eps, porosity: layer.porosity, thickness_m: layer.thickness_m };
        let (eps, scatterer) = scatter.resolve(&described, freq_hz).map_err(|e| SurfaceError::Layer {
            layer: number + 1,
            place: layer.place.clone(),
            message: e.to_string(),
        })?;
        Ok((eps, Some(scatterer)))
    }
}

/// The line on which the keys of a layer begin.
fn place_of(text: &str, span: &Range<usize>) -> String {
    let start = span.start.min(text.len());
    let line = 1 + text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count();
    format!(" (line {line})")
}

/// Layer number `layer` of a stack.
fn read_layer(raw: RawLayer, layer: usize, last: bool, place: String) -> Result<LayerDescription, SurfaceError> {
    let fault = |m: &str| Err(SurfaceError::Layer { layer, place: place.clone(), message: m.to_owned() });
    let thickness_m = match raw.thickness_m {
        None if last => f64::INFINITY,
        None => return fault("thickness_m is missing; every layer but the last needs it"),
        Some(_) if last => {
            return fault("it is the last and has thickness_m; the last layer is a half-space, leave it out or add a layer below");
        }
        Some(d) if d.is_finite() && d >= 0.0 => d,
        Some(d) => {
            return fault(&format!("thickness_m is {d}; it must be a finite number, 0 or more"));
        }
    };
    let parameters = [
        ("temperature_k", raw.temperature_k),
        ("salinity_psu", raw.salinity_psu),
        ("moisture", raw.moisture),
        ("density_kg_m3", raw.density_kg_m3),
        ("sand", raw.sand),
        ("clay", raw.clay),
    ];
    let (substance, temperature_k) = match (&raw.material, raw.eps) {
        (Some(_), Some(_)) => return fault("it has both material and eps; give one of them"),
        (None, None) => return fault("it needs material = \"...\" or eps = [real, loss]"),
        (None, Some([real, loss])) => {
            if raw.model.is_some() || raw.texture.is_some() || parameters[1..].iter().any(|(_, v)| v.is_some()) {
                return fault("with eps only thickness_m and temperature_k may be given");
            }
            if !(real.is_finite() && loss.is_finite() && loss >= 0.0) {
                return fault(&format!("eps is [{real}, {loss}]; both must be finite and the loss 0 or more"));
            }
            let t = raw.temperature_k.unwrap_or(DEFAULT_TEMPERATURE_K);
            (Substance::Fixed(permittivity_of(real, loss)), t)
        }
        (Some(name), None) => {
            let dressed = || -> Result<_, DielectricError> {
                let material = Material::by_name(name)?;
                let model = raw.model.as_deref().map(|m| material.model(m)).transpose()?;
                let mut state = material.state();
                if let Some(texture) = &raw.texture {
                    material.set_texture(&mut state, texture)?;
                }
                for (key, value) in parameters.iter().filter_map(|(key, value)| Some((key, (*value)?))) {
                    material.set(&mut state, key, value)?;
                }
                material.check_state(&state)?;
                Ok((Substance::Material { material, state, model }, state.temperature_k))
            };
            dressed().map_err(|source| SurfaceError::LayerMaterial { layer, place: place.clone(), source })?
        }
    };
    if !(temperature_k.is_finite() && temperature_k > 0.0) {
        return fault(&format!("temperature_k is {temperature_k}; it must be a finite number above 0"));
    }
    let scatter = raw.scatter.as_deref().map(str::parse).transpose().map_err(|e: SurfaceError| SurfaceError::Layer {
        layer,
        place: place.clone(),
        message: e.to_string(),
    })?;
    let porosity = match raw.porosity {
        None => 0.0,
        Some(_) if scatter.is_none() => return fault("porosity is the air in ice that scatters; give scatter too, or leave it out"),
        Some(p) if (0.0..=0.5).contains(&p) => p,
        Some(p) => return fault(&format!("porosity is {p}; it must lie in 0 to 0.5")),
    };
    Ok(LayerDescription { substance, thickness_m, temperature_k, scatter, porosity, place })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error;

    const FILE: &str = r#"
coherent = true

[[layer]]
material = "paint"
thickness_m = 2e-4
temperature_k = 300

[[layer]]
material = "soil"
texture = "silty-clay"
moisture = 0.2
thickness_m = 0.01

[[layer]]
eps = [5.0, 0.3]
"#;

    #[test]
    fn reads_materials_parameters_and_defaults() {
        let d = StackDescription::from_toml(FILE).unwrap();
        assert!(d.coherent);
        assert_eq!(d.layers.len(), 3);
        assert_eq!(d.layers[0].temperature_k, 300.0);
        let Substance::Material { state, .. } = &d.layers[1].substance else { panic!("layer 2 is a material") };
        assert_eq!((state.moisture, state.clay), (0.2, 0.474));
        let stack = d.resolve(10e9, Extrapolation::Refuse).unwrap();
        assert_eq!(stack.layers()[2].eps, Complex64::new(5.0, -0.3));
        assert_eq!(stack.layers()[2].temperature_k, DEFAULT_TEMPERATURE_K);
    }

    fn message(text: &str) -> String {
        let error = StackDescription::from_toml(text).and_then(|d| d.resolve(10e9, Extrapolation::Refuse)).unwrap_err();
        match error.source() {
            Some(source) => format!("{error}: {source}"),
            None => error.to_string(),
        }
    }

    #[test]
    fn every_fault_names_its_place() {
        let change = |from: &str, to: &str| message(&FILE.replace(from, to));
        let unknown = change("moisture = 0.2", "moistness = 0.2");
        assert!(unknown.contains("line 12") && unknown.contains("moistness"), "{unknown}");
        let negative = change("2e-4", "-2e-4");
        assert!(negative.contains("layer 1 (line 4)") && negative.contains("-0.0002"), "{negative}");
        let nan = change("2e-4", "nan");
        assert!(nan.contains("NaN"), "{nan}");
        let missing = change("thickness_m = 0.01", "");
        assert!(missing.contains("layer 2 (line 9)") && missing.contains("missing"), "{missing}");
        let last = change("eps = [5.0, 0.3]", "eps = [5.0, 0.3]\nthickness_m = 1.0");
        assert!(last.contains("half-space"), "{last}");
        let material = change("\"paint\"", "\"pain\"");
        assert!(material.contains("unknown material `pain`"), "{material}");
        let both = change("material = \"paint\"", "material = \"paint\"\neps = [1, 0]");
        assert!(both.contains("both"), "{both}");
        let gain = change("[5.0, 0.3]", "[5.0, -0.3]");
        assert!(gain.contains("loss 0 or more"), "{gain}");
        let wet = change("moisture = 0.2", "moisture = 0.7");
        assert!(wet.contains("porosity"), "{wet}");
        let cold = change("temperature_k = 300", "temperature_k = 0");
        assert!(cold.contains("0 K"), "{cold}");
        let foreign = change("texture", "salinity = 3\ntexture");
        assert!(foreign.contains("no parameter `salinity_psu`"), "{foreign}");
        let coherent = change("coherent = true", "");
        assert!(coherent.contains("coherent"), "{coherent}");
        assert!(message("coherent = true").contains("no [[layer]]"));
        assert!(message("coherent = maybe").contains("line 1"));
    }
}
