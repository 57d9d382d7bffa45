//! Messages name the file that is wrong, also where its error is found late.

use crate::program::Scratch;

const IMAGE: &str = "--size 32 --cell 1mrad";
const BAND: &str = "--freq 94GHz --bandwidth 1GHz";

fn set() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.002,0.001,1\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --sefd 10Jy -o v.uvh5");
    s
}

#[test]
fn impossible_coordinates_are_refused_with_the_row() {
    let s = set();
    s.ok("convert v.uvh5 v.uvfits");
    let mut bytes = std::fs::read(s.path("v.uvfits")).unwrap();
    let at = bytes.windows(10).position(|w| w == b"PSCAL1  = ").unwrap() + 10;
    bytes[at..at + 20].copy_from_slice(b"              1.E200");
    s.write("far.uvfits", bytes);
    for command in ["beam --weighting uniform", "dirty", "grid"] {
        s.fails(&format!("{command} far.uvfits {IMAGE} -o o.fits"), 1, &["far.uvfits", "row"]);
    }
}

#[test]
fn masks_and_priors_are_named() {
    let s = set();
    s.ok(&format!("dirty v.uvh5 {IMAGE} -o d.fits"));
    s.ok(&format!("clean v.uvh5 {IMAGE} --niter 10 -o m"));
    // The model has pixels of 0, which no prior may have.
    s.fails(&format!("mem v.uvh5 {IMAGE} --prior m-model.fits -o q"), 1, &["m-model.fits", "prior"]);
    let mut bytes = std::fs::read(s.path("m-model.fits")).unwrap();
    let data = bytes.len() - 2880 * (32_usize * 32 * 4).div_ceil(2880);
    bytes[data..].fill(0);
    s.write("empty.fits", bytes);
    s.fails(&format!("clean v.uvh5 {IMAGE} --mask empty.fits -o o"), 1, &["empty.fits", "no pixel"]);
}

#[test]
fn a_layout_without_a_baseline_is_named() {
    let s = set();
    s.write("one.toml", "name = \"x\"\nframe = \"boresight\"\n[[antenna]]\nname = \"A\"\nposition_m = [0.0, 0.0, 0.0]\n");
    for call in [format!("simulate --layout one.toml --scene s.csv {BAND} -o o.uvh5"), "layout show one.toml --freq 94GHz".into()] {
        s.fails(&call, 1, &["one.toml", "is 1, expected at least two"]);
    }
    // Its place alone can be shown.
    s.ok("layout show one.toml");
}

#[test]
fn an_antenna_beyond_all_arrays_is_refused() {
    let s = set();
    let antenna = |name: &str, x: &str| format!("[[antenna]]\nname = \"{name}\"\nposition_m = [{x}, 0.0, 0.0]\n");
    s.write(
        "far.toml",
        format!("name = \"x\"\nframe = \"boresight\"\n{}{}{}", antenna("A", "0.0"), antenna("B", "1.0"), antenna("C", "1e300")),
    );
    s.fails("layout show far.toml --freq 94GHz", 1, &["far.toml", "\"C\""]);
}

#[test]
fn errors_of_a_file_that_are_too_large_are_not_those_of_an_option() {
    let s = set();
    s.write("x.toml", "[[error]]\namp-rms = 1e29\n");
    let said = s.fails("corrupt v.uvh5 --config x.toml -o o.uvh5", 1, &["x.toml", "kind amplitude"]);
    assert!(!said.contains("--amplitude"), "{said}");
}

#[test]
fn a_scene_too_bright_for_imaging_is_refused() {
    let s = set();
    s.write("big.csv", "l_rad,m_rad,flux_jy\n0,0,1e25\n");
    s.fails(&format!("simulate --layout mm-y --scene big.csv {BAND} -o o.uvh5"), 1, &["big.csv", "above 1e19"]);
    assert!(!s.path("o.uvh5").exists());
}

#[test]
fn losses_are_told_by_every_command_that_changes_the_format() {
    let s = set();
    s.ok("convert v.uvh5 v.uvfits");
    for (call, out) in [("corrupt v.uvfits --phase-rms 1deg --seed 1", "c.uvh5"), ("applycal v.uvfits c.calh5", "a.uvh5")] {
        let converted = s.json("convert v.uvfits k.uvh5 --overwrite")["lost"].clone();
        assert!(converted.is_array());
        assert_eq!(s.json(&format!("{call} -o {out}"))["lost"], converted, "{call}");
    }
}

#[test]
fn a_replacement_waits_for_a_change_in_place() {
    let s = set();
    // The lock that a command takes which changes the file in place.
    let lock = std::fs::File::create(s.path(".v.uvh5.lock")).unwrap();
    lock.lock().unwrap();
    let simulate = format!("simulate --layout mm-y --scene s.csv {BAND} -o v.uvh5 --overwrite");
    s.fails(&simulate, 1, &["v.uvh5", "another process"]);
    drop(lock);
    s.ok(&simulate);
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn a_value_that_an_axis_replaces_is_checked_all_the_same() {
    let s = set();
    let study = "title = \"x\"\nseeds = 1\nlayout = { name = \"mm-y\" }\nscene = { file = \"s.csv\" }\n[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n\
                 [image]\nsize = 32\ncell = \"1mrad\"\n[corrupt]\nphase-rms = \"nandeg\"\n[[axis]]\nparameter = \"corrupt.phase-rms\"\nvalues = [\"10deg\"]\n";
    s.write("u.toml", study);
    s.fails("study --check u.toml", 1, &["u.toml", "nandeg"]);
    s.write("u.toml", study.replace("nandeg", "5deg"));
    s.ok("study --check u.toml");
}

#[test]
fn a_layout_that_a_format_cannot_hold_and_an_empty_file_of_errors_are_named() {
    let s = set();
    s.ok("layout make ring --elements 3 --aperture 1m -o bare.toml");
    s.fails("layout convert bare.toml -o o.cfg", 1, &["bare.toml", "boresight"]);
    s.write("none.toml", "seed = 3\n");
    s.fails("corrupt v.uvh5 --config none.toml -o c.uvh5", 2, &["none.toml", "[[error]]"]);
}
