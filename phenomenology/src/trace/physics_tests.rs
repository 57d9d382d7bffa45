//! Laws a traced scene must obey.

use super::*;
use crate::atmosphere::planck::{black_body_radiance, planck_temperature_k};
use crate::atmosphere::{Atmosphere, Geometry as SkyGeometry};
use crate::camera::View;
use crate::dielectrics::{Extrapolation, Material};
use crate::solids::SolidScene;
use crate::surfaces::{Sky, StackDescription, SurfaceModel};
use cittert_arrays::{Polarization, SpectralWindow};

fn band() -> SpectralWindow {
    SpectralWindow::band(94e9, 1e9, 1).unwrap()
}

fn scene(text: &str) -> SolidScene {
    SolidScene::from_toml(text).unwrap()
}

fn picture(scene: &SolidScene, options: &RenderOptions) -> Picture {
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    scene.picture(&view, &band(), options).unwrap()
}

/// A courtyard of everything: metal, painted layers, rough ground, canopy, a room with a hole, instances.
const EVERYTHING: &str = r#"
kind = "solids"
name = "everything"
extrapolate = true
[camera]
position_m = [-6, -14, 5]
look_at_m = [0, 0, 1]
fov_deg = 50
size_px = [48, 40]
[atmosphere]
layers = ["fog:0m-100m:0.1g/m3"]
TEMPERATURE
[surface.metal]
layer = [{ material = "aluminium", temperature_k = 287.5 }]
[surface.painted]
layer = [{ material = "paint", thickness_m = 2e-4, temperature_k = 287.5 }, { material = "steel", temperature_k = 287.5 }]
[surface.glass]
coherent = false
layer = [{ material = "glass", thickness_m = 0.01, temperature_k = 287.5 }, { eps = [1.0, 0.0], temperature_k = 287.5 }]
[surface.rough]
layer = [{ material = "soil", temperature_k = 287.5 }]
roughness = "go:0.2,0.1"
slope_azimuth_deg = 30
[surface.grass]
layer = [{ material = "soil", temperature_k = 287.5 }]
roughness = "qh:0.1,0.5,2"
canopy = { tau_np = 0.7, omega = 0.05, temperature_k = 287.5 }
[ground]
surface = "grass"
patch = [{ surface = "rough", polygon_m = [[-4, -4], [4, -4], [4, 4], [-4, 4]] }, { surface = "metal", strip_m = [[-9, 2], [9, 3]], width_m = 1 }]
[assembly.post]
body = [
  { name = "pole", type = "RCC", data = [0, 0, 0, 0, 0, 2, 0.2], surface = "metal" },
  { name = "head", type = "SPH", data = [0, 0, 2.3, 0.4], surface = "painted" },
]
[[body]]
name = "outer"
type = "RPP"
data = [-2, 2, -2, 2, 0, 3]
[[body]]
name = "inner"
type = "RPP"
data = [-1.8, 1.8, -3, 1.8, 0, 2.8]
[[region]]
name = "walls"
is = "+outer -inner"
surface = "metal"
face = [{ body = "outer", surface = "glass" }, { body = "outer", face = 6, surface = "rough" }]
[[instance]]
assembly = "post"
position_m = [0.5, 0, 0]
rotate_deg = [0, 20, 45]
[[instance]]
assembly = "post"
position_m = [-3, -3, 0]
scale = 1.5
"#;

#[test]
fn a_world_of_one_temperature_shows_nothing_else() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "isothermal_k = 287.5"));
    let all = [Polarization::I, Polarization::XX, Polarization::YY, Polarization::Q, Polarization::U, Polarization::V];
    for max_bounces in [0, 2, 8] {
        let options = RenderOptions { polarizations: all.to_vec(), max_bounces, ..RenderOptions::default() };
        let picture = picture(&scene, &options);
        for ((_, pol, row, column), t) in picture.temperature.data.indexed_iter() {
            let want = if pol < 3 { 287.5 } else { 0.0 };
            assert!((t - want).abs() < 1e-9, "{} at {row} {column}: {t}", all[pol]);
        }
        let seen = |n: &str| picture.material.iter().filter(|m| **m > 0 && picture.material_names[**m as usize - 1] == n).count();
        for name in ["metal", "painted", "glass", "rough", "grass"] {
            assert!(seen(name) > 3, "{name} is not on view");
        }
    }
}

#[test]
fn the_picture_is_the_same_to_the_bit_for_any_number_of_threads() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "profile = \"mls\""));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(&scene, &RenderOptions::default()).temperature.data)
    };
    let one = with(1);
    assert!(one.iter().zip(&with(2)).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert!(one.iter().copied().fold(0.0, f64::max) - one.iter().copied().fold(1e9, f64::min) > 100.0);
    // The second frame uses the memory of the first.
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let frames = |threads: usize| {
        let tracer = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| [0, 1].map(|_| tracer.frame(&view, &MeshOptions::default()).unwrap().temperature_k))
    };
    let [first, second] = frames(1);
    for other in frames(2).iter().chain([&second]) {
        assert!(first.iter().zip(other).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

/// Two mirrors at right angles, with the crease at an angle in the picture. Black plates that emit only one polarisation do not exist, so
/// the emission of lossy mirrors distinguishes h from v.
fn dihedral(crease_deg: f64) -> String {
    format!(
        r#"
kind = "solids"
name = "dihedral"
camera = {{ position_m = [0, 0, 20], pitch_deg = -90, size_px = [2, 2], fov_deg = 0.1 }}
atmosphere = {{ vacuum = true, background_k = 0.1 }}
[surface.mirror]
layer = [{{ eps = [1.0, 1e12], temperature_k = 1 }}]
[surface.glow]
layer = [{{ eps = [4.0, 0.0], temperature_k = 300 }}]
[assembly.pair]
body = [
  {{ name = "a", type = "BOX", data = [0, 0, 0, 5, 0, 5, 0, 4, 0, 1, 0, -1], surface = "mirror" }},
  {{ name = "b", type = "BOX", data = [0, 0, 0, -5, 0, 5, 0, 4, 0, -1, 0, -1], surface = "mirror" }},
]
[[instance]]
assembly = "pair"
rotate_deg = [0, 0, {crease_deg}]
position_m = [0, 0, 0]
[[body]]
name = "roof"
type = "BOX"
data = [-50, -3, 30, 100, 0, 0, 0, 60, 60, 0, -0.5, 0.5]
surface = "glow"
"#
    )
}

#[test]
fn a_dihedral_with_its_crease_at_45_degrees_swaps_h_and_v() {
    // The roof above the camera is a tilted dielectric, so what it emits is polarised: h across its slope (along x), v along.
    let planes = RenderOptions {
        polarizations: vec![Polarization::XX, Polarization::YY],
        antialias: 1,
        scale: Scale::RayleighJeans,
        ..RenderOptions::default()
    };
    let seen = |crease: f64| {
        let mut camera = scene(&dihedral(crease)).camera().unwrap().clone();
        // Beside the crease, so that one ray meets both mirrors.
        let (s, c) = crease.to_radians().sin_cos();
        camera.position_m = [1.3 * c - 2.0 * s, 1.3 * s + 2.0 * c, 20.0];
        let p = picture(&scene(&dihedral(crease)).with_camera(camera).unwrap(), &planes);
        (p.temperature.data[[0, 0, 1, 1]], p.temperature.data[[0, 1, 1, 1]])
    };
    let (h0, v0) = seen(0.0);
    assert!((h0 - v0).abs() > 5.0, "the roof is not polarised: {h0} {v0}");
    let (h45, v45) = seen(45.0);
    assert!((h45 - v0).abs() < 0.05 && (v45 - h0).abs() < 0.05, "{h0} {v0} became {h45} {v45}");
    let (h90, v90) = seen(90.0);
    assert!((h90 - h0).abs() < 0.05 && (v90 - v0).abs() < 0.05);
}

#[test]
fn a_mirror_shows_the_sky_of_the_reflected_zenith_angle() {
    for (pitch, zenith) in [(-90.0, 0.0), (-50.0, 40.0), (-20.0, 70.0), (-5.0, 85.0)] {
        let text = format!(
            "kind = \"solids\"\nname = \"mirror\"\ncamera = {{ position_m = [0, 0, 0.001], pitch_deg = {pitch}, size_px = [2, 2], fov_deg = 0.001 }}\n\
             [surface.metal]\nlayer = [{{ eps = [1.0, 1e13], temperature_k = 290 }}]\n[ground]\nsurface = \"metal\"\n"
        );
        let t = picture(&scene(&text), &RenderOptions::default()).temperature.data[[0, 0, 1, 1]];
        let air = Atmosphere::reference("mls", "mpm89").unwrap();
        let sky = air.sky(&[94.0], &[zenith], SkyGeometry::Plane).unwrap()[0].tb_planck_k;
        assert!((t - sky).abs() < 0.01, "{pitch}: {t} {sky}");
    }
}

#[test]
fn a_flat_sea_agrees_with_emissivity_and_sky_combined_by_hand() {
    let air = Atmosphere::reference("mls", "mpm89").unwrap();
    let water = Material::by_name("sea-water").unwrap();
    let stack = StackDescription::of_material(water, water.state(), None).resolve(94e9, Extrapolation::Refuse).unwrap();
    let options = RenderOptions { polarizations: vec![Polarization::XX, Polarization::YY], ..RenderOptions::default() };
    for roughness in ["smooth", "sea:7,reemit"] {
        let model = SurfaceModel::new(stack.clone(), roughness.parse().unwrap());
        let text = format!(
            "kind = \"solids\"\nname = \"sea\"\ncamera = {{ position_m = [0, 0, 1e-5], size_px = [2, 2], fov_deg = 0.0001 }}\n\
             [surface.sea]\nlayer = [{{ material = \"sea-water\" }}]\nroughness = \"{roughness}\"\n[ground]\nsurface = \"sea\"\n"
        );
        let scene = scene(&text);
        let tracer = Tracer::new(&scene, &[94e9], &options).unwrap();
        // The integral in this test needs thousands of sky temperatures, so the rough sea is tested at only two angles.
        let zeniths: &[f64] = if roughness == "smooth" { &[0.0, 20.0, 45.0, 53.0, 70.0, 80.0, 85.0, 88.0, 89.5] } else { &[47.0, 76.0] };
        for &zenith in zeniths {
            let camera = crate::camera::Camera { pitch_deg: zenith - 90.0, ..scene.camera().unwrap().clone() };
            let p = tracer.picture(&View::of_camera(&camera).unwrap(), &band(), None).unwrap();
            let radiance = |t: f64| black_body_radiance(94.0, t);
            let sky = |z: f64| air.sky(&[94.0], &[z.to_degrees().min(89.9999)], SkyGeometry::Plane).unwrap()[0].tb_planck_k;
            let by_hand = |plane: usize| {
                let theta = zenith.to_radians();
                if roughness == "smooth" {
                    let e = stack.reflection(theta).unwrap().emissivities()[plane];
                    return planck_temperature_k(94.0, e * radiance(288.15) + (1.0 - e) * radiance(sky(theta)));
                }
                // The camera looks north, so the view runs along the first slope axis.
                let sky_radiance = |z: f64| radiance(sky(z)) * 1e3;
                let r = model.response(theta, 0.0, Sky::Symmetric(&sky_radiance)).unwrap();
                planck_temperature_k(94.0, r.emissivity[plane] * radiance(288.15) + r.scattered_sky_k[plane] * 1e-3)
            };
            let bar = if roughness == "smooth" { 0.01 } else { 0.1 };
            for plane in 0..2 {
                let t = p.temperature.data[[0, plane, 1, 1]];
                assert!((t - by_hand(plane)).abs() < bar, "{roughness} {zenith} plane {plane}: {t} {}", by_hand(plane));
            }
        }
    }
}

#[test]
fn channels_have_their_own_temperatures() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "profile = \"mls\""));
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let three = SpectralWindow::band(94e9, 8e9, 3).unwrap();
    // The brightest channel decides how many facets are drawn for all channels, so both pictures have little noise.
    let options = RenderOptions { per_channel: true, antialias: 1, speckle_k: 0.05, ..RenderOptions::default() };
    let whole = scene.picture(&view, &three, &options).unwrap().temperature;
    assert_eq!(whole.data.shape(), [3, 1, 40, 48]);
    let last = SpectralWindow::new(vec![three.freq_hz()[2]], vec![1e9]).unwrap();
    let alone = scene.picture(&view, &last, &options).unwrap().temperature;
    for (a, b) in whole.plane(2, 0).iter().zip(alone.plane(0, 0)) {
        // One weight decides for all channels where a ray ends.
        assert!((a - b).abs() < 0.3, "{a} {b}");
    }
}

/// A scene that ships, with square pictures of a side.
fn shipped(name: &str, side: usize) -> SolidScene {
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let scene = scene(&std::fs::read_to_string(path).unwrap());
    let camera = crate::camera::Camera { size_px: [side, side], ..scene.camera().unwrap().clone() };
    scene.with_camera(camera).unwrap()
}

#[test]
fn the_mesh_of_the_real_time_mode_stays_near_one_ray_a_pixel() {
    for name in ["airport", "runway-fog-1", "runway-fog-4"] {
        let scene = shipped(name, 128);
        let options = RenderOptions { antialias: 1, ..RenderOptions::default() };
        let tracer = Tracer::new(&scene, &[94e9], &options).unwrap();
        let view = View::of_camera(scene.camera().unwrap()).unwrap();
        let full = tracer.picture(&view, &band(), None).unwrap();
        let rough = MeshOptions { antialias: false, ..MeshOptions::default() };
        let frame = tracer.frame(&view, &rough).unwrap();
        let (map, rms_k) = error_map(&frame, full.temperature.plane(0, 0)).unwrap();
        assert_eq!(map.dim(), (128, 128));
        assert!(rms_k < 1.0, "{name}: {rms_k} K rms");
        assert!(frame.rays < 128 * 128 * 3 / 4, "{name}: {} rays", frame.rays);
        let every = tracer
            .frame(&view, &MeshOptions { step: 1, spread_k: 0.0, speckle: 1.0, near: 4, antialias: false, ..MeshOptions::default() })
            .unwrap();
        assert!(error_map(&every, full.temperature.plane(0, 0)).unwrap().1 < 1e-9);
    }
}

#[test]
fn the_real_time_mode_stays_within_three_kelvin_of_the_full_model() {
    let fog = ["runway-fog-1", "runway-fog-2", "runway-fog-3", "runway-fog-4"];
    for name in ["airport", "t-72", "bmp-1", "ss-24", "ship", "security"].into_iter().chain(fog) {
        let scene = shipped(name, 256);
        let tracer = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
        let view = View::of_camera(scene.camera().unwrap()).unwrap();
        let full = tracer.picture(&view, &band(), None).unwrap();
        let frame = tracer.frame(&view, &MeshOptions::default()).unwrap();
        let (_, rms_k) = error_map(&frame, full.temperature.plane(0, 0)).unwrap();
        println!("{name}: {rms_k:.3} K rms, {} rays", frame.rays);
        assert!(rms_k < 2.8, "{name}: {rms_k} K rms");
        assert!(frame.rays < full.rays / 4, "{name}: {} rays, the full model {}", frame.rays, full.rays);
    }
}

#[test]
fn a_camera_above_the_tables_of_the_sky_is_refused() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "profile = \"mls\""));
    let camera = crate::camera::Camera { position_m: [0.0, 0.0, 500.0], ..scene.camera().unwrap().clone() };
    let view = View::of_camera(&camera).unwrap();
    let low = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
    assert!(low.picture(&view, &band(), None).unwrap_err().to_string().contains("height of the camera is 500 m"));
    let options = RenderOptions { highest_m: 500.0, ..RenderOptions::default() };
    assert!(Tracer::new(&scene, &[94e9], &options).unwrap().frame(&view, &MeshOptions::default()).is_ok());
}

#[test]
fn progress_counts_every_row_of_both_passes_and_huge_pictures_are_refused() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "vacuum = true"));
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let most = std::sync::atomic::AtomicUsize::new(0);
    let tell = |done: usize, all: usize| {
        assert_eq!(all, 80);
        most.fetch_max(done, std::sync::atomic::Ordering::Relaxed);
    };
    scene.picture_observed(&view, &band(), &RenderOptions::default(), Some(&tell)).unwrap();
    assert_eq!(most.into_inner(), 80);
    let camera = crate::camera::Camera { size_px: [60_000, 60_000], ..scene.camera().unwrap().clone() };
    let huge = View::of_camera(&camera).unwrap();
    let message = scene.picture(&huge, &band(), &RenderOptions::default()).unwrap_err().to_string();
    assert!(message.contains("60000 x 60000 pixels"), "{message}");
}

#[test]
fn the_causes_add_up_to_the_temperature() {
    let scene = scene(&EVERYTHING.replace("TEMPERATURE", "profile = \"mls\""));
    let options = RenderOptions { causes: true, scale: Scale::RayleighJeans, ..RenderOptions::default() };
    let told = picture(&scene, &options);
    let causes = told.causes_k.unwrap();
    let untold = picture(&scene, &RenderOptions { causes: false, ..options });
    assert!(untold.causes_k.is_none() && untold.temperature.data == told.temperature.data);
    for ((row, column), t) in told.temperature.plane(0, 0).indexed_iter() {
        let [emission, surroundings, sky] = [0, 1, 2].map(|cause| causes[[cause, row, column]]);
        assert!((emission + surroundings + sky - t).abs() < 1e-9, "{row} {column}");
        assert!(emission >= 0.0 && sky > 0.0);
    }
}

#[test]
fn a_mirror_shows_sky_above_and_ground_below() {
    let text = "kind = \"solids\"\nname = \"m\"\n[atmosphere]\nvacuum = true\nbackground_k = 50\n\
        [surface.metal]\nlayer = [{ eps = [1.0, 1e13], temperature_k = 290 }]\n[surface.soil]\nlayer = [{ eps = [4.0, 0.1], temperature_k = 290 }]\n\
        [ground]\nsurface = \"soil\"\n[[body]]\nname = \"ball\"\ntype = \"SPH\"\ndata = [0, 30, 5, 2]\nsurface = \"metal\"\n\
        [camera]\nposition_m = [0, 0, 5]\nfov_deg = 1\nsize_px = [2, 2]\n";
    let scene = scene(text);
    // The top of the ball mirrors the sky, its lower half the ground, which itself mirrors the sky; the ground in view emits.
    for (pitch, want) in
        [(3.0, [false, false, true]), (-2.0, [false, true, true]), (-30.0, [true, false, true]), (20.0, [false, false, true])]
    {
        let camera = crate::camera::Camera { pitch_deg: pitch, ..scene.camera().unwrap().clone() };
        let scene = scene.clone().with_camera(camera).unwrap();
        let causes = picture(&scene, &RenderOptions { causes: true, antialias: 1, ..RenderOptions::default() }).causes_k.unwrap();
        let got = [0, 1, 2].map(|cause| causes[[cause, 1, 1]] > 1.0);
        assert_eq!(got, want, "{pitch}");
    }
}
