//! The table of materials.

use super::error::{DielectricError, unknown};
use super::material::Material;
use super::soil_water::SOIL_PARTICLE_DENSITY_KG_M3;
use super::spec::{Constants, ParameterSpec, Pores};
use super::state::Parameter;
use crate::constants::ICE_DENSITY_KG_M3;

const fn spec(parameter: Parameter, default: f64, min: f64, max: f64) -> ParameterSpec {
    ParameterSpec { parameter, default, min, max }
}

const fn temperature(default: f64) -> ParameterSpec {
    spec(Parameter::Temperature, default, 1.0, 2000.0)
}

const fn salinity(default: f64) -> ParameterSpec {
    spec(Parameter::Salinity, default, 0.0, 300.0)
}

/// Limit of a default model that is preferred at every frequency.
const ALWAYS: f64 = f64::INFINITY;
/// Parameters of a material that has only a temperature.
const TEMPERATURE_ONLY: &[ParameterSpec] = &[temperature(290.0)];
/// Parameters of a building material that can take up water.
const POROUS: &[ParameterSpec] = &[temperature(290.0), spec(Parameter::Moisture, 0.0, 0.0, 0.5)];

/// A building material of P.2040.
const fn building(name: &'static str, aliases: &'static [&'static str], describes: &'static str, key: &'static str) -> Material {
    Material {
        name,
        aliases,
        describes,
        defaults: &[("p2040", ALWAYS)],
        others: &[],
        parameters: POROUS,
        constants: Constants::P2040(key),
        pores: Pores::None,
    }
}

/// A ground of P.2040. The rows of the Recommendation already contain its water.
const fn ground(name: &'static str, describes: &'static str, key: &'static str) -> Material {
    Material { parameters: TEMPERATURE_ONLY, ..building(name, &[], describes, key) }
}

const fn conductor(name: &'static str, aliases: &'static [&'static str], describes: &'static str, sigma_s_m: f64) -> Material {
    Material {
        name,
        aliases,
        describes,
        defaults: &[("conductor", ALWAYS)],
        others: &[],
        parameters: TEMPERATURE_ONLY,
        constants: Constants::Conductivity(sigma_s_m),
        pores: Pores::None,
    }
}

const fn plain(
    name: &'static str,
    aliases: &'static [&'static str],
    describes: &'static str,
    models: (&'static [(&'static str, f64)], &'static [&'static str]),
    parameters: &'static [ParameterSpec],
) -> Material {
    Material { name, aliases, describes, defaults: models.0, others: models.1, parameters, constants: Constants::None, pores: Pores::None }
}

/// Snow: water fills the pores between grains of ice.
const SNOW: Pores = Pores::Grains(ICE_DENSITY_KG_M3);

/// Every material.
pub(super) const MATERIALS: &[Material] = &[
    plain("fresh-water", &["water"], "fresh water", (&[("liebe91", ALWAYS)], &["turner16"]), &[temperature(288.15)]),
    plain(
        "sea-water",
        &["sea", "seawater"],
        "sea water",
        (&[("stogryn95", ALWAYS)], &["klein-swift77", "meissner-wentz04"]),
        &[temperature(288.15), salinity(35.0)],
    ),
    plain("fresh-ice", &["ice"], "pure ice", (&[("maetzler06", ALWAYS)], &["hufford91"]), &[temperature(263.15)]),
    plain("brine", &[], "brine in equilibrium with ice", (&[("stogryn-desargant85", ALWAYS)], &[]), &[temperature(263.15)]),
    plain(
        "sea-ice",
        &[],
        "sea ice: brine pockets in ice, bulk salinity",
        (&[("sea-ice-spheres", ALWAYS)], &["sea-ice-maxwell-garnett", "sea-ice-needles", "stogryn-desargant85"]),
        &[temperature(263.15), salinity(5.0)],
    ),
    Material {
        pores: SNOW,
        ..plain(
            "dry-snow",
            &["snow"],
            "dry snow by density",
            (&[("maetzler96", ALWAYS)], &[]),
            &[temperature(263.15), spec(Parameter::Density, 250.0, 0.0, ICE_DENSITY_KG_M3)],
        )
    },
    Material {
        pores: SNOW,
        ..plain(
            "wet-snow",
            &[],
            "wet snow by dry density and water volume fraction; Polder-van Santen above 37 GHz",
            (&[("hallikainen86", 37.0), ("polder-van-santen46", ALWAYS)], &[]),
            &[temperature(273.15), spec(Parameter::Density, 250.0, 0.0, ICE_DENSITY_KG_M3), spec(Parameter::Moisture, 0.03, 0.0, 1.0)],
        )
    },
    Material {
        pores: Pores::Grains(SOIL_PARTICLE_DENSITY_KG_M3),
        ..plain(
            "soil",
            &["earth"],
            "moist soil by texture (default loam), dry density and water volume fraction",
            (
                // Above 37 GHz a single relaxation does not describe water.
                &[("dobson85", 18.0), ("ulaby86", 37.0), ("ulaby86-liebe91", ALWAYS)],
                &["mironov09"],
            ),
            &[
                temperature(293.15),
                spec(Parameter::Moisture, 0.15, 0.0, 1.0),
                spec(Parameter::Density, 1300.0, 100.0, SOIL_PARTICLE_DENSITY_KG_M3),
                spec(Parameter::Sand, 0.42, 0.0, 1.0),
                spec(Parameter::Clay, 0.085, 0.0, 1.0),
            ],
        )
    },
    Material {
        constants: Constants::Fixed(5.0, 0.5),
        ..plain("frozen-soil", &["frozen-ground"], "frozen soil", (&[("frozen-soil-constant", ALWAYS)], &[]), &[temperature(263.15)])
    },
    building("concrete", &[], "concrete", "concrete"),
    building("brick", &[], "brick", "brick"),
    building("asphalt", &["asphalt-concrete"], "asphalt, to 40 GHz", "asphalt_concrete"),
    building("wood", &[], "dry wood, across the grain", "wood"),
    building("plywood", &[], "plywood", "plywood"),
    building("chipboard", &[], "chipboard", "chipboard"),
    building("marble", &[], "marble", "marble"),
    building("plasterboard", &["gypsum-board"], "plasterboard", "plasterboard"),
    building("ceiling-board", &[], "ceiling board", "ceiling_board"),
    building("floorboard", &[], "floorboard", "floorboard"),
    Material { parameters: TEMPERATURE_ONLY, ..building("glass", &[], "window glass", "glass") },
    ground("very-dry-ground", "very dry ground, to 10 GHz", "very_dry_ground"),
    ground("medium-dry-ground", "medium dry ground, to 10 GHz", "medium_dry_ground"),
    ground("wet-ground", "wet ground, to 10 GHz", "wet_ground"),
    plain(
        "vegetation",
        &["leaf", "leaves"],
        "leaves by gravimetric moisture",
        (&[("ulaby-el-rayes87", ALWAYS)], &[]),
        &[temperature(293.15), spec(Parameter::Moisture, 0.6, 0.0, 1.0)],
    ),
    Material { parameters: TEMPERATURE_ONLY, ..building("metal", &[], "metal of P.2040", "metal") },
    conductor("steel", &["iron"], "steel, 1e7 S/m", 1.0e7),
    conductor("aluminium", &["aluminum"], "aluminium, 3.8e7 S/m", 3.8e7),
    conductor("copper", &[], "copper, 5.8e7 S/m", 5.8e7),
    Material {
        constants: Constants::Fixed(3.0, 0.05),
        ..plain("paint", &[], "dried paint film", (&[("paint-constant", ALWAYS)], &[]), &[temperature(290.0)])
    },
];

impl Material {
    /// The material of this name or alias; `_` and `-` are the same.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`] with the known names.
    pub fn by_name(name: &str) -> Result<&'static Self, DielectricError> {
        let wanted = name.trim().to_ascii_lowercase().replace('_', "-");
        MATERIALS
            .iter()
            .find(|m| m.name == wanted || m.aliases.contains(&wanted.as_str()))
            .ok_or_else(|| unknown("material", name, MATERIALS.iter().map(|m| m.name)))
    }

    /// Every material, in table order.
    #[must_use]
    pub fn all() -> &'static [Self] {
        MATERIALS
    }
}
