//! Patterns of elements from files: tables as CSV and FITS, and beam files that pyuvdata wrote.

use cittert_arrays::ElementPattern;
use cittert_formats::layouts::read_layout;
use cittert_formats::read_pattern;
use std::path::{Path, PathBuf};

fn beams(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/beams").join(name)
}

/// Values at the samples of the files, by pyuvdata: the pattern passes through its samples.
#[test]
fn beam_files_have_the_power_that_pyuvdata_finds_in_them() {
    let read = |name: &str| read_pattern(&beams(&format!("{name}.beamfits.gz"))).unwrap();
    let patterns = [("airy-efield", read("airy-efield")), ("dipole-power", read("dipole-power"))];
    let text = std::fs::read_to_string(beams("beams.csv")).unwrap();
    let mut count = 0;
    for line in text.lines().filter(|l| !l.starts_with('#')).skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let n = |k: usize| fields[k].parse::<f64>().unwrap();
        let pattern = &patterns.iter().find(|(name, _)| *name == fields[0]).unwrap().1;
        let (za, az) = (n(2).to_radians(), n(3).to_radians());
        let found = pattern.power(za.sin() * az.cos(), za.sin() * az.sin(), n(1));
        assert!((found - n(4)).abs() < 1e-9, "{line}: {found}");
        count += 1;
    }
    assert_eq!(count, 2 * 3 * 6 * 3);
    // The response of a dipole along l to a wave from the direction of l falls with the cosine, and stays for a wave from m.
    let dipole = &patterns[1].1;
    assert!((dipole.power(0.5, 0.0, 9.5e9) - 0.75).abs() < 1e-3 && (dipole.power(0.0, 0.5, 9.5e9) - 1.0).abs() < 1e-3);
    assert!(dipole.check_band((9e9, 10e9)).is_ok() && dipole.check_band((8.9e9, 10e9)).is_err());
}

#[test]
fn a_layout_names_a_table_in_a_file_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("horn.csv"),
        "# measured\nTheta_deg,power_db,freq_ghz\n0,3,90\n5,0,90\n10,-7,90\n0,3,98\n5,-1,98\n10,-9,98\n",
    )
    .unwrap();
    let layout = |file: &str| {
        let text = "name = \"x\"\nframe = \"boresight\"\n[pattern]\nkind = \"sampled\"\nfile = \"FILE\"\n[[antenna]]\nname = \"A\"\nposition_m = [0.0, 0.0, 0.0]\n";
        let path = dir.path().join("x.toml");
        std::fs::write(&path, text.replace("FILE", file)).unwrap();
        read_layout(&path, None)
    };
    let pattern = layout("horn.csv").unwrap().pattern;
    let at = |degrees: f64, freq_hz: f64| pattern.power(degrees.to_radians().sin(), 0.0, freq_hz);
    assert!((at(5.0, 90e9) - 10f64.powf(-0.3)).abs() < 1e-12 && (at(10.0, 98e9) - 10f64.powf(-1.2)).abs() < 1e-12);
    assert!((at(5.0, 94e9) - 0.5 * (10f64.powf(-0.3) + 10f64.powf(-0.4))).abs() < 1e-12 && at(11.0, 94e9) == 0.0);
    let missing = layout("other.csv").unwrap_err();
    let causes = std::error::Error::source(&missing).map(ToString::to_string).unwrap_or_default();
    assert!(causes.contains("other.csv") && causes.contains("line"), "{causes}");
}

#[test]
fn files_that_hold_no_pattern_say_what_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let say = |text: &str| {
        let path = dir.path().join("p.csv");
        std::fs::write(&path, text).unwrap();
        read_pattern(&path).unwrap_err().to_string()
    };
    assert!(say("theta_deg,gain\n0,1\n").contains("power_db"));
    assert!(say("theta_deg,power\n0,1\n1,x\n").contains("line 3, power"));
    assert!(say("theta_deg,power\n0,1\n1\n").contains("fields"));
    assert!(say("theta_deg,power,freq_ghz\n0,1,90\n1,1,90\n0,1,91\n").contains("need 4"));
    assert!(matches!(read_pattern(&beams("airy-efield.beamfits.gz")).unwrap(), ElementPattern::Sampled(_)));
}
