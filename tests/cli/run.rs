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
    let metrics: serde_json::Value = serde_json::from_slice(&std::fs::read(s.path("out/metrics.json")).unwrap()).unwrap();
    assert!(metrics["clean"]["hogbom"]["iterations"].as_u64().unwrap() > 0, "{metrics}");
    assert_eq!(s.names(), ["c.toml", "out", "s.csv"]);
}

#[test]
fn a_wrong_key_points_at_its_line() {
    let s = scratch(&CONFIG.replace("niter = 200", "niterations = 200"));
    s.fails("run c.toml -o out", 1, &["c.toml", "line 16", "niterations"]);
    assert!(!s.path("out").exists());
}

#[test]
fn the_examples_are_valid_and_the_schema_is_current() {
    let s = Scratch::new();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/examples");
    let schema = s.ok("run --schema").out;
    let stored = std::fs::read_to_string(examples.join("run.schema.json")).unwrap();
    assert_eq!(schema.trim(), stored.trim(), "write it anew: cittert run --schema > docs/examples/run.schema.json");
    for name in ["first-light.toml", "millimetre-imager.toml"] {
        s.ok(&format!("run {} --check", examples.join(name).display()));
    }
}
