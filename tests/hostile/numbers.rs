//! Numbers that no option can use, and numbers whose results single precision cannot hold.

use crate::program::Scratch;

const IMAGE: &str = "--size 32 --cell 1mrad";

fn set() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.002,0.001,1\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 2 --duration 2s --integration 1s --sefd 10Jy -o v.uvh5");
    s
}

#[test]
fn what_is_no_finite_number_is_refused_by_every_kind_of_option() {
    let s = set();
    for word in ["nan", "inf", "-inf", "1e300", "-1e300"] {
        for call in [
            format!("clean v.uvh5 {IMAGE} --cyclefactor={word} -o o"),
            format!("selfcal v.uvh5 {IMAGE} --gain={word} -o o"),
            format!("selfcal v.uvh5 {IMAGE} --auto-mask={word} -o o"),
            format!("mem v.uvh5 {IMAGE} --tolerance={word} -o o"),
            format!("grid v.uvh5 {IMAGE} --epsilon={word} -o o.h5"),
            format!("plot v.uvh5 --range=0.1,{word} -o o.png"),
        ] {
            s.fails(&call, 2, &["expected"]);
        }
    }
    s.write("e.toml", "[[error]]\nbandpass-mismatch = inf\n");
    s.fails("corrupt v.uvh5 --config e.toml -o c.uvh5", 1, &["e.toml", "bandpass-mismatch is inf"]);
    s.write("r.toml", "[selfcal]\nnsigma = inf\n");
    s.fails("run r.toml -o r", 1, &["r.toml", "selfcal.nsigma is inf"]);
    assert_eq!(s.names(), ["e.toml", "r.toml", "s.csv", "v.uvh5"]);
}

#[test]
fn self_calibration_checks_the_options_of_clean_with_every_deconvolver() {
    let s = set();
    for (option, word) in [("--gain=2", "gain"), ("--mgain=0", "mgain"), ("--auto-mask=-1", "auto-mask"), ("--threshold=1K", "threshold")] {
        s.fails(&format!("selfcal v.uvh5 {IMAGE} {option} -o o"), 1, &[word]);
    }
}

#[test]
fn the_coarsest_accuracy_is_enough_for_self_calibration() {
    let s = set();
    s.ok(&format!("selfcal v.uvh5 {IMAGE} --niter 20 --rounds 2 --epsilon 0.5 --force -o o"));
}

#[test]
fn errors_and_noise_beyond_single_precision_are_refused() {
    let s = set();
    for (option, word) in [
        ("--amp-rms 200", "amplitude"),
        ("--tsys 1e-300K", "--tsys"),
        ("--sefd 1e-29Jy", "noise"),
        ("--troposphere 1rad --troposphere-baseline 1e-29m", "troposphere"),
    ] {
        let code = if option.contains("300") { 2 } else { 1 };
        s.fails(&format!("corrupt v.uvh5 {option} -o c.uvh5"), code, &[word]);
    }
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn errors_that_change_very_fast_come_to_an_end() {
    let s = set();
    for option in [
        "--phase-rms 1deg --variation jumps:1e-29s",
        "--phase-rms 1deg --variation interval:1e-29s",
        "--dropout 0.1 --dropout-length 1e-29s",
    ] {
        s.ok(&format!("corrupt v.uvh5 {option} -o c.uvh5 --overwrite"));
    }
}

#[test]
fn the_picture_of_a_table_does_not_replace_its_stack() {
    let s = Scratch::new();
    s.write("k.toml", "mine");
    for call in ["emissivity --angle 10deg", "bistatic --slopes 0.1,0.1 --incidence 10deg --scattered 20deg"] {
        s.fails(&format!("scene {call} --stack k.toml --freq 94GHz --plot ./k.toml --overwrite"), 2, &["./k.toml"]);
        assert_eq!(std::fs::read(s.path("k.toml")).unwrap(), b"mine");
    }
}
