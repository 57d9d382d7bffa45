//! How a layer scatters, as a file says it in short form, and what that means at one frequency.

use super::iba::{Mixture, dense_medium_tsang01, improved_born_maetzler98};
use super::microstructure::Microstructure;
use super::scatterer::{Phase, Scatterer};
use crate::constants::{ICE_DENSITY_KG_M3, SPEED_OF_LIGHT_M_S};
use crate::dielectrics::mixing::{NEEDLE, SPHERE, polder_van_santen46};
use crate::dielectrics::{
    Material, MaterialState, brine_permittivity_stogryn_desargant85, brine_volume_cox_weeks83, grain_factors_maetzler96,
    ice_permittivity_maetzler06,
};
use crate::surfaces::error::{SurfaceError, bounded};
use crate::surfaces::fresnel::AIR;
use crate::surfaces::roughness::length_m;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::str::FromStr;

/// Scattering inside a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scatter {
    /// Grains, brine pockets or air bubbles by the improved Born approximation.
    Grains {
        /// Their arrangement and size.
        grains: Microstructure,
        /// Their shape, which the permittivity depends on.
        shape: GrainShape,
    },
    /// Small spheres that stick, by the quasi-crystalline approximation.
    DenseMedium {
        /// Radius, m.
        radius_m: f64,
        /// Stickiness.
        stickiness: f64,
    },
    /// A layer of air with isotropic scatterers, given as a whole.
    Isotropic {
        /// Optical depth of the layer at nadir, Np.
        tau_np: f64,
        /// Single-scattering albedo.
        omega: f64,
    },
    /// Leaves in air, of the material of the layer.
    Leaves {
        /// Leaf area (one side) over the area of the ground.
        area_index: f64,
        /// Thickness of a leaf, m.
        thickness_m: f64,
    },
}

/// Shape of grains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GrainShape {
    /// Spheres.
    #[default]
    Spheres,
    /// Needles of all orientations.
    Needles,
    /// The grains of snow by density (Maetzler 1996).
    Maetzler96,
}

/// A kind of scattering, as listings show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScatterKind {
    /// Word before the colon.
    pub name: &'static str,
    /// How it is written.
    pub syntax: &'static str,
    /// What it is.
    pub describes: &'static str,
}

/// Every kind of scattering.
pub const SCATTER_KINDS: &[ScatterKind] = &[
    ScatterKind {
        name: "iba",
        syntax: "iba:0.1mm[,spheres|needles|maetzler96]",
        describes: "layer of snow or ice: improved Born approximation (Maetzler 1998), by the correlation length of the grains",
    },
    ScatterKind {
        name: "iba-spheres",
        syntax: "iba-spheres:0.2mm[,STICKINESS]",
        describes: "layer of snow or ice: the same for spheres by radius, which stick to each other if a stickiness is given",
    },
    ScatterKind {
        name: "dmrt",
        syntax: "dmrt:0.2mm,STICKINESS",
        describes: "layer of snow or ice: quasi-crystalline approximation (Tsang & Kong 2001) for small spheres by radius",
    },
    ScatterKind {
        name: "isotropic",
        syntax: "isotropic:TAU,OMEGA",
        describes: "layer of eps = [1, 0]: isotropic scatterers by the optical depth of the layer at nadir and the albedo",
    },
    ScatterKind {
        name: "leaves",
        syntax: "leaves:LAI,0.2mm",
        describes: "layer of leaves: leaf area index of the layer and thickness of a leaf",
    },
];

/// Materials that grains can be in.
const GRANULAR: &str = "dry-snow, fresh-ice and sea-ice";

impl FromStr for Scatter {
    type Err = SurfaceError;

    fn from_str(text: &str) -> Result<Self, SurfaceError> {
        let fault = |message: String| SurfaceError::Refused(format!("scatter `{text}`: {message}"));
        let (kind, rest) = text.trim().split_once(':').unwrap_or((text.trim(), ""));
        let words: Vec<&str> = rest.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        let number = |i: usize, what: &str| -> Result<f64, SurfaceError> {
            let word = words.get(i).ok_or_else(|| fault(format!("{what} is missing")))?;
            word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| fault(format!("{what} is `{word}`, not a finite number")))
        };
        let length = |i: usize, what: &str| -> Result<f64, SurfaceError> {
            let word = words.get(i).ok_or_else(|| fault(format!("{what} is missing, such as 0.1mm")))?;
            let metres = length_m(word).ok_or_else(|| fault(format!("`{word}` is not a length such as 0.1mm or 200um")))?;
            bounded("length in m", metres, 1e-7, 0.1).map_err(|e| fault(format!("{what}: {e}")))
        };
        let within = |what: &'static str, value: f64, min: f64, max: f64| bounded(what, value, min, max).map_err(|e| fault(e.to_string()));
        let at_most = |count: usize| {
            if words.len() > count { Err(fault(format!("`{}` is one value too many", words[count]))) } else { Ok(()) }
        };
        match kind {
            "iba" => {
                at_most(2)?;
                let shape = match words.get(1).copied() {
                    None | Some("spheres") => GrainShape::Spheres,
                    Some("needles") => GrainShape::Needles,
                    Some("maetzler96") => GrainShape::Maetzler96,
                    Some(other) => return Err(fault(format!("`{other}` is none of spheres, needles, maetzler96"))),
                };
                Ok(Self::Grains { grains: Microstructure::Exponential { length_m: length(0, "the correlation length")? }, shape })
            }
            "iba-spheres" => {
                at_most(2)?;
                let stickiness = if words.len() > 1 { within("stickiness", number(1, "stickiness")?, 1e-3, 1e9)? } else { f64::INFINITY };
                let grains = Microstructure::StickySpheres { radius_m: length(0, "the radius")?, stickiness };
                Ok(Self::Grains { grains, shape: GrainShape::Spheres })
            }
            "dmrt" => {
                at_most(2)?;
                let stickiness = within("stickiness", number(1, "stickiness")?, 1e-3, 1e9)?;
                Ok(Self::DenseMedium { radius_m: length(0, "the radius")?, stickiness })
            }
            "isotropic" => {
                at_most(2)?;
                let tau_np = within("optical depth", number(0, "the optical depth")?, 0.0, 1e3)?;
                Ok(Self::Isotropic { tau_np, omega: within("albedo", number(1, "the albedo")?, 0.0, 1.0)? })
            }
            "leaves" => {
                at_most(2)?;
                let area_index = within("leaf area index", number(0, "the leaf area index")?, 0.0, 100.0)?;
                Ok(Self::Leaves { area_index, thickness_m: length(1, "the thickness of a leaf")? })
            }
            other => {
                let known: Vec<&str> = SCATTER_KINDS.iter().map(|k| k.syntax).collect();
                Err(fault(format!("`{other}` is no kind of scattering; known: {}", known.join(", "))))
            }
        }
    }
}

/// A layer that scatters, as its description says.
#[derive(Debug, Clone, Copy)]
pub(in crate::surfaces) struct Described<'a> {
    /// Its material and state; none where it is given as a permittivity.
    pub material: Option<(&'static Material, &'a MaterialState)>,
    /// Permittivity without scattering.
    pub eps: Complex64,
    /// Volume fraction of air bubbles in ice.
    pub porosity: f64,
    /// Thickness, m.
    pub thickness_m: f64,
}

impl Scatter {
    /// Effective permittivity, absorption and scattering of a layer at a frequency in Hz.
    ///
    /// # Errors
    /// A kind of scattering that does not fit the material; grains that do not fit the model.
    pub(in crate::surfaces) fn resolve(&self, layer: &Described<'_>, freq_hz: f64) -> Result<(Complex64, Scatterer), SurfaceError> {
        let thin = |what: &str| SurfaceError::Refused(format!("{what} needs a layer with thickness_m above 0"));
        let k0 = TAU * freq_hz / SPEED_OF_LIGHT_M_S;
        let filled = layer.thickness_m.is_finite() && layer.thickness_m > 0.0;
        match *self {
            Self::Grains { grains, shape } => improved_born_maetzler98(&mixture(layer, freq_hz, shape)?, grains, freq_hz),
            Self::DenseMedium { radius_m, stickiness } => {
                dense_medium_tsang01(&mixture(layer, freq_hz, GrainShape::Spheres)?, radius_m, stickiness, freq_hz)
            }
            Self::Isotropic { tau_np, omega } => {
                if layer.material.is_some() || layer.eps != AIR {
                    return Err(SurfaceError::Refused(
                        "scatter isotropic needs a layer of eps = [1, 0], the air between the scatterers".into(),
                    ));
                }
                if !filled {
                    return Err(thin("scatter isotropic"));
                }
                let extinction = tau_np / layer.thickness_m;
                let phase = Phase::Isotropic { scattering_per_m: omega * extinction };
                Ok((AIR, Scatterer { absorption_per_m: (1.0 - omega) * extinction, phase }))
            }
            Self::Leaves { area_index, thickness_m } => {
                if !filled {
                    return Err(thin("scatter leaves"));
                }
                Ok((AIR, Scatterer::leaves(area_index / layer.thickness_m, layer.eps, thickness_m, k0)))
            }
        }
    }
}

/// What lies in what, in a layer of snow or ice.
fn mixture(layer: &Described<'_>, freq_hz: f64, shape: GrainShape) -> Result<Mixture, SurfaceError> {
    let refused = |message: String| Err(SurfaceError::Refused(message));
    let Some((material, state)) = layer.material else {
        return refused(format!("a layer given by eps has no grains; they can be in {GRANULAR}"));
    };
    let (f, t) = (freq_hz * 1e-9, state.temperature_k);
    let ice = ice_permittivity_maetzler06(f, t);
    let factors = |fraction: f64| match shape {
        GrainShape::Spheres => SPHERE,
        GrainShape::Needles => NEEDLE,
        GrainShape::Maetzler96 => grain_factors_maetzler96(fraction),
    };
    let brine = || (brine_permittivity_stogryn_desargant85(f, t), brine_volume_cox_weeks83(t, state.salinity_psu));
    let snow = state.density_kg_m3 / ICE_DENSITY_KG_M3;
    let bubbles = layer.porosity;
    if shape == GrainShape::Maetzler96 && material.name != "dry-snow" {
        return refused(format!("the shape maetzler96 is that of dry-snow, not of {}", material.name));
    }
    if bubbles > 0.0 && material.name == "dry-snow" {
        return refused("dry-snow takes its density_kg_m3, not porosity".to_owned());
    }
    Ok(match material.name {
        "dry-snow" if snow <= 0.5 => Mixture { host: AIR, inclusion: ice, fraction: snow, factors: factors(snow) },
        // More ice than air: the air is what lies in the other.
        "dry-snow" => Mixture { host: ice, inclusion: AIR, fraction: 1.0 - snow, factors: SPHERE },
        "fresh-ice" if bubbles > 0.0 => Mixture { host: ice, inclusion: AIR, fraction: bubbles, factors: factors(bubbles) },
        "fresh-ice" => return refused("ice scatters by its air bubbles; give their volume fraction as porosity, above 0".to_owned()),
        "sea-ice" if bubbles > 0.0 => {
            let (brine, volume) = brine();
            let host = polder_van_santen46(ice, brine, volume, SPHERE)?;
            Mixture { host, inclusion: AIR, fraction: bubbles, factors: factors(bubbles) }
        }
        "sea-ice" => {
            let (inclusion, fraction) = brine();
            Mixture { host: ice, inclusion, fraction, factors: factors(fraction) }
        }
        other => return refused(format!("the grains of `{other}` have no model of scattering; known are those of {GRANULAR}")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_read_from_its_syntax() {
        for (kind, text) in SCATTER_KINDS.iter().zip([
            "iba:0.1mm,needles",
            "iba-spheres:200um,0.2",
            "dmrt:0.2mm,0.3",
            "isotropic:0.5,0.1",
            "leaves:3,0.2mm",
        ]) {
            assert!(text.starts_with(kind.name) && kind.syntax.starts_with(kind.name));
            assert!(text.parse::<Scatter>().is_ok(), "{text}");
        }
        assert_eq!(
            "iba:0.1mm".parse::<Scatter>().unwrap(),
            Scatter::Grains { grains: Microstructure::Exponential { length_m: 1e-4 }, shape: GrainShape::Spheres }
        );
    }

    #[test]
    fn faults_say_what_is_expected() {
        for (text, words) in [
            ("mie:1mm", "no kind of scattering"),
            ("iba", "correlation length is missing"),
            ("iba:0.1", "not a length"),
            ("iba:0.1mm,cubes", "spheres, needles, maetzler96"),
            ("iba:5m", "must lie in"),
            ("iba-spheres:0.1mm,0", "stickiness is 0"),
            ("dmrt:0.1mm", "stickiness is missing"),
            ("isotropic:1,2", "albedo is 2"),
            ("leaves:1,0.1mm,3", "one value too many"),
        ] {
            let message = text.parse::<Scatter>().unwrap_err().to_string();
            assert!(message.contains(words) && message.contains(text), "{message}");
        }
    }
}
