//! Half or twice a value that steers a picture changes the picture little.

use super::*;
use crate::camera::{Camera, View};
use crate::solids::SolidScene;
use cittert_arrays::SpectralWindow;
use ndarray::Array2;

const SCENES: [&str; 4] = ["airport", "runway-fog-4", "ship", "t-72"];

/// A scene that ships, with a picture of 64 x 64 pixels.
fn shipped(name: &str) -> SolidScene {
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    // The tables of a second bounce take seconds, and this module makes them many times.
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}")).replace("\"sea:12\"", "\"sea:12,reemit\"");
    let scene = SolidScene::from_toml(&text).unwrap();
    let camera = Camera { size_px: [64, 64], ..scene.camera().unwrap().clone() };
    scene.with_camera(camera).unwrap()
}

fn full(scene: &SolidScene, options: &RenderOptions) -> Array2<f64> {
    let view = View::of_camera(scene.camera().unwrap()).unwrap();
    let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    scene.picture(&view, &band, options).unwrap().temperature.plane(0, 0).to_owned()
}

fn rms(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    ((a - b).mapv(|d| d * d).mean().unwrap()).sqrt()
}

/// Half and twice one value of some options.
fn two<O: Clone>(options: &O, change: impl Fn(&mut O, f64)) -> [O; 2] {
    [0.5, 2.0].map(|factor| {
        let mut other = options.clone();
        change(&mut other, factor);
        other
    })
}

fn scaled(value: usize, factor: f64) -> usize {
    (value as f64 * factor).ceil() as usize
}

#[test]
fn half_or_twice_an_option_changes_a_picture_little() {
    let o = RenderOptions::default();
    // The limit of each option is the number in its description, K rms.
    let variants = [
        ("antialias", 8.0, two(&o, |o, f| o.antialias = scaled(o.antialias, f))),
        ("edge_k", 0.2, two(&o, |o, f| o.edge_k *= f)),
        ("max_bounces", 4.0, two(&o, |o, f| o.max_bounces = scaled(o.max_bounces, f))),
        // A ray that ends earlier also changes which squares of the mesh of scattered objects are split, each by a part of `speckle_k`.
        ("min_weight", 0.05, two(&o, |o, f| o.min_weight *= f)),
        ("level_deg", 0.02, two(&o, |o, f| o.level_deg *= f)),
        ("mirror_k", 0.02, two(&o, |o, f| o.tables.mirror_k *= f)),
        ("facets_k", 0.02, two(&o, |o, f| o.tables.facets_k *= f)),
        ("facet_intervals", 0.02, two(&o, |o, f| o.tables.facet_intervals = scaled(o.tables.facet_intervals, f))),
        ("sky_intervals", 0.02, two(&o, |o, f| o.tables.sky_intervals = scaled(o.tables.sky_intervals, f))),
        ("sky_k", 0.02, two(&o, |o, f| o.tables.sky_k *= f)),
        ("path_rise_km", 0.02, two(&o, |o, f| o.tables.path_rise_km *= f)),
    ];
    let mut failed = Vec::new();
    for name in SCENES {
        let scene = shipped(name);
        let plain = full(&scene, &o);
        for (option, bar_k, [half, twice]) in &variants {
            for (word, other) in [("half", half), ("twice", twice)] {
                let change_k = rms(&full(&scene, other), &plain);
                println!("{name}: {word} {option}: {change_k:.4} K rms, bar {bar_k}");
                if !(change_k < *bar_k) {
                    failed.push(format!("{name}: {word} {option}: {change_k} K rms, bar {bar_k} K"));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn half_or_twice_an_option_of_the_mesh_changes_its_error_little() {
    let o = MeshOptions::default();
    let variants = [
        ("step", 1.0, two(&o, |o, f| o.step = scaled(o.step, f))),
        ("spread_k", 1.0, two(&o, |o, f| o.spread_k *= f)),
        ("center_fraction", 1.0, two(&o, |o, f| o.center_fraction *= f)),
        ("speckle", 1.0, two(&o, |o, f| o.speckle *= f)),
        ("near", 1.0, two(&o, |o, f| o.near = scaled(o.near, f))),
        ("weak_k", 1.0, two(&o, |o, f| o.edges.weak_k *= f)),
        ("strong_k", 1.0, two(&o, |o, f| o.edges.strong_k *= f)),
        ("budget_k", 1.0, two(&o, |o, f| o.edges.budget_k *= f)),
        ("most_k", 1.0, two(&o, |o, f| o.edges.most_k *= f)),
        ("strong_side", 4.0, two(&o, |o, f| o.edges.strong_side = scaled(o.edges.strong_side, f))),
        ("alike_k", 1.0, two(&o, |o, f| o.edges.alike_k *= f)),
    ];
    let mut failed = Vec::new();
    for name in SCENES {
        let scene = shipped(name);
        let picture = full(&scene, &RenderOptions::default());
        let tracer = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
        let view = View::of_camera(scene.camera().unwrap()).unwrap();
        let error_k = |options| error_map(&tracer.frame(&view, options).unwrap(), picture.view()).unwrap().1;
        let plain_k = error_k(&o);
        for (option, bar_k, [half, twice]) in &variants {
            for (word, other) in [("half", half), ("twice", twice)] {
                let change_k = error_k(other) - plain_k;
                println!("{name}: {word} {option}: error {plain_k:.2} K rms changes by {change_k:.3} K");
                if !(change_k.abs() < *bar_k) {
                    failed.push(format!("{name}: {word} {option}: the error {plain_k} K rms changes by {change_k} K, bar {bar_k} K"));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}
