//! Scenes whose ground scatters inside.

use super::{RenderOptions, Scale, Tracer};
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::atmosphere::{Atmosphere, Geometry};
use crate::camera::{Camera, View};
use crate::dielectrics::Extrapolation;
use crate::solids::SolidScene;
use crate::surfaces::{Roughness, Sky, StackDescription, SurfaceModel};
use cittert_arrays::{Polarization, SpectralWindow};

const WINTER: &str = r#"
kind = "solids"
name = "winter"
camera = { position_m = [0, 0, 1e-5], size_px = [2, 2], fov_deg = 0.0001 }
[surface.snow]
coherent = false
layer = [
  { material = "dry-snow", thickness_m = 0.6, density_kg_m3 = 280, temperature_k = 258, scatter = "iba:0.12mm" },
  { material = "frozen-soil", temperature_k = 268 },
]
[surface.steel]
layer = [{ material = "steel", temperature_k = 260 }]
[ground]
surface = "snow"
[[body]]
name = "tank"
type = "RCC"
data = [0, -3, 0, 0, 0, 3, 1]
surface = "steel"
"#;

const SNOW: &str = r#"
coherent = false
[[layer]]
material = "dry-snow"
thickness_m = 0.6
density_kg_m3 = 280
temperature_k = 258
scatter = "iba:0.12mm"
[[layer]]
material = "frozen-soil"
temperature_k = 268
"#;

fn band() -> SpectralWindow {
    SpectralWindow::band(94e9, 1e9, 1).unwrap()
}

#[test]
fn snow_shows_its_emission_and_the_sky_weighted_by_its_reflection() {
    let scene = SolidScene::from_toml(WINTER).unwrap();
    let options =
        RenderOptions { polarizations: vec![Polarization::XX, Polarization::YY], scale: Scale::RayleighJeans, ..RenderOptions::default() };
    let tracer = Tracer::new(&scene, &[94e9], &options).unwrap();
    let air = Atmosphere::reference("mls", "mpm89").unwrap();
    let stack = StackDescription::from_toml(SNOW).unwrap().resolve(94e9, Extrapolation::Refuse).unwrap();
    let radiant = stack.with_temperatures(|t| rayleigh_jeans_temperature_k(94.0, black_body_radiance(94.0, t))).unwrap();
    let model = SurfaceModel::new(radiant, Roughness::Smooth);
    let sky = |zenith: f64| air.sky(&[94.0], &[zenith.to_degrees().min(89.9999)], Geometry::Plane).unwrap()[0].tb_rj_k;
    for zenith in [0.0, 40.0, 55.0, 75.0] {
        let camera = Camera { pitch_deg: zenith - 90.0, ..scene.camera().unwrap().clone() };
        let p = tracer.picture(&View::of_camera(&camera).unwrap(), &band(), None).unwrap();
        let by_hand = model.brightness_k(f64::to_radians(zenith), 0.0, Sky::Symmetric(&sky)).unwrap();
        for (plane, t) in by_hand.into_iter().enumerate() {
            let seen = p.temperature.data[[0, plane, 1, 1]];
            // The tables of the surface and of the sky have errors of 0.05 K.
            assert!((seen - t).abs() < 0.1, "{zenith} plane {plane}: {seen} {t}");
        }
    }
}

/// Under an open sky nothing but snow and sky is in view, so no part comes from other surfaces.
#[test]
fn level_snow_reflects_sky_and_nothing_else() {
    let scene = SolidScene::from_toml(&WINTER[..WINTER.find("[[body]]").unwrap()]).unwrap();
    let camera = Camera { pitch_deg: -40.0, ..scene.camera().unwrap().clone() };
    let options = RenderOptions { causes: true, scale: Scale::RayleighJeans, ..RenderOptions::default() };
    let tracer = Tracer::new(&scene, &[94e9], &options).unwrap();
    let causes = tracer.picture(&View::of_camera(&camera).unwrap(), &band(), None).unwrap().causes_k.unwrap();
    let [emission, surroundings, sky] = [0, 1, 2].map(|cause| causes[[cause, 1, 1]]);
    assert!(emission > 100.0 && surroundings == 0.0 && sky > 10.0, "{emission} {surroundings} {sky}");
}

#[test]
fn a_winter_of_one_temperature_shows_only_it() {
    let text = WINTER.replace("[0, 0, 1e-5], size_px = [2, 2], fov_deg = 0.0001", "[0, -8, 2], size_px = [24, 24], fov_deg = 60");
    let scene = SolidScene::from_toml(&text).unwrap().isothermal(263.0).unwrap();
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let picture = scene.picture(&view, &band(), &RenderOptions::default()).unwrap();
    for t in &picture.temperature.data {
        assert!((t - 263.0).abs() < 1e-6, "{t}");
    }
}

#[test]
fn roughness_on_snow_that_scatters_is_refused_with_its_line() {
    let text = WINTER.replace("coherent = false", "roughness = \"go:0.1,0.1\"\ncoherent = false");
    let error = SolidScene::from_toml(&text).unwrap_err();
    let message = format!("{error}: {}", std::error::Error::source(&error).unwrap());
    assert!(message.contains("line 5") && message.contains("snow") && message.contains("give it one of them"), "{message}");
}
