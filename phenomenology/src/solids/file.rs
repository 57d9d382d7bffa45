//! The TOML of a scene of solids, key by key.

use crate::camera::Camera;
use crate::surfaces::RawLayer;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Spanned;

/// A scene file.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Always `solids`.
    pub kind: String,
    /// Name of the scene.
    pub name: String,
    /// Content of the scene, and the sources of its dimensions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Frequency for which the scene is described, Hz. It is used where a command is not given another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub freq_hz: Option<f64>,
    /// Whether dielectric models may be used beyond their range, by their documented extension.
    #[serde(default)]
    pub extrapolate: bool,
    /// The camera.
    #[schemars(with = "Option<Camera>")]
    pub camera: Option<Spanned<Camera>>,
    /// The air.
    #[schemars(with = "Option<AtmosphereRow>")]
    pub atmosphere: Option<Spanned<AtmosphereRow>>,
    /// The ground.
    #[schemars(with = "Option<GroundRow>")]
    pub ground: Option<Spanned<GroundRow>>,
    /// Surfaces by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(with = "BTreeMap<String, SurfaceRow>")]
    pub surface: BTreeMap<String, Spanned<SurfaceRow>>,
    /// Bodies and regions as MORSE/GIFT-style text.
    #[schemars(with = "Option<String>")]
    pub bodies_and_regions: Option<Spanned<String>>,
    /// Bodies at their given positions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<BodyRow>")]
    pub body: Vec<Spanned<BodyRow>>,
    /// Regions made of these bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<RegionRow>")]
    pub region: Vec<Spanned<RegionRow>>,
    /// Assemblies by name, to be placed by instances.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(with = "BTreeMap<String, AssemblyRow>")]
    pub assembly: BTreeMap<String, Spanned<AssemblyRow>>,
    /// Assemblies placed in the scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<InstanceRow>")]
    pub instance: Vec<Spanned<InstanceRow>>,
    /// Clouds, fog banks, rain shafts and haze layers, made of bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<WeatherRow>")]
    pub weather: Vec<Spanned<WeatherRow>>,
}

/// `[atmosphere]`: the air, by default clear mid-latitude summer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AtmosphereRow {
    /// Name of a reference atmosphere.
    pub profile: String,
    /// Name of a gas model.
    pub gas: String,
    /// Name of a rain model.
    pub rain: String,
    /// Layers such as `fog:0m-200m:0.2g/m3`.
    pub layers: Vec<String>,
    /// Height of the origin of the scene above the lowest level of the profile, m.
    pub altitude_m: f64,
    /// Shape of the path of rays to the sky: `plane` or `spherical`.
    pub geometry: String,
    /// Temperature of the background behind the atmosphere, K.
    pub background_k: f64,
    /// Temperature of the air at the lowest level of the profile, K.
    pub surface_temperature_k: Option<f64>,
    /// Pressure at the lowest level of the profile, hPa.
    pub surface_pressure_hpa: Option<f64>,
    /// Relative humidity at the lowest level of the profile, percent.
    pub relative_humidity_percent: Option<f64>,
    /// One temperature for the whole air and the background, K, for tests of the isothermal world.
    pub isothermal_k: Option<f64>,
    /// Whether there is no air, so that rays see the background.
    pub vacuum: bool,
}

impl Default for AtmosphereRow {
    fn default() -> Self {
        Self {
            profile: "mls".into(),
            gas: "mpm89".into(),
            rain: "p838".into(),
            layers: Vec::new(),
            altitude_m: 0.0,
            geometry: "plane".into(),
            background_k: crate::atmosphere::planck::COSMIC_BACKGROUND_K,
            surface_temperature_k: None,
            surface_pressure_hpa: None,
            relative_humidity_percent: None,
            isothermal_k: None,
            vacuum: false,
        }
    }
}

/// `[surface.NAME]`: layers from the top, roughness, canopy.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceRow {
    /// Whether reflections of different layers interfere.
    #[serde(default = "yes")]
    pub coherent: bool,
    /// Layers from the top; the last has no thickness.
    #[serde(default)]
    #[schemars(with = "Vec<RawLayer>")]
    pub layer: Vec<Spanned<RawLayer>>,
    /// Roughness in its short form, such as `go:0.1,0.1`, `sea:7` or `qh:0.1,0.5,2`.
    pub roughness: Option<String>,
    /// Azimuth of the first slope axis, degrees from north over east.
    #[serde(default)]
    pub slope_azimuth_deg: f64,
    /// Vegetation on it.
    pub canopy: Option<CanopyRow>,
}

fn yes() -> bool {
    true
}

/// Vegetation of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanopyRow {
    /// Optical depth at nadir, Np.
    pub tau_np: f64,
    /// Single-scattering albedo.
    #[serde(default)]
    pub omega: f64,
    /// Temperature, K.
    pub temperature_k: f64,
}

/// `[ground]`: a plane or a height field with patches.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundRow {
    /// Surface outside all patches.
    pub surface: String,
    /// Height of the plane, m.
    #[serde(default)]
    pub height_m: f64,
    /// Temperature instead of that of the surface, K.
    pub temperature_k: Option<f64>,
    /// Patches, later ones on top.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<PatchRow>")]
    pub patch: Vec<Spanned<PatchRow>>,
    /// Surfaces by a map of characters, under the patches.
    #[schemars(with = "Option<MapRow>")]
    pub map: Option<Spanned<MapRow>>,
    /// Heights instead of the plane, inside its area.
    #[schemars(with = "Option<HeightFieldRow>")]
    pub height_field: Option<Spanned<HeightFieldRow>>,
}

/// A patch of ground: one of polygon, strip and circle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchRow {
    /// Its surface.
    pub surface: String,
    /// Temperature instead of that of the surface, K.
    pub temperature_k: Option<f64>,
    /// Corners, m.
    pub polygon_m: Option<Vec<[f64; 2]>>,
    /// Centre line of a strip, m; every piece becomes a rectangle.
    pub strip_m: Option<Vec<[f64; 2]>>,
    /// Width of the strip, m.
    pub width_m: Option<f64>,
    /// Centre and radius, m.
    pub circle_m: Option<[f64; 3]>,
}

/// An image map: one character a cell, or one pixel of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapRow {
    /// South-west corner, m.
    pub origin_m: [f64; 2],
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Rows from north to south, one character a cell; blanks and dots keep the surface of the ground.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<String>,
    /// Surface of each character.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub legend: BTreeMap<String, String>,
    /// Instead of rows: a grey PNG beside the scene, one pixel a cell, north on top.
    pub image: Option<String>,
    /// Surface of each grey value, 0 (black) to 255; values without a surface keep that of the ground.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub grey: BTreeMap<String, String>,
}

/// Heights on a grid of nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeightFieldRow {
    /// South-west node, m.
    pub origin_m: [f64; 2],
    /// Distance between nodes, m.
    pub cell_m: f64,
    /// Heights above the zero of the scene, m, rows from north to south.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rows_m: Vec<Vec<f64>>,
    /// Instead of rows: a grey PNG of 8 or 16 bits beside the scene, one pixel a node, north on top.
    pub image: Option<String>,
    /// Height of black pixels, m.
    #[serde(default)]
    pub low_m: f64,
    /// Height of white pixels, m.
    #[serde(default)]
    pub high_m: f64,
}

/// A body; with a surface it is also a region of the same name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyRow {
    /// Name, unique in its assembly.
    pub name: String,
    /// Code such as `RPP`.
    #[serde(rename = "type")]
    pub code: String,
    /// Parameters in MORSE/GIFT order, m.
    pub data: Vec<f64>,
    /// Surface. With it the body alone is a region.
    pub surface: Option<String>,
    /// Temperature instead of that of the surface, K.
    pub temperature_k: Option<f64>,
}

/// A region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionRow {
    /// Name, unique in its assembly.
    pub name: String,
    /// Expression such as `+1 -7 OR +6`.
    pub is: String,
    /// Surface; `air` makes it empty.
    pub surface: Option<String>,
    /// Temperature instead of that of the surface, K.
    pub temperature_k: Option<f64>,
    /// Faces with another surface or temperature.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub face: Vec<FaceRow>,
}

/// A face of a body that bounds a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceRow {
    /// The body.
    pub body: String,
    /// Number of the face, from 1; all faces without it.
    pub face: Option<u8>,
    /// Its surface.
    pub surface: Option<String>,
    /// Its temperature, K.
    pub temperature_k: Option<f64>,
}

/// `[[weather]]`: a volume of water that rays pass through, such as a cloud, a fog bank or a rain shaft.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeatherRow {
    /// Name, unique in its assembly.
    pub name: String,
    /// Expression of bodies such as `+1 -7 OR +6`. Volumes of weather may overlap; their absorption adds up.
    pub is: String,
    /// Liquid water of cloud or fog droplets, g/m3.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub liquid_g_m3: f64,
    /// Ice crystals, g/m3.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub ice_g_m3: f64,
    /// Rain rate, mm/h.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rain_mm_h: f64,
    /// Liquid water of haze droplets, g/m3. It adds to `liquid_g_m3`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub haze_g_m3: f64,
    /// Temperature, K; by default that of the air at each height.
    pub temperature_k: Option<f64>,
}

fn is_zero(amount: &f64) -> bool {
    *amount == 0.0
}

/// `[assembly.NAME]`: bodies and regions that instances place.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AssemblyRow {
    /// Description of the assembly.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Its bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<BodyRow>")]
    pub body: Vec<Spanned<BodyRow>>,
    /// Its regions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<RegionRow>")]
    pub region: Vec<Spanned<RegionRow>>,
    /// Other assemblies placed in it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<InstanceRow>")]
    pub instance: Vec<Spanned<InstanceRow>>,
    /// Weather made of its bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<WeatherRow>")]
    pub weather: Vec<Spanned<WeatherRow>>,
}

/// An assembly placed in the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstanceRow {
    /// Name of the assembly.
    pub assembly: String,
    /// Name of the instance; by default that of the assembly and a number.
    pub name: Option<String>,
    /// Position of the origin of the assembly, m.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Rotations about x, then y, then z, degrees, right-handed.
    #[serde(default)]
    pub rotate_deg: [f64; 3],
    /// Scale.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}
