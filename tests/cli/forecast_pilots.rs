//! `--dry-run` of work that no table describes, so that a part of it is done first.
//!
//! The times of the parts depend on the machine and on what else runs there, so no test compares them. How they grow to the time of all is tested with given times,
//! where the rule lies.

use crate::program::Scratch;
use serde_json::Value;

/// Seconds of a stage.
fn seconds(json: &Value, stage: &str) -> f64 {
    let all = json["stages"].as_array().unwrap();
    let found = all.iter().find(|s| s["stage"] == stage).unwrap_or_else(|| panic!("no stage {stage} in {json}"));
    found["seconds"].as_f64().unwrap()
}

/// A forecast, which must write nothing and have an assumption.
fn planned(s: &Scratch, command: &str) -> Value {
    let before = s.names();
    let json = s.json(&format!("{command} --dry-run"));
    assert_eq!(s.names(), before, "{command}");
    assert!(
        json["dry_run"] == true && json["seconds"].as_f64().unwrap() > 0.0 && json["peak_bytes"].as_f64().unwrap() > 1e7,
        "{command}: {json}"
    );
    json
}

/// A temperature in a disc, for arrays that see the near field.
const DISC: &str = "kind = \"analytic\"\nname = \"disc\"\nbackground = { temperature_k = 0.0 }\n[[shape]]\ntype = \"ellipse\"\ncenter_deg = [0.3, -0.2]\n\
                    size_deg = [3.0, 2.0]\ntemperature_k = 250.0\n";

/// Every point of a scene near the array takes the same time, and so does every pixel of its exact image.
#[test]
fn spherical_waves_take_what_their_points_say() {
    let s = Scratch::new();
    s.write("disc.toml", DISC);
    let band = "--freq 94GHz --bandwidth 2GHz --channels 4";
    let simulate = |size: usize| {
        format!("simulate --layout mm-y --scene disc.toml --scene-size {size} --scene-cell 1mrad {band} --range 3m -o v.uvh5")
    };
    let (small, large) = (planned(&s, &simulate(64)), planned(&s, &simulate(512)));
    let points = |json: &Value| json["facts"]["points"].as_f64().unwrap();
    assert!(seconds(&small, "spherical waves") > 0.0 && seconds(&large, "spherical waves") > 0.0, "{small} {large}");
    assert!(points(&small) > 100.0 && points(&large) >= points(&small) && points(&large) <= 512.0 * 512.0, "{small} {large}");
    s.ok(&simulate(64));
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    let predicted = planned(&s, "predict v.uvh5 --model s.csv --range auto -o p.uvh5");
    assert_eq!((&predicted["facts"]["rows"], &predicted["facts"]["points"]), (&990.0.into(), &2.0.into()), "{predicted}");
    assert!(seconds(&predicted, "spherical waves") > 0.0, "{predicted}");
    for command in ["dirty v.uvh5 -o out.fits", "beam v.uvh5 -o out.fits", "clean v.uvh5 -o out --niter 500", "mem v.uvh5 -o out"] {
        let rehearsal = if command.starts_with("clean") || command.starts_with("mem") { "--rehearse 0s" } else { "" };
        let of = |size: usize| planned(&s, &format!("{command} --range auto --size {size} --cell 0.5mrad {rehearsal}"));
        let (small, large) = (of(96), of(384));
        assert!(seconds(&large, "spherical waves") > 0.0 && small["facts"]["points"] == 9216.0, "{command}: {small} {large}");
        assert!(large["peak_bytes"].as_f64() > small["peak_bytes"].as_f64(), "{command}");
        assert!(large["facts"]["w_planes"].is_null() && large["facts"]["points"] == 147_456.0, "{command}: {large}");
    }
    s.fails("dirty v.uvh5 -o out.fits --range auto --dry-run --nodes 2", 2, &["one process"]);
    s.fails("grid v.uvh5 -o out.h5 --range auto --dry-run", 2, &["spherical waves"]);
}

/// A rehearsal finds the cycles, components and evaluations that the run then takes, also of several output channels and near the array, and says what it does not know.
#[test]
fn a_rehearsal_shows_how_many_cycles_the_data_ask_for() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n0.002,-0.011,0.2\n");
    s.ok("simulate --layout mm-spiral --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 4 --noise --sefd 20Jy -o v.uvh5");
    let told = |json: &Value| json["assumptions"].to_string();
    for (options, channels) in [
        ("--niter 90", 1.0),
        ("--niter 300 --channels-out 2", 2.0),
        ("--niter 200 --range 3m", 1.0),
        ("--niter 200 --startmod always", 1.0),
    ] {
        let line = format!("clean v.uvh5 -o out --overwrite --size 96 --cell 0.5mrad --nsigma 3 {options}");
        // However slow the machine is, these rehearsals come to their end.
        let (forecast, done) = (planned(&s, &format!("{line} --rehearse 10min")), s.json(&line));
        let of = |key: &str| done[key].as_f64().unwrap() / channels;
        let (cycles, found) = (of("major_cycles"), of("iterations"));
        let expected = format!("{:.1} major cycles and {:.0} components, as in a rehearsal", (10.0 * cycles).round() / 10.0, found);
        assert!(told(&forecast).contains(&expected), "{options}: {forecast} {done}");
    }
    let line = "mem v.uvh5 -o out --size 96 --cell 0.5mrad --niter 12";
    let known = told(&planned(&s, &format!("{line} --rehearse 10min")));
    assert!(known.contains("evaluations of the data and") && known.contains("as in a rehearsal"), "{known}");
    // Without time for it, and for a set that does not exist as it is, averages stand for the course.
    for options in ["--rehearse 0s", "--visibilities 1e7"] {
        assert!(told(&planned(&s, &format!("clean v.uvh5 -o out --size 128 {options}"))).contains("on average"), "{options}");
        assert!(!told(&planned(&s, &format!("{line} {options}"))).contains("rehearsal"), "{options}");
    }
    // Each of several machines makes the cycles of the rehearsal, and goes at its pace with its share of the rows.
    let shared = planned(&s, "clean v.uvh5 -o out --size 128 --niter 90 --nodes 2 --rehearse 10min");
    assert!(told(&shared).contains("as in a rehearsal"), "{shared}");
    let share = seconds(&shared["cluster"], "read") / seconds(&shared, "read");
    assert!((share - 0.5).abs() < 0.01, "{share}: {shared}");
    s.fails("clean v.uvh5 -o out --size 128 --rehearse 5s", 2, &["--rehearse", "--dry-run"]);
    s.fails("clean v.uvh5 -o out --size 128 --dry-run --rehearse 5", 2, &["--rehearse", "has no unit"]);
}

/// Commands without cycles are done for some of their rows, or for all of few. Another machine, and a set that does not exist as it is, have no pace.
#[test]
fn a_rehearsal_shows_the_pace_of_the_machine() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    let simulate = "simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 4";
    s.ok(&format!("{simulate} -o v.uvh5"));
    let image = "--size 128 --cell 0.5mrad";
    for command in [
        format!("dirty v.uvh5 -o out.fits {image}"),
        format!("dirty v.uvh5 -o out.fits {image} --weighting natural"),
        "dirty v.uvh5 -o out.fits".into(),
        format!("beam v.uvh5 -o out.fits {image}"),
        format!("{simulate} --noise --sefd 20Jy -o out.uvh5"),
        "predict v.uvh5 --model s.csv -o out.uvh5".into(),
    ] {
        let told = |options: &str| planned(&s, &format!("{command} {options}"))["assumptions"].to_string();
        // However slow the machine is, this rehearsal comes to its end.
        let tried = told("--rehearse 10min");
        assert!(tried.contains("a rehearsal of 990 of 990"), "{command}: {tried}");
        for without in ["--rehearse 0s", "--visibilities 1e7"] {
            assert!(!told(without).contains("rehearsal"), "{command} {without}");
        }
    }
}

/// A joint solution of image and gains needs more evaluations with held-out baselines, and a set that a run would make has one too.
#[test]
fn a_joint_solution_is_begun_on_some_rows() {
    let s = Scratch::new();
    s.write("disc.toml", DISC);
    let scene = "--scene disc.toml --scene-size 64 --scene-cell 1.5mrad --freq 94GHz --bandwidth 2GHz --channels 2";
    s.ok(&format!("simulate --layout mm-y {scene} --noise --tsys 500K --duration 30s -o v.uvh5"));
    let of = |options: &str| planned(&s, &format!("selfcal v.uvh5 -o out --size 64 --cell 1.5mrad --solint inf {options}"));
    let (here, unjudged, larger) = (of(""), of("--hold-out 0"), of("--visibilities 1e7"));
    assert!(seconds(&here, "image and gains") > 0.0 && larger["peak_bytes"].as_f64() > here["peak_bytes"].as_f64(), "{here} {larger}");
    let evaluations = |json: &Value| {
        let all = json["assumptions"].as_array().unwrap().iter().filter_map(Value::as_str);
        all.filter_map(|a| a.split_once(" evaluations, as")?.0.parse::<f64>().ok()).next().unwrap()
    };
    assert!(evaluations(&unjudged) < evaluations(&here), "{here} {unjudged}");
    let assumed = here["assumptions"].to_string();
    assert!(assumed.contains("other ways (multiscale, hogbom) are not tried"), "{here}");
    // Each process has its share of the rows, and all sum the image of each evaluation.
    let network = |n: usize| {
        let cluster = &of(&format!("--visibilities 1e7 --nodes {n}"))["cluster"];
        let found = cluster["stages"].as_array().unwrap().iter().find(|x| x["stage"] == "image and gains").unwrap()["network_s"].as_f64();
        found.unwrap()
    };
    assert!(network(1) == 0.0 && network(8) > 0.0);
    let run = "title = \"t\"\nseed = 3\n[layout]\nname = \"mm-y\"\n[scene]\nfile = \"disc.toml\"\nscene-size = 64\nscene-cell = \"1.5mrad\"\n[simulate]\nfreq = \"94GHz\"\n\
               bandwidth = \"2GHz\"\nnoise = true\ntsys = \"500K\"\n[image]\nsize = 64\n[mem]\nniter = 5\n[corrupt]\nphase-rms = \"20deg\"\n[selfcal]\nsolint = \"inf\"\n";
    s.write("run.toml", run);
    let run = planned(&s, "run run.toml -o made");
    assert!(seconds(&run, "selfcal") > 0.0 && run["assumptions"].to_string().contains("selfcal: 530 evaluations"), "{run}");
}

/// Leakages follow the rounds of self-calibration, with images of their own where no model is given.
#[test]
fn leakages_follow_the_rounds() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0002,0.0001,1.0\n");
    let track = "--phase-center 12h00m00s,+40d00m00s --hour-angle -1h,1h --integration 1200s --noise --sefd 300Jy";
    s.ok(&format!("simulate --layout vla-d --scene s.csv --freq 5GHz --bandwidth 64MHz --channels 4 --pols RR,RL,LR,LL {track} -o v.uvh5"));
    let of = |options: &str| planned(&s, &format!("selfcal v.uvh5 -o out --size 128 --solint inf --niter 200 {options}"));
    let (rounds, leakages) = (of(""), of("--solve leakage"));
    assert_eq!(leakages["stages"].as_array().unwrap().len(), rounds["stages"].as_array().unwrap().len() + 2, "{rounds} {leakages}");
    assert!(seconds(&leakages, "leakages") > 0.0 && seconds(&leakages, "images of I, Q, U and V") > 0.0, "{leakages}");
    let given = of("--solve leakage --model s.csv");
    assert!(!given["stages"].to_string().contains("images of I, Q, U and V"), "{given}");
    s.ok(&format!("simulate --layout vla-d --element airy --scene s.csv --freq 5GHz --bandwidth 64MHz {track} -o p.uvh5"));
    s.fails("selfcal p.uvh5 -o out --size 128 --solint inf --pointing --dry-run", 2, &["no forecast of --pointing"]);
}

/// Errors that need the scene are put into some rows.
#[test]
fn errors_of_the_scene_are_put_into_some_rows() {
    let s = Scratch::new();
    s.write("disc.toml", DISC);
    let scene = "--scene disc.toml --scene-size 64 --scene-cell 1.5mrad";
    s.ok(&format!("simulate --layout mm-y {scene} --freq 94GHz --bandwidth 1GHz --element airy --element-diameter 20mm -o v.uvh5"));
    let here = planned(&s, &format!("corrupt v.uvh5 -o out.uvh5 --pointing-rms 10arcmin {scene}"));
    assert!(seconds(&here, "scene") > 0.0 && here["assumptions"].to_string().contains("rows, which see the scene changed"), "{here}");
    let without = planned(&s, "corrupt v.uvh5 -o out.uvh5 --phase-rms 10deg");
    assert!(!without["stages"].to_string().contains("\"scene\""), "{without}");
}

/// An image from closure quantities takes the data that the command takes.
#[test]
fn closure_quantities_are_imaged_for_a_few_iterations() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n1e-9,2e-10,1.0\n-6e-10,5e-10,0.5\n");
    let track = "--phase-center 12h00m00s,+40d00m00s --hour-angle -2h,2h --integration 1200s --noise --sefd 100Jy";
    s.ok(&format!("simulate --layout vlba --scene s.csv --freq 43GHz --bandwidth 1GHz {track} -o v.uvh5"));
    let line = "mem v.uvh5 -o out --terms cphase,amp --size 32 --cell 60uas --flux 1.5Jy --closure-rounds";
    let four = planned(&s, &format!("{line} 4"));
    let done = s.json(&format!("{line} 1 --round-niter 5"));
    assert_eq!((&four["facts"]["data"], &four["facts"]["size"]), (&done["n_visibilities"], &done["size"]), "{four} {done}");
    assert!(seconds(&four, "images") > 0.0 && four["facts"]["evaluation_s"].as_f64().unwrap() > 0.0, "{four}");
}

/// A study of frame rates counts its frames, and the pictures that the motion asks for.
#[test]
fn frame_rates_are_studied_at_one_rate() {
    let s = Scratch::new();
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("phenomenology/scenes/t-72.toml");
    std::fs::copy(scene, s.path("tank.toml")).unwrap();
    let key = |t: f64, x: f64| format!("[[key]]\ntime_s = {t}\nposition_m = [{x}, -9, 5]\nlook_at_m = [0, 0, 1]\n");
    s.write("path.toml", format!("scene = \"tank.toml\"\nframes_per_second = 10\n{}{}", key(1.0, 12.0), key(3.0, 9.0)));
    let line = "film path.toml -o out.csv --size 64 --show filled --tsys 500K --seeds 6 --rates";
    let (one, three) = (planned(&s, &format!("{line} 20")), planned(&s, &format!("{line} 20,5,2,5")));
    assert_eq!((&one["facts"]["frames"], &three["facts"]["frames"]), (&6.into(), &18.into()), "{one} {three}");
    let done = s.json(&format!("{line} 20,5,2"));
    let pictures: f64 = done["rates"].as_array().unwrap().iter().map(|r| r["pictures"].as_f64().unwrap()).sum();
    let foreseen = three["facts"]["pictures"].as_f64().unwrap();
    assert!(foreseen > pictures && foreseen < 2.0 * pictures + 16.0, "{three} {done}");
    s.fails("film path.toml -o out.gif --size 64 --show filled --tsys 500K --rates 20 --dry-run", 2, &["name a table"]);
}

/// Commands whose rows or lines all take about the same work on a few of them, and say what the whole takes.
#[test]
fn rows_and_lines_are_worked_on_until_they_can_be_timed() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 2 --range 3m --noise --tsys 500K -o v.uvh5");
    let timed = |command: &str, stage: &str| {
        let json = planned(&s, command);
        assert!(seconds(&json, stage) > 0.0, "{command}: {json}");
        json
    };
    timed("focus v.uvh5 -o f.uvh5 --range 3m", "phases");
    let closures = timed("closure v.uvh5 -o c.csv", "closure quantities");
    // A set that is longer has as many more quantities, of which the same part is formed.
    let more = timed("closure v.uvh5 -o c.csv --visibilities 1e6", "closure quantities");
    let grown = |name: &str| more["facts"][name].as_f64().unwrap() / closures["facts"][name].as_f64().unwrap();
    assert!(grown("rows") > 20.0 && (grown("quantities") / grown("rows") - 1.0).abs() < 1e-3, "{closures} {more}");
    let done = s.json("closure v.uvh5 -o c.csv");
    let count = done["phases"]["count"].as_f64().unwrap() + done["log_amplitudes"]["count"].as_f64().unwrap();
    assert_eq!(closures["facts"]["quantities"].as_f64(), Some(count), "{closures} {done}");
    let written = std::fs::metadata(s.path("c.csv")).unwrap().len() as f64;
    assert!((closures["output_bytes"].as_f64().unwrap() / written - 1.0).abs() < 0.05, "{closures} {written}");
    let mask = |time: &str| {
        timed(&format!("mask mm-y --freq 94GHz --bandwidth 1GHz --channels 8 --size 256 --cell 1mrad --duration {time} -o m.fits"), "mask")
    };
    let (short, long) = (mask("100s"), mask("10000s"));
    assert_eq!((&short["facts"]["rows"], &long["facts"]["rows"]), (&9900.into(), &990_000.into()), "{short} {long}");
    s.ok("dirty v.uvh5 -o small.fits --size 128 --cell 1mrad");
    let small = timed("enhance small.fits -o e.fits --steps median=7", "steps");
    assert_eq!((&small["facts"]["size"], &small["facts"]["frames"]), (&serde_json::json!([128, 128]), &1.into()), "{small}");
    s.fails("focus v.uvh5 -o f.uvh5 --range auto --dry-run", 2, &["search for the range"]);
    for without in ["info v.uvh5", "compare small.fits small.fits", "identify mm-y", "layout list"] {
        s.fails(&format!("{without} --dry-run"), 2, &["there is a forecast for", "focus", "closure", "mask", "enhance", "little time"]);
    }
}
