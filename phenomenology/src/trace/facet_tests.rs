//! The image of a post in a rough sea, against the integral over the facets that are seen.

use super::*;
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::camera::{Camera, View};
use crate::dielectrics::{Extrapolation, Material};
use crate::solids::SolidScene;
use crate::space::Vec3;
use crate::surfaces::{Foam, Stack, StackDescription};
use cittert_arrays::{Polarization, SpectralWindow};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

const SLOPE: f64 = 0.2;
const POST_K: f64 = 290.0;
const SKY_K: f64 = 60.0;
/// Height of the camera over the sea, and distance to the post, m.
const CAMERA_M: f64 = 10.0;
const POST_M: f64 = 35.0;
/// Depth of the post behind its front, m.
const POST_DEEP_M: f64 = 0.5;

fn rj(k: f64) -> f64 {
    rayleigh_jeans_temperature_k(94.0, black_body_radiance(94.0, k))
}

/// A black post of 3 m x 6 m on the sea, 35 m north of the camera, under a sky of 60 K without air.
fn post(roughness: &str) -> SolidScene {
    SolidScene::from_toml(&format!(
        r#"
kind = "solids"
name = "post"
camera = {{ position_m = [0, 0, {CAMERA_M}], size_px = [16, 16], fov_deg = 0.001 }}
atmosphere = {{ vacuum = true, background_k = {SKY_K} }}
[surface.sea]
layer = [{{ material = "sea-water" }}]
roughness = "{roughness}"
[surface.black]
layer = [{{ eps = [1.0, 0.0], temperature_k = {POST_K} }}]
[ground]
surface = "sea"
[[body]]
name = "post"
type = "RPP"
data = [-1.5, 1.5, {POST_M}, {}, 0, 6]
surface = "black"
"#,
        POST_M + POST_DEEP_M
    ))
    .unwrap()
}

fn water() -> Stack {
    let m = Material::by_name("sea-water").unwrap();
    StackDescription::of_material(m, m.state(), None).resolve(94e9, Extrapolation::Refuse).unwrap()
}

fn lambda(d: Vec3) -> f64 {
    let v = d.z / d.x.hypot(d.y).max(1e-12) * FRAC_1_SQRT_2 / SLOPE;
    if v > 6.0 { 0.0 } else { 0.5 * ((-v * v).exp() / (PI.sqrt() * v) - libm::erfc(v)) }
}

/// Whether a ray from the sea meets the post: it passes through all three slabs of the box at once.
fn meets_post(from: Vec3, r: Vec3) -> bool {
    let slabs = [(from.x, r.x, -1.5, 1.5), (from.y, r.y, POST_M, POST_M + POST_DEEP_M), (from.z, r.z, 0.0, 6.0)];
    let (near, far) = slabs.into_iter().fold((0.0_f64, f64::INFINITY), |(near, far), (at, d, low, high)| {
        let (a, b) = ((low - at) / d, (high - at) / d);
        (near.max(a.min(b)), far.min(a.max(b)))
    });
    near < far
}

/// The brightness `[h, v]` of the sea at a point `(x, y)` seen from the camera, RJ, K: the integral over the slopes of the facets that are
/// seen, on a plain grid, with multiply scattered power absorbed.
fn exact(stack: &Stack, x: f64, y: f64) -> [f64; 2] {
    let point = Vec3::new(x, y, 0.0);
    let s = (Vec3::new(0.0, 0.0, CAMERA_M) - point).unit();
    let h_seen = Vec3::UP.cross(s).unit();
    let (mut brightness, mut reflected) = ([0.0; 2], [0.0; 2]);
    let steps = 800;
    let cell = 12.0 / f64::from(steps);
    for i in 0..steps {
        for j in 0..steps {
            let (a, b) = (-6.0 + (f64::from(i) + 0.5) * cell, -6.0 + (f64::from(j) + 0.5) * cell);
            let density = (-0.5 * (a * a + b * b)).exp() / (2.0 * PI) * cell * cell;
            let n = Vec3::new(-SLOPE * a, -SLOPE * b, 1.0).unit();
            let cos = n.dot(s);
            let r = n * (2.0 * cos) - s;
            if cos <= 0.0 || r.z <= 0.0 {
                continue;
            }
            let weight = density * cos / (n.z * s.z) / (1.0 + lambda(s) + lambda(r));
            let fresnel = stack.reflection(cos.min(1.0).acos()).unwrap();
            let h = n.cross(s).unit();
            let c2 = h.dot(h_seen).powi(2);
            let [rh, rv] = fresnel.powers();
            let gamma = [c2 * rh + (1.0 - c2) * rv, c2 * rv + (1.0 - c2) * rh];
            let source_k = if meets_post(point, r) { rj(POST_K) } else { rj(SKY_K) };
            for p in 0..2 {
                reflected[p] += weight * gamma[p];
                brightness[p] += weight * gamma[p] * source_k;
            }
        }
    }
    let water_k = rj(stack.top_temperature_k());
    [0, 1].map(|p| brightness[p] + (1.0 - reflected[p]) * water_k)
}

fn planes() -> RenderOptions {
    RenderOptions { polarizations: vec![Polarization::XX, Polarization::YY], scale: Scale::RayleighJeans, ..RenderOptions::default() }
}

fn picture(scene: &SolidScene, camera: Camera, options: &RenderOptions) -> (View, Picture) {
    let scene = scene.clone().with_camera(camera).unwrap();
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    let picture = scene.picture(&view, &band, options).unwrap();
    (view, picture)
}

#[test]
fn the_image_of_a_post_in_a_rough_sea_is_the_integral_over_the_visible_facets() {
    let (scene, stack) = (post(&format!("go:{SLOPE},{SLOPE},reemit")), water());
    let mut failed = false;
    for zenith in [64.0_f64, 68.0, 70.0, 72.0] {
        let camera = Camera { pitch_deg: zenith - 90.0, ..scene.camera().unwrap().clone() };
        // All 256 pixels show one point of the sea.
        let (_, picture) = picture(&scene, camera, &planes());
        let want = exact(&stack, 0.0, CAMERA_M * zenith.to_radians().tan());
        for (p, want) in want.into_iter().enumerate() {
            let plane = picture.temperature.plane(0, p);
            let mean = plane.mean().unwrap();
            let worst = plane.iter().map(|t| (t - want).abs()).fold(0.0, f64::max);
            let noise = plane.mapv(|t| (t - mean).powi(2)).mean().unwrap().sqrt();
            println!("{zenith} deg, plane {p}: exact {want:.2} K, mean {mean:.2} K, noise {noise:.3} K rms, worst {worst:.2} K");
            failed |= worst > 1.5 || noise > 0.5;
        }
    }
    assert!(!failed);
}

#[test]
fn a_profile_across_the_image_of_a_post_follows_the_integral() {
    let (scene, stack) = (post(&format!("go:{SLOPE},{SLOPE},reemit")), water());
    let camera = Camera { pitch_deg: -20.0, fov_deg: 24.0, size_px: [96, 96], ..scene.camera().unwrap().clone() };
    let (view, picture) = picture(&scene, camera, &planes());
    let (mut squares, mut count, mut worst) = (0.0, 0, 0.0_f64);
    let mut span = (f64::INFINITY, 0.0_f64);
    for row in (0..96).step_by(9) {
        for column in (0..96).step_by(7) {
            let d = view.direction(column as f64, row as f64).unwrap();
            let material = picture.material[[row, column]] as usize;
            if material == 0 || picture.material_names[material - 1] != "sea" {
                continue;
            }
            let [x, y] = [d.x, d.y].map(|c| c * CAMERA_M / -d.z);
            // Pixels that show the edge of the post itself are means over two surfaces.
            if y > POST_M - 2.0 {
                continue;
            }
            for (p, want) in exact(&stack, x, y).into_iter().enumerate() {
                let off = picture.temperature.data[[0, p, row, column]] - want;
                squares += off * off;
                count += 1;
                worst = worst.max(off.abs());
                span = (span.0.min(want), span.1.max(want));
            }
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("{count} values from {:.1} to {:.1} K: {rms:.3} K rms, worst {worst:.2} K", span.0, span.1);
    assert!(count > 80 && span.1 - span.0 > 60.0);
    assert!(rms < 1.0 && worst < 2.0, "{rms} K rms, worst {worst} K");
}

/// Foam covers its share of water and post, and adds its own emission and the sky that it scatters.
#[test]
fn foam_covers_its_share_of_the_image() {
    let zenith = 68.0_f64;
    let means = ["sea:20,reemit", "sea:20,foam,reemit"].map(|roughness| {
        let scene = post(roughness);
        let camera = Camera { pitch_deg: zenith - 90.0, ..scene.camera().unwrap().clone() };
        let (_, picture) = picture(&scene, camera, &planes());
        [0, 1].map(|p| picture.temperature.plane(0, p).mean().unwrap())
    });
    let cover = Foam::monahan86(20.0).unwrap().cover;
    let reflected = Foam::reflectivity(zenith.to_radians());
    let water_k = rj(water().top_temperature_k());
    for p in 0..2 {
        let foam_k = (1.0 - reflected[p]) * water_k + reflected[p] * rj(SKY_K);
        let want = (1.0 - cover) * means[0][p] + cover * foam_k;
        println!("plane {p}: without {:.2} K, with {:.2} K, expected {want:.2} K", means[0][p], means[1][p]);
        // The post fills a small part of the sky of the foam.
        assert!((means[1][p] - want).abs() < 0.15, "plane {p}: {} {want}", means[1][p]);
    }
    assert!(means[1][1] - means[0][1] > 0.5, "{means:?}");
}

#[test]
fn a_sea_with_foam_in_a_world_of_one_temperature_shows_only_it() {
    let scene = post("sea:20,foam").isothermal(287.0).unwrap();
    let camera = Camera { pitch_deg: -20.0, fov_deg: 24.0, size_px: [24, 24], ..scene.camera().unwrap().clone() };
    let options = RenderOptions { scale: Scale::Planck, ..planes() };
    let (_, picture) = picture(&scene, camera, &options);
    assert!(picture.temperature.data.iter().all(|t| (t - 287.0).abs() < 1e-9));
}
