//! The diffuse lobe of matt ground beside a warm wall, against the integral over the hemisphere.

use super::{Picture, RenderOptions, Scale};
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::camera::{Camera, View};
use crate::dielectrics::Extrapolation;
use crate::solids::SolidScene;
use crate::surfaces::{Canopy, Roughness, Sky, Stack, StackDescription, SurfaceModel};
use cittert_arrays::{Polarization, SpectralWindow};
use num_complex::Complex64;
use std::f64::consts::PI;

const SKY_K: f64 = 60.0;
const WALL_K: f64 = 295.0;
/// Distance of the wall from the camera, its height and half its width, m.
const WALL: [f64; 3] = [12.0, 5.0, 6.0];
const CAMERA_M: f64 = 4.0;
/// Roughness and canopy or layers of the ground, as a scene says them.
const GROUNDS: [&str; 5] = [
    r#"roughness = "qh:0.2,1.2,0""#,
    r#"roughness = "choudhury:0.5mm""#,
    r#"roughness = "qh:0.2,1.2,0"
canopy = { tau_np = 0.8, omega = 0.15, temperature_k = 290 }"#,
    r#"canopy = { tau_np = 0.4, omega = 0.3, temperature_k = 290 }"#,
    SNOW,
];
/// Snow that scatters inside.
const SNOW: &str = r#"coherent = false
layer = [{ material = "dry-snow", thickness_m = 1, density_kg_m3 = 280, temperature_k = 258, scatter = "iba:0.15mm" }, { eps = [6.0, 2.0], temperature_k = 290 }]"#;

fn rj(k: f64) -> f64 {
    rayleigh_jeans_temperature_k(94.0, black_body_radiance(94.0, k))
}

/// A black wall on matt ground, north of the camera, under a sky of 60 K without air.
fn yard(ground: &str) -> SolidScene {
    let [near, high, half] = WALL;
    let layer = if ground.contains("layer") { "" } else { "layer = [{ eps = [6.0, 2.0], temperature_k = 290 }]" };
    SolidScene::from_toml(&format!(
        r#"
kind = "solids"
name = "yard"
camera = {{ position_m = [0, 0, {CAMERA_M}], size_px = [8, 8], fov_deg = 0.001 }}
atmosphere = {{ vacuum = true, background_k = {SKY_K} }}
[surface.matt]
{layer}
{ground}
[surface.black]
layer = [{{ eps = [1.0, 0.0], temperature_k = {WALL_K} }}]
[ground]
surface = "matt"
[[body]]
name = "wall"
type = "RPP"
data = [{}, {half}, {near}, {}, 0, {high}]
surface = "black"
"#,
        -half,
        near + 1.0
    ))
    .unwrap()
}

/// The same ground as a surface, with Rayleigh-Jeans temperatures.
fn model(ground: &str) -> SurfaceModel {
    if ground == SNOW {
        let stack = StackDescription::from_toml(SNOW).unwrap().resolve(94e9, Extrapolation::Refuse).unwrap();
        return SurfaceModel::new(stack.with_temperatures(rj).unwrap(), Roughness::Smooth);
    }
    let rough = ground.split('"').nth(1).filter(|_| ground.starts_with("rough")).unwrap_or("smooth");
    let mut model = SurfaceModel::new(Stack::half_space(Complex64::new(6.0, -2.0), rj(290.0), 94e9).unwrap(), rough.parse().unwrap());
    let number = |key: &str| ground.split(key).nth(1)?.trim_start_matches([' ', '=']).split([',', ' ']).next()?.parse().ok();
    if let (Some(tau), Some(omega)) = (number("tau_np"), number("omega")) {
        model.canopy = Some(Canopy::new(tau, omega, rj(290.0)).unwrap());
    }
    model
}

/// Whether a direction from the ground at `(0, y)` meets the wall.
fn meets(y: f64, d: [f64; 3]) -> bool {
    let [near, high, half] = WALL;
    let t = (near - y) / d[1];
    d[1] > 0.0 && (t * d[0]).abs() < half && t * d[2] < high
}

/// The brightness `[h, v]` of the ground at `(0, y)`, RJ, K, by a plain sum over directions.
fn exact(model: &SurfaceModel, y: f64) -> [f64; 2] {
    let theta = y.atan2(CAMERA_M);
    let lobe = model.lobe().unwrap().unwrap();
    let cold = |_: f64| 0.0;
    let r = model.response(theta, 0.0, Sky::Symmetric(&cold)).unwrap();
    let source = |d: [f64; 3]| if meets(y, d) { rj(WALL_K) } else { rj(SKY_K) };
    let (zeniths, azimuths) = (400, 400);
    let mut out = r.emitted_k;
    for i in 0..zeniths {
        let mu = (f64::from(i) + 0.5) / f64::from(zeniths);
        let factors = lobe.factors(model.diffuse_albedo(theta).unwrap(), model.diffuse_albedo(mu.acos()).unwrap());
        let mut mean = 0.0;
        for j in 0..azimuths {
            let (s, c) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(azimuths)).sin_cos();
            let sin = (1.0 - mu * mu).sqrt();
            mean += source([sin * s, sin * c, mu]) / f64::from(azimuths);
        }
        for p in 0..2 {
            out[p] += 2.0 * mu / f64::from(zeniths) * (factors[p][0] + factors[p][1]) * mean;
        }
    }
    let mirrored = source([0.0, theta.sin(), theta.cos()]);
    [0, 1].map(|p| out[p] + r.mirrored[p] * mirrored)
}

fn picture(scene: &SolidScene, y: f64) -> Picture {
    let options =
        RenderOptions { polarizations: vec![Polarization::XX, Polarization::YY], scale: Scale::RayleighJeans, ..RenderOptions::default() };
    let camera = Camera { pitch_deg: -CAMERA_M.atan2(y).to_degrees(), ..scene.camera().unwrap().clone() };
    let scene = scene.clone().with_camera(camera).unwrap();
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    scene.picture(&view, &SpectralWindow::band(94e9, 1e9, 1).unwrap(), &options).unwrap()
}

#[test]
fn matt_ground_beside_a_wall_follows_the_integral_over_the_hemisphere() {
    for ground in GROUNDS {
        let (scene, model) = (yard(ground), model(ground));
        for y in [2.0, 6.0, 9.5, 11.5] {
            let picture = picture(&scene, y);
            for (p, want) in exact(&model, y).into_iter().enumerate() {
                // All pixels show one point.
                let plane = picture.temperature.plane(0, p);
                let mean = plane.mean().unwrap();
                let worst = plane.iter().map(|t| (t - want).abs()).fold(0.0, f64::max);
                assert!((mean - want).abs() < 0.5 && worst < 1.5, "{ground}, {y} m, plane {p}: {mean}, worst {worst}, exact {want}");
            }
        }
    }
}

/// What grass scatters from a wall has no edge, unlike what a mirror shows of it.
#[test]
fn grass_shows_no_mirror_image() {
    let grass = r#"roughness = "qh:0.2,1.2,0"
canopy = { tau_np = 2.5, omega = 0.06, temperature_k = 290 }"#;
    // The mirror image of the top of the wall lies where the ray from the camera and its mirror image have the same slope.
    let edge = WALL[0] * CAMERA_M / (CAMERA_M + WALL[1]);
    let scene = yard(grass);
    let at = |y: f64| picture(&scene, y).temperature.plane(0, 0).mean().unwrap();
    let step = at(edge + 0.1) - at(edge - 0.1);
    assert!(step.abs() < 0.7, "{step}");
    assert!(at(11.5) - at(1.0) > 1.5, "{}", at(11.5) - at(1.0));
}
