//! Calls that cannot be right.

use crate::program::Scratch;

const BAND: &str = "--freq 94GHz --bandwidth 8GHz --channels 2";

fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s
}

#[test]
fn a_frequency_without_a_unit_names_the_units() {
    let s = scratch();
    s.fails("simulate --layout mm-y --scene s.csv --freq 94 --bandwidth 8GHz -o v.uvh5", 2, &["94", "GHz", "no unit"]);
}

#[test]
fn zero_channels_and_negative_bandwidth_are_refused() {
    let s = scratch();
    s.fails("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 0 -o v.uvh5", 1, &["channels", "0"]);
    s.fails("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth=-8GHz -o v.uvh5", 1, &["bandwidth", "-8"]);
    assert_eq!(s.names(), ["s.csv"]);
}

#[test]
fn image_sizes_of_0_and_a_million_are_refused() {
    let s = scratch();
    s.ok(&format!("simulate --layout mm-y --scene s.csv {BAND} -o v.uvh5"));
    for size in ["0", "1", "1000000"] {
        s.fails(&format!("dirty v.uvh5 --size {size} --cell 1mrad -o d.fits"), 1, &["image size", size]);
    }
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn an_unknown_layout_lists_the_known_ones() {
    scratch().fails(&format!("simulate --layout vla-z --scene s.csv {BAND} -o v.uvh5"), 1, &["vla-z", "vla-a"]);
}

#[test]
fn an_output_that_exists_is_kept() {
    let s = scratch();
    s.write("v.uvh5", "mine");
    s.fails(&format!("simulate --layout mm-y --scene s.csv {BAND} -o v.uvh5"), 1, &["v.uvh5", "--overwrite"]);
    assert_eq!(std::fs::read(s.path("v.uvh5")).unwrap(), b"mine");
    s.ok(&format!("simulate --layout mm-y --scene s.csv {BAND} -o v.uvh5 --overwrite"));
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn an_output_in_a_folder_that_is_not_there_is_said_at_once() {
    scratch().fails(&format!("simulate --layout mm-y --scene s.csv {BAND} -o nowhere/v.uvh5"), 1, &["nowhere", "does not exist"]);
}

#[test]
fn an_earth_layout_needs_a_phase_centre() {
    scratch().fails("simulate --layout vla-a --scene s.csv --freq 1.4GHz --bandwidth 1MHz -o v.uvh5", 2, &["--phase-center"]);
}

#[test]
fn options_of_the_other_kind_of_maximum_entropy_are_refused() {
    let s = scratch();
    s.ok(&format!("simulate --layout mm-y --scene s.csv {BAND} -o v.uvh5"));
    s.fails("mem v.uvh5 --terms cphase --prior nowhere.fits --weighting natural -o o", 2, &["--prior", "--weighting", "--terms"]);
    s.fails("mem v.uvh5 --terms cphase --hold-out 0.1 -o o", 2, &["--hold-out", "--terms"]);
    s.fails("mem v.uvh5 --average none --starts 2 -o o", 2, &["--average", "--starts", "--terms"]);
    s.ok("mem v.uvh5 --terms cphase,logcamp,amp --size 32 --cell 1mrad --flux 1Jy --round-niter 5 -o o");
}
