//! `run`: the whole chain from one file.

use crate::program::Scratch;
use std::path::Path;

const CONFIG: &str = r#"
title = "a small run"
seed = 3
layout = { name = "mm-y" }
scene = { file = "s.csv" }
[simulate]
freq = "94GHz"
bandwidth = "4GHz"
channels = 4
noise = true
[image]
size = 128
cell = "1mrad"
[[clean]]
algorithm = "hogbom"
niter = 200
"#;

fn scratch(config: &str) -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1000000.0\n");
    s.write("c.toml", config);
    s
}

#[test]
fn a_run_leaves_pictures_numbers_and_a_page() {
    let s = scratch(CONFIG);
    s.ok("run c.toml -o out");
    for name in
        ["report.html", "metrics.json", "vis.uvh5", "dirty.fits", "dirty.png", "psf.png", "uv.png", "clean-image.fits", "clean-image.png"]
    {
        assert!(s.path("out").join(name).exists(), "{name}");
    }
    let page = std::fs::read_to_string(s.path("out/report.html")).unwrap();
    assert!(page.contains("data:image/png;base64,") && page.contains("cittert simulate") && page.contains("--seed"));
    let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}"));
    assert!(place("45 antennas (mm-y) observe the scene") < place("data:image/png") && place("data:image/png") < place("<details>"));
    assert!(page.contains("href=\"clean-image.png\"") && page.contains("Peak brightness") && !page.contains("bmaj_rad"));
    let metrics: serde_json::Value = serde_json::from_slice(&std::fs::read(s.path("out/metrics.json")).unwrap()).unwrap();
    assert!(metrics["clean"]["hogbom"]["iterations"].as_u64().unwrap() > 0, "{metrics}");
    assert_eq!(s.names(), ["c.toml", "out", "s.csv"]);
}

/// Leakages of the feeds are injected and solved in one run.
#[test]
fn a_run_solves_leakages() {
    let s = Scratch::new();
    s.write("s.csv", "ra_deg,dec_deg,flux_jy,q_jy,u_jy,v_jy\n202.78,30.51,1,0.2,-0.1,0.05\n");
    s.write(
        "c.toml",
        r#"
title = "leaking feeds"
layout = { name = "vla-d" }
scene = { file = "s.csv" }
seed = 5
[simulate]
freq = "1.4GHz"
bandwidth = "50MHz"
phase-center = "202.78deg,30.51deg"
hour-angle = "-2h,2h"
integration = "30min"
pols = ["RR", "RL", "LR", "LL"]
mount = "alt-az"
sefd = "400Jy"
[corrupt]
leakage-rms = 0.05
cross-phase = "40deg"
[image]
size = 64
cell = "10arcsec"
[selfcal]
model = "s.csv"
solve = ["leakage", "cross-phase"]
solint = "inf"
rounds = 1
"#,
    );
    let said = s.ok("run c.toml --check").out;
    assert!(said.contains("--solve=leakage") && said.contains("--solve=cross-phase"), "{said}");
    s.ok("run c.toml -o out");
    let metrics: serde_json::Value = serde_json::from_slice(&std::fs::read(s.path("out/metrics.json")).unwrap()).unwrap();
    let number = |key: &str| metrics["selfcal"]["feeds"][key].as_f64().unwrap();
    // Within the noise: five standard deviations of the phase.
    let off = number("cross_phase_rad") - 40_f64.to_radians();
    assert!(off.abs() < 5.0 * number("cross_phase_sigma_rad"), "{metrics}");
    assert!((number("leakage_rms") - 0.05).abs() < 0.01 && number("reduced_chi2") < 1.1, "{metrics}");
    assert!(std::fs::read_to_string(s.path("out/report.html")).unwrap().contains("Phase between the feeds"));
}

/// Errors of a whole run and what self-calibration brings back, with the three images beside each other.
#[test]
fn a_run_corrupts_and_calibrates() {
    let more = "[corrupt]\nphase-rms = \"40deg\"\n[selfcal]\nstart = \"point\"\nsolint = \"inf\"\nrounds = 2\nnsigma = 3.0\n";
    let s = scratch(&format!("{CONFIG}{more}"));
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1000000.0\n");
    let said = s.ok("run c.toml --check").out;
    for words in
        ["corrupt OUT/vis.uvh5", "--phase-rms=40deg", "--seed=3", "selfcal OUT/corrupted.uvh5", "--nsigma=3.0", "--algorithm=hogbom"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    s.ok("run c.toml -o out");
    for name in [
        "truth.calh5",
        "corrupted.uvh5",
        "selfcal.calh5",
        "corrupted-image.png",
        "selfcal-image.png",
        "selfcal-gains.png",
        "selfcal-fit.png",
    ] {
        assert!(s.path("out").join(name).exists(), "{name}");
    }
    let metrics: serde_json::Value = serde_json::from_slice(&std::fs::read(s.path("out/metrics.json")).unwrap()).unwrap();
    let range = |v: &serde_json::Value| v["dynamic_range"].as_f64().unwrap();
    assert!(range(&metrics["selfcal"]) > 3.0 * range(&metrics["clean"]["corrupted"]), "{metrics}");
    assert!(metrics["compare"]["gains"]["rms_phase_rad"].as_f64().unwrap() < 0.05, "{metrics}");
    let page = std::fs::read_to_string(s.path("out/report.html")).unwrap();
    assert!(page.contains("Errors and self-calibration") && page.contains("Image after self-calibration."));
    assert!(
        page.contains("The data then got phase errors of") && page.contains("Self-calibration was accepted. It leaves phase errors of")
    );
}

/// The quality that a configuration states: met, missed (the folder is kept, the exit code is 1), and of a step that the run does not have.
#[test]
fn a_run_that_misses_its_quality_fails_and_keeps_its_folder() {
    let with = |limit: &str| format!("{CONFIG}[quality]\n\"clean.hogbom.dynamic_range\" = {{ {limit} }}\n");
    let s = scratch(&with("at-least = 20"));
    assert!(s.ok("run c.toml -o good").out.contains("at least 20 is wanted: met"));
    s.write("c.toml", with("at-least = 1e9"));
    s.fails("run c.toml -o bad", 1, &["clean.hogbom.dynamic_range is", "at least"]);
    let metrics: serde_json::Value = serde_json::from_slice(&std::fs::read(s.path("bad/metrics.json")).unwrap()).unwrap();
    let entry = &metrics["quality"]["clean.hogbom.dynamic_range"];
    assert_eq!((&entry["met"], &entry["found"]), (&serde_json::json!(false), &metrics["clean"]["hogbom"]["dynamic_range"]));
    assert!(s.path("bad/report.html").exists());
    s.write("c.toml", with("at-least = 20").replace("clean.hogbom", "clean.clark"));
    s.fails("run c.toml -o no", 1, &["clean.clark.dynamic_range", "clean.hogbom"]);
    s.write("c.toml", with(""));
    s.fails("run c.toml -o no", 1, &["at-least or at-most"]);
}

#[test]
fn a_layout_is_made_by_its_options() {
    let s = scratch(
        &CONFIG
            .replace("name = \"mm-y\"", "make = { kind = \"log-spiral\", elements = 20, aperture = \"0.4m\", arms = 4, sefd = \"1kJy\" }"),
    );
    let said = s.ok("run c.toml --check").out;
    assert!(
        said.contains("cittert layout make log-spiral --aperture=0.4m --arms=4 --elements=20 --sefd=1kJy -o OUT/layout.toml"),
        "{said}"
    );
    let metrics = s.json("run c.toml -o out");
    assert_eq!(metrics["layout"]["n_antennas"], 20);
    let made = s.json("layout show out/layout.toml");
    assert!((made["longest_m"].as_f64().unwrap() - 0.4).abs() < 1e-9);
    for (from, to, words) in [
        ("log-spiral", "ring", vec!["wrong.toml", "layout.make", "arms is 4", "no such option"]),
        ("log-spiral", "circle", vec!["layout.make", "circle", "reuleaux"]),
        ("0.4m", "0.4", vec!["wrong.toml", "line 4", "no unit"]),
        ("arms", "spokes", vec!["wrong.toml", "line 4", "spokes", "`arms`"]),
        ("make = ", "name = \"mm-y\", make = ", vec!["give name, or make", "not both"]),
    ] {
        let text = std::fs::read_to_string(s.path("c.toml")).unwrap();
        s.write("wrong.toml", text.replace(from, to));
        s.fails("run wrong.toml -o no", 1, &words);
    }
}

#[test]
fn a_wrong_key_points_at_its_line() {
    let s = scratch(&CONFIG.replace("niter = 200", "niterations = 200"));
    s.fails("run c.toml -o out", 1, &["c.toml", "line 16", "niterations"]);
    assert!(!s.path("out").exists());
}

#[test]
fn the_examples_are_valid() {
    let s = Scratch::new();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/examples");
    for name in ["airport.toml", "blind-selfcal.toml", "first-light.toml", "millimetre-imager.toml"] {
        s.ok(&format!("run {} --check", examples.join(name).display()));
    }
    for name in ["blind-study.toml", "layout-study.toml", "phase-study.toml"] {
        s.ok(&format!("study {} --check", examples.join(name).display()));
    }
}
