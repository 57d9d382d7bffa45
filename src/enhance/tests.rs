//! What holds for every step of the table.

use super::*;
use crate::Result;
use cittert_arrays::BrightnessUnit;
use ndarray::{Array2, s};
use std::fmt::Write;
use std::path::Path;

/// A step with the values that it needs and defaults for the rest.
fn text(kind: &StepKind) -> String {
    let needed: Vec<&str> = kind
        .parameters
        .iter()
        .take_while(|p| p.default.is_none())
        .map(|p| match (p.range, p.name) {
            (_, "high") => "285K",
            (_, "low") => "275K",
            (range, _) if range.is_level() => "1K",
            _ => "1.5",
        })
        .collect();
    if needed.is_empty() { kind.name.to_owned() } else { format!("{}={}", kind.name, needed.join(":")) }
}

fn psf() -> Psf {
    Psf::new(Array2::from_shape_fn((7, 7), |(r, c)| (-(r as f64 - 3.0).powi(2) - (c as f64 - 3.0).powi(2)).exp()).view(), 1e-3).unwrap()
}

fn run(steps: &str, frame: &Array2<f64>) -> Result<Array2<f64>> {
    let psf = psf();
    let steps: StepList = steps.parse().unwrap();
    steps.chain(&Setting { unit: BrightnessUnit::Kelvin, cell_rad: 1e-3, psf: Some(&psf) })?.apply(vec![frame.clone()])
}

fn scene() -> Array2<f64> {
    let disc = |(r, c): (usize, usize)| if (r as f64 - 30.0).hypot(c as f64 - 40.0) < 12.0 { 20.0 } else { 0.0 };
    samples::noise(61, 83, 1) + Array2::from_shape_fn((61, 83), disc) + 270.0
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let scene = scene();
    let in_pool = |threads: usize, steps: &str| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| run(steps, &scene).unwrap())
    };
    for kind in STEPS {
        let (one, three) = (in_pool(1, &text(kind)), in_pool(3, &text(kind)));
        assert!(one.iter().zip(&three).all(|(a, b)| a.to_bits() == b.to_bits()), "{}", kind.name);
    }
}

#[test]
fn a_flat_frame_stays_flat_and_a_blank_pixel_is_refused() {
    for kind in STEPS {
        let flat = Array2::from_elem((40, 50), 280.0);
        let out = run(&text(kind), &flat).unwrap();
        assert!(out.iter().all(|v| (v - 280.0).abs() < 1e-9), "{}", kind.name);
        let mut blank = flat;
        blank[[3, 4]] = f64::INFINITY;
        assert!(run(&text(kind), &blank).unwrap_err().to_string().contains("blank"), "{}", kind.name);
    }
}

#[test]
fn filters_and_equalisation_stay_in_the_range_of_the_frame() {
    let scene = scene();
    let (low, high) = border::range(scene.view());
    let kept = ["average", "median", "wiener", "bilateral", "nl-means", "tv", "bilinear", "bandpass", "equalize", "clahe", "hybrid"];
    for kind in STEPS.iter().filter(|k| kept.contains(&k.name)) {
        let (least, most) = border::range(run(&text(kind), &scene).unwrap().view());
        assert!(least >= low - 1e-9 && most <= high + 1e-9, "{}: {least} {most}", kind.name);
    }
}

/// What is in the middle of the frame is neither dimmed nor brightened by the steps that only move or spread it.
#[test]
fn the_mean_is_kept_away_from_the_border() {
    let with = |patch: &Array2<f64>| {
        let mut frame = Array2::from_elem((96, 96), 280.0);
        frame.slice_mut(s![32..64, 32..64]).assign(&(patch + 280.0));
        frame
    };
    let excess = |steps: &str, frame: &Array2<f64>| {
        let out = run(steps, frame).unwrap();
        let share = frame.len() as f64 / out.len() as f64;
        (out - 280.0).sum() * share
    };
    let mut rough = Array2::zeros((32, 32));
    rough.slice_mut(s![8..24, 8..24]).assign(&(samples::noise(16, 16, 2) * 10.0));
    // The series reaches the border from a patch with frequencies near the limit of the pixels.
    let smooth = gaussian(rough.view(), 2.0);
    // Within 1e-6 of the temperature of the patch, as the mean over its 256 pixels.
    let most = 1e-6 * 280.0 * 256.0;
    for steps in ["bilinear=3", "bicubic=2", "bicubic=4:-0.75", "lanczos=2", "lanczos=3:4", "unsharp", "laplacian", "tv=1K"] {
        let found = excess(steps, &with(&rough));
        assert!((found - rough.sum()).abs() < most, "{steps}: {found} {}", rough.sum());
    }
    for steps in ["fourier=2", "fourier=3", "richardson-lucy=5", "wiener-deconvolution"] {
        let found = excess(steps, &with(&smooth));
        assert!((found - smooth.sum()).abs() < most, "{steps}: {found} {}", smooth.sum());
    }
}

#[test]
fn very_small_frames_do_no_harm() {
    for dim in [(2, 2), (2, 9), (5, 3)] {
        let frame = samples::noise(dim.0, dim.1, 3) + 280.0;
        for kind in STEPS {
            let out = run(&text(kind), &frame).unwrap();
            assert!(out.iter().all(|v| v.is_finite()), "{} {dim:?}", kind.name);
        }
    }
}

#[test]
fn a_chain_is_printed_as_it_was_written_and_read_from_files() {
    for written in ["median=5,clahe,unsharp=1.5:0.8", "tv=2K", "bandpass=250K:310K,fourier=4", "nl-means=1K:7"] {
        assert_eq!(written.parse::<StepList>().unwrap().to_string(), written);
    }
    // An empty place is the default.
    assert_eq!("clahe=:4".parse::<StepList>().unwrap().to_string(), "clahe=2:4");
    let options: EnhanceOptions =
        toml_free(r#"{"steps": ["median=5", {"step": "unsharp", "amount": 0.5}, {"step": "tv", "weight": "1.5K"}], "target": "1,2,3"}"#);
    assert_eq!(options.steps.unwrap().to_string(), "median=5,unsharp=1.5:0.5,tv=1.5K");
}

fn toml_free(json: &str) -> EnhanceOptions {
    serde_json::from_str(json).unwrap()
}

#[test]
fn wrong_chains_are_refused_with_the_step_and_what_it_takes() {
    for (written, words) in [
        ("", &["no step"][..]),
        ("mediann=3", &["mediann", "the steps are average, median"]),
        ("median=4", &["median", "window", "\"4\"", "odd number from 3"]),
        ("median=3:4", &["at most 1 value", "median[=WINDOW]"]),
        ("bilinear=0", &["factor", "whole number from 2 to 16"]),
        ("lanczos=1.5", &["factor", "1.5"]),
        ("tv", &["tv: its weight is missing", "tv=WEIGHT[:ITERATIONS]"]),
        ("tv=-1K", &["above 0"]),
        ("tv=1kg", &["weight", "0.5K"]),
        ("unsharp=nan", &["sigma", "nan"]),
        ("bilateral=2", &["contrast is missing"]),
        ("equalize=3", &["at most 0 values"]),
    ] {
        let said = written.parse::<StepList>().unwrap_err();
        assert!(words.iter().all(|w| said.contains(w)), "{written}: {said}");
    }
    for (json, words) in [
        (r#"{"steps": [{"window": 3}]}"#, &["no name"][..]),
        (r#"{"steps": [{"step": "median", "width": 3}]}"#, &["width", "it has window"]),
        (r#"{"steps": [{"step": "median", "window": 2}]}"#, &["odd number"]),
        (r#"{"steps": []}"#, &["no step"]),
        (r#"{"stepps": "median"}"#, &["stepps"]),
    ] {
        let said = serde_json::from_str::<EnhanceOptions>(json).unwrap_err().to_string();
        assert!(words.iter().all(|w| said.contains(w)), "{json}: {said}");
    }
}

/// The table of steps in the book. Run with CITTERT_BLESS=1 to write it anew.
#[test]
fn the_book_lists_the_steps() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/user/enhance.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (begin, end) = ("<!-- steps -->\n", "<!-- end of steps -->");
    let (before, rest) = page.split_once(begin).unwrap();
    let (_, after) = rest.split_once(end).unwrap();
    let mut table = String::from("| step | what it does | values | source |\n|---|---|---|---|\n");
    for kind in STEPS {
        let of = |p: &Parameter| {
            let range = if p.range.is_level() { "a brightness, such as 2K".into() } else { p.range.to_string() };
            let default = match p.default {
                None | Some("") => String::new(),
                Some(text) => format!(", default {text}"),
            };
            format!("{}: {} ({range}{default})", p.name.to_uppercase(), p.about)
        };
        let values: Vec<String> = kind.parameters.iter().map(of).collect();
        writeln!(table, "| `{}` | {} | {} | {} |", kind.syntax(), kind.about, values.join("<br>"), kind.source).unwrap();
    }
    let wanted = format!("{before}{begin}{table}{end}{after}");
    if wanted != page && std::env::var_os("CITTERT_BLESS").is_some() {
        std::fs::write(&path, wanted).unwrap();
        return;
    }
    assert!(wanted == page, "run CITTERT_BLESS=1 cargo test the_book_lists_the_steps");
}
