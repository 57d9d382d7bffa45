//! Impossible calibrations give a clear message and leave no files.

use crate::program::Scratch;

/// Four antennas in front of a scene, and a set of them.
fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --integration 10s --duration 20s --method dft -o v.uvh5");
    s
}

const IMAGE: &str = "--size 64 --cell 1mrad --niter 10 --rounds 1";

#[test]
fn wrong_calls_of_selfcal_are_said_before_any_work() {
    let s = scratch();
    let before = s.names();
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --refant NOBODY"), 1, &["refant", "NOBODY", "expected one of"]);
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --solint 60"), 2, &["solint", "60", "no unit"]);
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --solint 1s"), 1, &["solint"]);
    s.fails("selfcal v.uvh5 -o x --size 64 --cell 1mrad --rounds 0", 2, &["--rounds", "0"]);
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --algorithm magic"), 2, &["magic", "hogbom"]);
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --minsnr nan"), 2, &["minsnr"]);
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --model nowhere.fits"), 1, &["nowhere.fits"]);
    assert_eq!(s.names(), before);
}

#[test]
fn a_model_of_zeros_and_flagged_data_are_refused() {
    let s = scratch();
    s.write("zero.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,0.0\n");
    s.fails(&format!("selfcal v.uvh5 -o x {IMAGE} --model zero.csv"), 1, &["model"]);
    s.ok("corrupt v.uvh5 -o f.uvh5 --flag-good 1");
    s.fails(&format!("selfcal f.uvh5 -o x {IMAGE} --start point"), 1, &["flagged"]);
    s.fails("closure f.uvh5", 1, &["usable"]);
}

#[test]
fn errors_that_make_no_sense_are_refused() {
    let s = scratch();
    let before = s.names();
    s.fails("corrupt v.uvh5 -o c.uvh5", 2, &["--phase-rms", "--config", "troposphere"]);
    s.fails("corrupt v.uvh5 -o c.uvh5 --phase-rms 30", 2, &["30", "deg"]);
    s.fails("corrupt v.uvh5 -o c.uvh5 --phase-rms 30deg --variation sometimes", 2, &["sometimes", "coherent"]);
    s.fails("corrupt v.uvh5 -o c.uvh5 --dropout 2", 1, &["dropout", "2"]);
    s.fails("corrupt v.uvh5 -o c.uvh5 --phase-rms 1rad --gains c.uvh5", 2, &["one file"]);
    s.fails("corrupt v.uvh5 -o c.uvh5 --position-rms layout", 1, &["uncertainty"]);
    assert_eq!(s.names(), before);
    s.write("bad.toml", "[[error]]\nmagic = \"1deg\"\n");
    s.fails("corrupt v.uvh5 -o c.uvh5 --config bad.toml", 1, &["bad.toml", "line 2", "magic", "phase-rms"]);
}

#[test]
fn gains_of_another_array_and_files_that_are_no_gains_are_refused() {
    let s = scratch();
    s.ok("corrupt v.uvh5 -o c.uvh5 --phase-rms 1rad");
    s.ok("simulate --layout mm-ring --scene s.csv --freq 94GHz --bandwidth 1GHz --method dft -o ring.uvh5");
    s.fails("applycal v.uvh5 s.csv -o x.uvh5", 1, &["s.csv", "CalH5"]);
    s.fails("applycal v.uvh5 missing.calh5 -o x.uvh5", 1, &["missing.calh5"]);
    s.ok("dirty v.uvh5 --size 64 --cell 1mrad -o d.fits");
    s.fails("compare c.calh5 d.fits", 1, &["gain table", "d.fits"]);
    s.fails("compare c.calh5 c.calh5 --shift", 2, &["--gradient"]);
    s.fails("compare d.fits d.fits --gradient", 2, &["gain tables"]);
}

/// The list of what may be wrong with a set that is to be self-calibrated: each is an error that says what, or flagged and counted.
#[test]
fn what_cannot_be_solved_is_said_or_flagged_and_counted() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1000.0\n");
    let layout = |n: usize| {
        let antennas = (0..n).map(|k| {
            let (x, y) = ((k * k) as f64 * 0.1, ((7 * k) % 5) as f64 * 0.1);
            format!("[[antenna]]\nname = \"A{k}\"\nposition_m = [{x}, {y}, 0.0]\nsefd_jy = 1e4\n")
        });
        format!("name = \"t\"\nframe = \"boresight\"\n{}", antennas.collect::<String>())
    };
    let simulate = "--scene s.csv --freq 94GHz --bandwidth 1GHz --integration 10s --duration 20s --method dft";
    // One antenna alone has no baseline.
    s.write("one.toml", layout(1));
    s.fails(&format!("simulate --layout one.toml {simulate} -o one.uvh5"), 1, &["antenna"]);
    // Two antennas have one baseline. The phase between them is found, and the message says that nothing else is determined.
    s.write("two.toml", layout(2));
    s.ok(&format!("simulate --layout two.toml {simulate} -o two.uvh5"));
    let said = s.json(&format!("selfcal two.uvh5 -o pair {IMAGE} --beam 5mrad,5mrad,0deg --start point --solint inf"));
    assert_eq!(said["rounds"][0]["gains_flagged"].as_object().map(serde_json::Map::len), Some(0), "{said}");
    // An antenna whose data are all flagged has no gain, and is counted.
    s.write("six.toml", layout(6));
    s.ok(&format!("simulate --layout six.toml {simulate} -o six.uvh5"));
    s.write("silent.toml", "[[error]]\ndropout = 0.3\ndropout-length = \"1000s\"\ndropout-noticed = true\n");
    s.ok("corrupt six.uvh5 -o silent.uvh5 --config silent.toml --seed 5");
    let said = s.json(&format!("selfcal silent.uvh5 -o calm {IMAGE} --beam 5mrad,5mrad,0deg --start point --solint inf"));
    assert!(said["rounds"][0]["gains_flagged"]["no data"].as_u64() > Some(0), "{said}");
    assert!(said["n_flagged_for_want_of_a_gain"].is_u64());
}
