//! What the page shows is what the command line makes.

use super::{Designer, Shown, airport, program, ring};
use cittert_formats::open_image;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// Run a script in an empty folder, with the program under test in the path.
fn run_script(script: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let own = Path::new(program().get_program()).parent().unwrap().to_owned();
    let path = format!("{}:{}", own.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(folder.path()).env("PATH", path).env("HDF5_USE_FILE_LOCKING", "FALSE");
    let said = command.output().unwrap();
    // An image of maximum entropy that misses a constraint is kept, and the command says so.
    let text = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success() || text.contains("The last image is kept"), "{script}\n{text}");
    folder
}

/// Compare an image of the page with the file that the command has written, pixel by pixel.
fn same(shown: &Shown, name: &str, folder: &Path, file: &str) {
    let (answer, image) = (&shown[name], open_image(&folder.join(file)).unwrap());
    let header = &answer.header;
    assert_eq!((header["columns"].as_u64(), header["rows"].as_u64()), (Some(image.grid.n_l as u64), Some(image.grid.n_m as u64)), "{name}");
    let cell = header["cell_rad"].as_f64().unwrap();
    assert!((cell / image.grid.cell_rad - 1.0).abs() < 1e-12, "{name}: {cell} {}", image.grid.cell_rad);
    assert_eq!(header["unit"], image.unit.bunit(), "{name}");
    let plane: Vec<f32> = image.plane(0, 0).iter().map(|v| *v as f32).collect();
    assert!(plane.iter().any(|v| *v != 0.0), "{name} is empty");
    let largest = plane.iter().fold(0.0_f32, |a, v| a.max(v.abs()));
    let worst = plane.iter().zip(&answer.numbers).fold(0.0_f32, |a, (x, y)| a.max((x - y).abs()));
    assert!(plane.len() == answer.numbers.len() && worst <= 1e-6 * largest, "{name}: off by {worst} of {largest}");
}

fn script(shown: &Shown) -> String {
    assert!(!shown.contains_key("error"), "{}", shown["error"].header);
    shown["commands"].header["script"].as_str().unwrap().to_owned()
}

#[test]
fn the_printed_commands_make_the_images_of_the_page() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = airport(16, 64);
    state["simulate"]["sefd"] = "1e6Jy".into();
    state["simulate"]["integration"] = "1s".into();
    state["clean"] = json!({ "niter": 200 });
    state["mem"] = json!({});
    let shown = tab.show(&state, false);
    let folder = run_script(&script(&shown));
    for (name, file) in [("psf", "psf.fits"), ("dirty", "dirty.fits"), ("clean", "clean-image.fits"), ("mem", "mem-model.fits")] {
        same(&shown, name, folder.path(), file);
    }
    state["mem"] = json!({ "niter": 2 });
    let cut_short = tab.show(&state, false);
    let missed = cut_short["mem"].header["missed"].as_str().unwrap();
    assert!(missed.contains("chi2/N is") && missed.contains("evaluations"), "{missed}");
}

#[test]
fn a_point_and_errors_that_are_calibrated_are_the_same_too() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = json!({
        "layout": ring(12, 0.25), "seed": 5, "simulate": { "freq": "94GHz", "bandwidth": "2GHz", "sefd": "1e3Jy" },
        "image": { "size": 48, "weighting": "natural" },
        "corrupt": { "phase-rms": "40deg", "amp-rms": 0.05, "position-rms": "20um" },
    });
    let shown = tab.show(&state, false);
    let folder = run_script(&script(&shown));
    same(&shown, "psf", folder.path(), "psf.fits");
    same(&shown, "dirty", folder.path(), "dirty.fits");
    assert_eq!(shown["closures"].header["names"].as_array().unwrap().len(), 55);
    state["selfcal"] = json!({ "solint": "inf" });
    state["clean"] = json!({ "niter": 100 });
    let shown = tab.show(&state, false);
    let folder = run_script(&script(&shown));
    for (name, file) in [("psf", "psf.fits"), ("dirty", "dirty.fits"), ("clean", "clean-image.fits")] {
        same(&shown, name, folder.path(), file);
    }
    // Gains differ between antennas only, so closure phases do not show them; moved antennas change them a little.
    let closures = &shown["closures"].header;
    let list = |key: &str| closures[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    let turned = |a: f64, b: f64| (a - b).sin().atan2((a - b).cos()).abs();
    assert!(list("true_rad").iter().zip(list("observed_rad")).all(|(a, b)| turned(*a, b) < 1e-3));
    // Calibration brings the phases nearer to the true ones, up to a shift of the sky.
    let gains = &shown["gains"].header;
    let phases: Vec<f64> = gains["true"]["phase_rad"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let mean = phases.iter().sum::<f64>() / 12.0;
    let rms = (phases.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 12.0).sqrt();
    assert!(gains["accepted"] == true && gains["left"]["rms_phase_rad"].as_f64().unwrap() < rms, "{rms}: {gains}");
}

#[test]
fn a_track_over_a_site_is_the_same() {
    let d = Designer::start(&["vla-d"]);
    let mut tab = d.tab();
    let layout = tab.ask(&json!({ "do": "builtin", "name": "vla-d" }), "layout")["layout"].clone();
    let state = json!({
        "layout": layout, "scene": { "file": "points.csv" }, "image": { "size": 64, "weighting": "briggs", "robust": 0.5 },
        "simulate": { "freq": "1.4GHz", "bandwidth": "64MHz", "phase-center": "180deg,45deg", "hour-angle": "-1h,1h", "integration": "300s" },
    });
    let shown = tab.show(&state, false);
    let folder = run_script(&script(&shown));
    same(&shown, "psf", folder.path(), "psf.fits");
    same(&shown, "dirty", folder.path(), "dirty.fits");
}

#[test]
fn the_figures_are_those_of_layout_show() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let shown = tab.show(&airport(16, 32), false);
    let figures = &shown["figures"].header["figures"];
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("layout.toml"), shown["commands"].header["layout"].as_str().unwrap()).unwrap();
    let said = program().args(["--json", "layout", "show", "layout.toml", "--freq=94GHz"]).current_dir(folder.path()).output().unwrap();
    let printed: Value = serde_json::from_slice(&said.stdout).unwrap();
    let shared: Vec<_> = figures.as_object().unwrap().iter().filter(|(key, _)| printed.get(key).is_some()).collect();
    assert!(shared.len() > 30, "{}", shared.len());
    for (key, value) in shared {
        assert_eq!(*value, printed[key], "{key}");
    }
}

#[test]
fn the_file_of_run_runs() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = airport(12, 32);
    state["corrupt"] = json!({ "phase-rms": "20deg" });
    state["selfcal"] = json!({ "solint": "inf", "force": true });
    let shown = tab.show(&state, false);
    let commands = &shown["commands"].header;
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &Value| std::fs::write(folder.path().join(name), text.as_str().unwrap()).unwrap();
    write("layout.toml", &commands["layout"]);
    write("run.toml", &commands["run"]);
    for need in commands["needs"].as_array().unwrap() {
        write(need["name"].as_str().unwrap(), &need["text"]);
    }
    let said = program().args(["-q", "run", "run.toml", "-o", "out"]).current_dir(folder.path()).output().unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    same(
        &{
            let mut s = state;
            s["corrupt"] = json!({});
            s.as_object_mut().unwrap().remove("selfcal");
            tab.show(&s, false)
        },
        "dirty",
        folder.path(),
        "out/dirty.fits",
    );
}
