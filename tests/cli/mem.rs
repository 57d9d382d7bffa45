//! Maximum entropy on the command line.

use crate::program::Scratch;
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisibilityBlock, for_each_block};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::{create_visibilities, open_image, open_visibilities};
use ndarray::{Array2, Array4};
use serde_json::Value;

const SIDE: usize = 48;
const CELL: f64 = 4e-3;
const IMAGE: &str = "--size 48 --cell 4mrad --weighting natural";

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

/// A warm disc with a cold hole, in kelvin.
fn scene() -> Array2<f64> {
    Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let (x, y) = (j as f64 - 23.5, i as f64 - 23.5);
        if x.hypot(y) > 18.0 {
            return 0.0;
        }
        if (x - 6.0).hypot(y + 4.0) < 5.0 { 120.0 } else { 270.0 + 2.0 * x }
    })
}

fn write(s: &Scratch, name: &str, plane: &Array2<f64>, unit: BrightnessUnit) {
    let grid = SkyGrid::new(SIDE, SIDE, CELL, SkyFrame::Boresight).unwrap();
    let spectrum = SpectralWindow::new(vec![94e9], vec![1e9]).unwrap();
    let data = Array4::from_shape_fn((1, 1, SIDE, SIDE), |(_, _, i, j)| plane[(i, j)]);
    let image = Image::new(grid, spectrum, vec![Polarization::I], data, unit).unwrap();
    write_image(&s.path(name), &image, ImageOptions::default()).unwrap();
}

/// The scene, observed with noise. `extra` contains further options of `simulate`.
fn observed(extra: &str) -> Scratch {
    simulated(&format!("--noise --seed 3 {extra}"))
}

/// The scene, observed by an array that fills the transform, with these options of `simulate`.
fn simulated(options: &str) -> Scratch {
    let s = Scratch::new();
    write(&s, "scene.fits", &scene(), BrightnessUnit::Kelvin);
    let mut layout = "name = \"fill\"\nframe = \"boresight\"\n".to_owned();
    for k in 0..48 {
        let (r, a) = (0.19 * (f64::from(k) + 0.5) / 48.0, 2.399_963 * f64::from(k));
        layout += &format!(
            "[[antenna]]\nname = \"a{k}\"\nposition_m = [{}, {}, 0.0]\ndiameter_m = 0.005\ntsys_k = 500.0\n",
            r * a.cos(),
            r * a.sin()
        );
    }
    s.write("fill.toml", layout);
    s.ok(&format!("simulate --layout fill.toml --scene scene.fits --freq 94GHz --bandwidth 1GHz --channels 2 {options} -o vis.uvh5"));
    s
}

fn error_of(s: &Scratch, name: &str) -> f64 {
    let image = open_image(&s.path(name)).unwrap();
    let truth = scene();
    let off = (&image.plane(0, 0) - &truth).mapv(|v| v * v).sum();
    (off / truth.mapv(|v| v * v).sum()).sqrt()
}

#[test]
fn a_warm_scene_comes_back_from_any_flat_prior_with_a_certificate() {
    let s = observed("--pedestal none");
    for (solver, prior, limit) in [("quasi-newton", "100K", 150.0), ("quasi-newton", "290K", 150.0), ("vtess", "250K", 60.0)] {
        let json = s.json(&format!("mem vis.uvh5 {IMAGE} --prior {prior} --solver {solver} --overwrite -o m --log steps.jsonl"));
        assert!((number(&json, "chi2_per_datum") - 1.0).abs() < 0.01, "{json}");
        assert!(number(&json, "kkt_residual") <= 1e-3 && number(&json, "evaluations") <= limit && json["met"] == true, "{json}");
        assert!(number(&json, "flux_error") == 0.0 && json["flux_constrained"] == false);
        assert!(number(&json, "entropy").is_finite() && number(&json, "time_in_evaluations") > 1.0);
        assert!(error_of(&s, "m-model.fits") < 0.15, "{solver} {prior}: {}", error_of(&s, "m-model.fits"));
        let steps = std::fs::read_to_string(s.path("steps.jsonl")).unwrap();
        let last: Value = serde_json::from_str(steps.lines().last().unwrap()).unwrap();
        assert!((number(&last, "chi2_per_datum") - number(&json, "chi2_per_datum")).abs() < 1e-9);
    }
    let model = open_image(&s.path("m-model.fits")).unwrap();
    let sigma = open_image(&s.path("m-uncertainty.fits")).unwrap();
    assert!(model.unit == BrightnessUnit::Kelvin && model.data.iter().all(|v| *v >= 0.0));
    assert!(sigma.data.iter().all(|v| *v >= 0.0 && *v < 400.0));
    assert!(model.history.iter().any(|h| h.contains("mem vis.uvh5")), "{:?}", model.history);
    assert!(s.names().iter().all(|n| !n.contains("tmp")), "{:?}", s.names());
}

#[test]
fn a_known_flux_a_pedestal_other_entropies_and_channels() {
    let s = observed("--pedestal none");
    let total = scene().sum() * CELL * CELL;
    let json = s.json(&format!("mem vis.uvh5 {IMAGE} --prior 150K --flux {total}Ksr -o f"));
    assert!(number(&json, "flux_error") < 1e-3 && json["flux_constrained"] == true, "{json}");
    assert!((number(&json, "model_flux") / total - 1.0).abs() < 1e-3);
    for extra in
        ["--entropy gull-skilling", "--entropy log --kkt 0.02", "--total-variation 0.1", "--l1 0.05", "--uncertainty 2", "--prior smoothed"]
    {
        let json = s.json(&format!("mem vis.uvh5 {IMAGE} {extra} --overwrite -o e"));
        assert!((number(&json, "chi2_per_datum") - 1.0).abs() < 0.01 && json["met"] == true, "{extra}: {json}");
    }
    let json = s.json(&format!("mem vis.uvh5 {IMAGE} --channels-out 2 --prior 250K --uncertainty none -o c"));
    assert_eq!(json["channels"].as_array().unwrap().len(), 2);
    assert_eq!(open_image(&s.path("c-model.fits")).unwrap().data.shape()[0], 2);
    let p = observed("--pedestal auto");
    p.ok(&format!("mem vis.uvh5 {IMAGE} --prior 250K -o p"));
    assert!(error_of(&p, "p-model.fits") < 0.15, "{}", error_of(&p, "p-model.fits"));
}

#[test]
fn noise_that_the_file_does_not_know_is_estimated_from_two_hands_or_asked_for() {
    let s = observed("--pedestal none --pols XX,YY");
    let mut source = open_visibilities(&s.path("vis.uvh5")).unwrap();
    let sigma = {
        let mut weight = 0.0;
        for_each_block(source.as_mut(), 64 << 20, |_, b: VisibilityBlock| -> Result<(), cittert_arrays::ArrayError> {
            weight = f64::from(b.weights[(0, 0, 0)]);
            Ok(())
        })
        .unwrap();
        (0.5 / weight).sqrt()
    };
    let mut sink = create_visibilities(&s.path("counts.uvh5"), source.header(), false).unwrap().sink;
    for_each_block(source.as_mut(), 64 << 20, |_, mut block| -> Result<(), cittert_arrays::ArrayError> {
        block.weights.fill(1.0);
        block.nsamples.fill(1.0);
        sink.write_block(&block)
    })
    .unwrap();
    sink.finish().unwrap();
    let said = s.ok(&format!("mem counts.uvh5 {IMAGE} --prior 250K -o a"));
    assert!(said.err.contains("counts of samples"), "{}", said.err);
    assert!(error_of(&s, "a-model.fits") < 0.15, "{}", error_of(&s, "a-model.fits"));
    s.ok(&format!("mem counts.uvh5 {IMAGE} --prior 250K --noise {sigma}Ksr -o b"));
    let (a, b) = (open_image(&s.path("a-model.fits")).unwrap(), open_image(&s.path("b-model.fits")).unwrap());
    let apart = (&a.plane(0, 0) - &b.plane(0, 0)).mapv(|v| v * v).sum().sqrt() / b.plane(0, 0).mapv(|v| v * v).sum().sqrt();
    assert!(apart < 0.02, "{apart}");
}

#[test]
fn an_image_is_judged_by_baselines_that_it_was_not_made_from() {
    let s = observed("");
    let mem = |name: &str, options: &str| -> Value {
        serde_json::from_str(&s.ok(&format!("--json mem vis.uvh5 {IMAGE} -o {name} {options}")).out).unwrap()
    };
    let judged = mem("a", "");
    assert!(number(&judged["held_out"], "baselines") == 170.0 && number(&judged["held_out"], "misfit") < 0.02, "{judged}");
    assert!(mem("b", "--hold-out 0")["held_out"].is_null());
    // The second image leaves the first as it is.
    let (a, b) = (open_image(&s.path("a-model.fits")).unwrap(), open_image(&s.path("b-model.fits")).unwrap());
    assert_eq!(a.data, b.data);
}

#[test]
fn a_set_without_noise_gives_an_image_too() {
    for hands in ["", "--pols XX,YY"] {
        let s = simulated(hands);
        let said = s.run(&format!("--json mem vis.uvh5 {IMAGE} -o m"));
        let json: Value = serde_json::from_str(&said.out).unwrap();
        assert!(said.code == 0 && said.err.contains("is assumed"), "{}", said.err);
        assert_eq!(json["findings"].as_array().unwrap().len(), 0, "{json}");
        assert!(number(&json["residuals"], "unexplained") < 3e-4, "{json}");
        assert!(error_of(&s, "m-model.fits") < 0.15, "{}", error_of(&s, "m-model.fits"));
    }
}

#[test]
fn constraints_that_are_not_met_keep_the_image_and_fail() {
    let s = observed("--pedestal none");
    let said = s.run(&format!("--json mem vis.uvh5 {IMAGE} --prior 250K --niter 3 -o m"));
    let json: Value = serde_json::from_str(&said.out).unwrap();
    assert!(json["verdict"].as_str().unwrap().starts_with("doubtful"), "{json}");
    assert!(said.code == 1 && json["met"] == false && said.err.contains("not met") && said.err.contains("--niter"), "{}", said.err);
    assert!(s.path("m-model.fits").exists() && s.path("m-image.fits").exists());
}

#[test]
fn what_no_image_can_meet_is_refused() {
    let s = observed("--pedestal none");
    let mem = format!("mem vis.uvh5 {IMAGE} -o m");
    for (extra, code, word) in [
        ("--prior 0K", 1, "--prior"),
        ("--prior=-5K", 1, "--prior"),
        ("--prior 250", 2, "--prior"),
        ("--prior nothing.fits", 2, "--prior"),
        ("--flux 0Ksr", 1, "--flux"),
        ("--flux=-1Ksr", 1, "--flux"),
        ("--flux 1Jy", 2, "--flux"),
        ("--noise 0Ksr", 1, "--noise"),
        ("--noise estimate", 1, "two parallel hands"),
        ("--entropy tsallis", 2, "gull-skilling"),
        ("--niter 0", 2, "--niter"),
        ("--l1=-1", 2, "--l1"),
        ("--uncertainty some", 2, "--uncertainty"),
    ] {
        s.fails(&format!("{mem} {extra}"), code, &[word]);
        assert!(!s.path("m-model.fits").exists(), "{extra}");
    }
    let black = Array2::zeros((SIDE, SIDE));
    write(&s, "black.fits", &black, BrightnessUnit::Kelvin);
    s.fails(&format!("{mem} --mask black.fits"), 1, &["mask", "no pixel"]);
    s.fails(&format!("{mem} --prior black.fits"), 1, &["--prior", "column 0, row 0"]);
    s.fails("mem vis.uvh5 --size 32 --cell 4mrad --prior scene.fits -o m", 1, &["prior"]);
    let mut source = open_visibilities(&s.path("vis.uvh5")).unwrap();
    let mut sink = create_visibilities(&s.path("flagged.uvh5"), source.header(), false).unwrap().sink;
    for_each_block(source.as_mut(), 64 << 20, |_, mut block| -> Result<(), cittert_arrays::ArrayError> {
        block.flags.fill(true);
        sink.write_block(&block)
    })
    .unwrap();
    sink.finish().unwrap();
    s.fails(&format!("mem flagged.uvh5 {IMAGE} -o m"), 1, &["no usable visibility"]);
}
