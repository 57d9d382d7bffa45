//! Antennas that differ: pointing, widths of patterns, bands of receivers.

use crate::program::Scratch;
use serde_json::Value;

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

const BAND: &str = "--layout mm-ring --freq 94GHz --bandwidth 2GHz --channels 2 --element gaussian --element-width 9deg";

/// A scene of points over the pattern, in Jy.
fn points() -> Scratch {
    let s = Scratch::new();
    let place = |k: u32| (0.06 * f64::from(k * 37 % 100) / 100.0 - 0.03, 0.06 * f64::from(k * 61 % 100) / 100.0 - 0.03);
    let lines: String = (0..30).map(|k| (place(k), 1 + k % 3)).map(|((l, m), s)| format!("{},{},{s}\n", 2.0 * l, 2.0 * m)).collect();
    s.write("s.csv", format!("l_rad,m_rad,flux_jy\n{lines}"));
    s
}

#[test]
fn simulate_and_corrupt_draw_the_same_pointings_and_selfcal_finds_them() {
    let s = points();
    s.ok(&format!("simulate {BAND} --scene s.csv --pointing-rms 0.3deg --width-rms 0.03 --seed 7 -o a.uvh5"));
    s.ok(&format!("simulate {BAND} --scene s.csv -o v.uvh5"));
    s.ok("corrupt v.uvh5 -o c.uvh5 --gains t.calh5 --seed 7 --pointing-rms 0.3deg --width-rms 0.03 --scene s.csv");
    let table = |name: &str| std::fs::read_to_string(s.path(name)).unwrap();
    assert_eq!(table("a-pointing.csv"), table("t-pointing.csv"));
    let same = s.json("compare a-pointing.csv t-pointing.csv");
    assert_eq!(number(&same, "rms_error_rad"), 0.0);
    assert!((number(&same, "rms_truth_rad").to_degrees() / 0.3 - 1.0).abs() < 0.25, "{same}");
    s.ok("corrupt v.uvh5 -o p.uvh5 --gains p.calh5 --seed 7 --pointing-rms 0.3deg --scene s.csv");
    let run = s.json(
        "selfcal p.uvh5 -o sc --model s.csv --solint inf --rounds 1 --deconvolver hogbom --size 128 --cell 1.6mrad --niter 300 --pointing",
    );
    assert_eq!(run["pointing"]["supported"], true, "{run}");
    let found = s.json("compare sc-pointing.csv p-pointing.csv");
    assert!(number(&found, "rms_error_rad") < 0.02 * number(&found, "rms_truth_rad"), "{found}");
}

#[test]
fn bands_wash_fringes_and_their_truth_is_written() {
    let s = points();
    let rms = |name: &str| number(&s.json(&format!("predict {name} --model s.csv --residual -o r.uvh5 --overwrite")), "rms");
    s.ok(&format!("simulate {BAND} --scene s.csv -o v.uvh5"));
    let clean = rms("v.uvh5");
    s.ok(&format!("simulate {BAND} --scene s.csv --band-shape chebyshev:4,0.5 --band-offset-rms 100MHz -o b.uvh5"));
    assert!(rms("b.uvh5") > 100.0 * clean);
    let truth = std::fs::read_to_string(s.path("b-receivers.csv")).unwrap();
    assert!(truth.starts_with("antenna,band_offset_hz,band_width,jitter_s\n"), "{truth}");
    s.write("h.csv", "offset_hz,amplitude,phase_deg\n-5e8,0.5,0\n0,1,10\n5e8,0.8,40\n");
    s.ok(&format!("simulate {BAND} --scene s.csv --band-shape h.csv -o h.uvh5"));
    s.ok("corrupt v.uvh5 -o hc.uvh5 --band-shape h.csv --scene s.csv");
    assert!((rms("h.uvh5") / rms("hc.uvh5") - 1.0).abs() < 1e-3);
    let jitter = s.json("corrupt v.uvh5 -o j.uvh5 --jitter-rms 0.2ps");
    let loss = (-(std::f64::consts::TAU * 94e9 * 0.2e-12_f64).powi(2) / 2.0).exp();
    assert!((number(&jitter, "rms_amplitude") / (1.0 - loss) - 1.0).abs() < 0.01, "{jitter}");
}

#[test]
fn what_is_missing_or_wrong_is_named() {
    let s = points();
    s.ok(&format!("simulate {BAND} --scene s.csv -o v.uvh5"));
    s.ok("simulate --layout mm-ring --freq 94GHz --bandwidth 2GHz --scene s.csv -o bare.uvh5");
    for (command, code, words) in [
        ("corrupt v.uvh5 -o c.uvh5 --pointing-rms 1deg", 2, "--scene is missing"),
        ("corrupt v.uvh5 -o c.uvh5 --phase-rms 1deg --scene s.csv", 2, "leave --scene out"),
        ("corrupt bare.uvh5 -o c.uvh5 --pointing-rms 1deg --scene s.csv", 1, "need a pattern"),
        ("corrupt v.uvh5 -o c.uvh5 --band-shape butterworth:1 --scene s.csv", 1, "2 to 16 poles"),
        ("corrupt v.uvh5 -o c.uvh5 --band-shape missing.csv --scene s.csv", 1, "missing.csv"),
        ("corrupt v.uvh5 -o c.uvh5 --pointing-variation constant", 1, "pointing-rms"),
    ] {
        s.fails(command, code, &[words]);
    }
    assert!(!s.path("c.uvh5").exists());
}
