//! Scenes near the array: simulate, focus, and exact images.

use crate::program::Scratch;
use serde_json::Value;

const BAND: &str = "--freq 94GHz --bandwidth 2GHz --channels 2";

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

/// Three points on a plane 4 m away, seen by the golden disc of 0.6 m.
fn near() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.03,0.01,2.0\n-0.05,0.02,1.0\n0.01,-0.04,1.5\n");
    s.ok(&format!("simulate --layout mm-golden --scene s.csv {BAND} --range 4m -o v.uvh5"));
    s
}

#[test]
fn a_near_scene_is_simulated_focused_and_imaged() {
    let s = near();
    let info = s.json("info v.uvh5");
    assert_eq!((info["scene_range"].as_str(), info["focus"].is_null()), (Some("plane 4.0"), true), "{info}");
    let f = s.json("focus v.uvh5 -o f.uvh5 --range 4m --map map.fits");
    // k a^2 / (2 R) for a = 0.299 m at 95 GHz, and the elements near the middle.
    assert!((number(&f, "curvature_rad") - 22.2).abs() < 0.5, "{f}");
    let (valid, pixels) = (number(&f, "valid_pixels"), number(&f, "pixels"));
    assert!(valid > 0.0 && valid < pixels && number(&f, "largest_residual_rad") > std::f64::consts::FRAC_PI_8, "{f}");
    let info = s.json("info f.uvh5");
    assert_eq!(info["focus"], serde_json::json!([0.0, 0.0, 4.0]));
    assert!(s.path("map.fits").exists());
    // The Fourier image of the focused set and the exact image of the other one show the points; the set out of focus does not.
    let grid = "--size 192 --cell 1mrad";
    let far = s.json(&format!("dirty v.uvh5 {grid} -o blurred.fits"));
    let sharp = s.json(&format!("dirty f.uvh5 {grid} -o sharp.fits"));
    let exact = s.json(&format!("dirty v.uvh5 {grid} --range auto -o exact.fits"));
    assert!(number(&far, "peak") < 0.5 && number(&sharp, "peak") > 1.6 && number(&exact, "peak") > 1.9, "{far} {sharp} {exact}");
    let said = s.ok(&format!("dirty v.uvh5 {grid} -o again.fits"));
    assert!(said.err.contains("cittert focus"), "{}", said.err);
    // CLEAN by spherical waves finds the fluxes, and its model explains the data.
    let c = s.json(&format!("clean v.uvh5 {grid} --range 4m --niter 2000 --threshold 2mJy --hold-out 0 -o c"));
    assert!((number(&c, "model_flux") - 4.5).abs() < 0.02 && number(&c, "residual_peak") < 2.1e-3, "{c}");
    let residuals = &c["residuals"];
    assert!(number(residuals, "unexplained") < 1e-4, "the verdict predicts the model by spherical waves: {residuals}");
    // A focus is undone, and carried through other formats.
    s.ok("focus f.uvh5 -o back.uvh5 --range infinity");
    assert!(s.json("info back.uvh5")["focus"].is_null());
    s.ok("convert f.uvh5 f.uvfits");
    assert_eq!(s.json("info f.uvfits")["scene_range"], "plane 4.0");
}

#[test]
fn the_range_is_found_by_sharpness_or_refused() {
    let s = near();
    let f = s.json("focus v.uvh5 -o f.uvh5 --range auto --size 96 --cell 1.2mrad");
    let (range, sigma) = (number(&f, "range_m"), number(&f, "range_sigma_m"));
    assert!((range - 4.0).abs() < 4.0 * sigma + 0.004 && sigma < 0.05, "{f}");
    s.ok(&format!("simulate --layout mm-golden --scene s.csv {BAND} -o far.uvh5"));
    s.fails("focus far.uvh5 -o g.uvh5 --range auto --size 96 --cell 1.2mrad", 1, &["far.uvh5", "needs no focus"]);
    assert!(!s.path("g.uvh5").exists());
}

#[test]
fn a_traced_scene_has_its_own_distances() {
    let s = Scratch::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/phenomenology/scenes/t-72.toml");
    let size = "--scene-size 40 --scene-cell 1.2mrad";
    let traced = s.json(&format!("simulate --layout mm-y --scene {scene} {size} {BAND} --range auto -o a.uvh5"));
    assert!(traced["scene_range"].as_str().unwrap().starts_with("map "), "{traced}");
    s.ok(&format!("scene render {scene} {size} --range r.fits -o t.fits"));
    s.ok(&format!("simulate --layout mm-y --scene {scene} {size} {BAND} --range r.fits -o b.uvh5"));
    // Distances of a file have single precision.
    let difference = s.json("dirty a.uvh5 --size 40 --cell 1.2mrad --range r.fits -o a.fits");
    let other = s.json("dirty b.uvh5 --size 40 --cell 1.2mrad --range r.fits -o b.fits");
    assert!((number(&difference, "peak") / number(&other, "peak") - 1.0).abs() < 1e-3, "{difference} {other}");
    s.fails("dirty a.uvh5 --size 40 --cell 1.2mrad --range auto -o c.fits", 1, &["range is auto", "FITS image of distances"]);
}

#[test]
fn what_has_no_near_field_is_refused() {
    let s = near();
    let track = "--phase-center 13h31m08s,+30d30m33s --start 2025-06-01T01:30:00";
    s.fails(&format!("simulate --layout vla-d --scene s.csv {BAND} {track} --range 1km -o w.uvh5"), 1, &["stands on the Earth"]);
    s.ok(&format!("simulate --layout vla-d --scene s.csv --freq 1.4GHz --bandwidth 64MHz {track} -o vla.uvh5"));
    s.fails("focus vla.uvh5 --range 1km -o w.uvh5", 1, &["vla.uvh5", "stands on the Earth"]);
    s.fails("dirty vla.uvh5 --range 1km -o w.fits", 1, &["sky"]);
    s.fails("focus v.uvh5 --range 10 -o w.uvh5", 2, &["--range"]);
    s.fails("focus v.uvh5 --range 0.2m -o w.uvh5", 1, &["farthest element"]);
    s.fails("focus v.uvh5 --range 4m --nearest 1m -o w.uvh5", 2, &["nearest", "auto"]);
    s.fails("selfcal v.uvh5 --range 4m -o w", 2, &["--range", "focus the set first"]);
    s.fails("grid v.uvh5 --range 4m -o w.h5", 2, &["--range", "cittert focus"]);
    s.fails("dirty v.uvh5 --range s.fits -o w.fits", 1, &["s.fits"]);
    s.fails(&format!("simulate --layout mm-y --scene s.csv {BAND} --range auto -o w.uvh5"), 2, &["--range auto", "scene render --range"]);
}

#[test]
fn the_airport_is_imaged_as_well_near_the_array_as_far_away() {
    let s = Scratch::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/phenomenology/scenes/airport.toml");
    // 8 degrees, seen by 48 elements of an aperture of 0.6 m. At 8 m the curvature across it is 7 rad.
    s.ok(&format!("scene render {scene} --scene-size 96 --scene-cell 1.4mrad -o truth.fits"));
    let simulate = format!("simulate --layout mm-reuleaux --scene truth.fits {BAND} --tsys 600K --integration 100ms");
    s.ok(&format!("{simulate} -o far.uvh5"));
    s.ok(&format!("{simulate} --range 8m -o near.uvh5"));
    s.ok("focus near.uvh5 --range 8m -o focused.uvh5");
    let nrmse = |set: &str, how: &str| {
        // Out of focus, the constraints cannot be met, and the last image is kept.
        s.run(&format!("mem {set}.uvh5 --size 96 --cell 1.4mrad --hold-out 0 {how} --overwrite -o {set}"));
        number(&s.json(&format!("compare {set}-model.fits truth.fits")), "nrmse")
    };
    let far = nrmse("far", "");
    let (exact, of_focused, by_fourier) = (nrmse("near", "--range auto"), nrmse("focused", "--range auto"), nrmse("focused", ""));
    let all = [exact, of_focused, by_fourier];
    assert!(all.iter().all(|x| *x < 1.03 * far), "far {far}, near {exact}, focused {of_focused}, its Fourier image {by_fourier}");
    let blurred = nrmse("near", "");
    assert!(blurred > 3.0 * far, "the scene is out of focus without: {blurred}, far {far}");
}
