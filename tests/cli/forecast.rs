//! `--dry-run`.

use crate::program::Scratch;
use serde_json::Value;
use std::path::Path;

fn set(s: &Scratch) {
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    s.ok("simulate --layout mm-spiral --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 4 --noise --tsys 500K -o v.uvh5");
}

/// A run with errors and self-calibration, whose layout is made first.
const RUN: &str = r#"
title = "t"
seed = 3
[layout.make]
kind = "ring"
elements = 12
aperture = "0.3m"
diameter = "5mm"
[scene]
file = "s.csv"
[simulate]
freq = "94GHz"
bandwidth = "1GHz"
channels = 4
noise = true
tsys = "500K"
[image]
size = 128
[[clean]]
algorithm = "hogbom"
niter = 200
[mem]
niter = 5
[corrupt]
phase-rms = "5deg"
[selfcal]
solint = "inf"
rounds = 2
"#;

/// Speeds that need no tests of the machine.
fn speeds() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/cost/machines/intel-xeon.toml").display().to_string()
}

/// A tank, and a flight around it.
fn flight(s: &Scratch) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("phenomenology/scenes/t-72.toml");
    std::fs::copy(scene, s.path("tank.toml")).unwrap();
    let path = "scene = \"tank.toml\"\nframes_per_second = 10\n[[key]]\ntime_s = 1\nposition_m = [12, -9, 5]\nlook_at_m = [0, 0, 1]\n\
                [[key]]\ntime_s = 3\nposition_m = [9, -12, 5]\nlook_at_m = [0, 0, 1]\n";
    s.write("path.toml", path);
}

/// Every command with a forecast gives the same keys, writes nothing, and takes an output that exists as it is.
#[test]
fn a_forecast_writes_nothing_and_has_its_keys() {
    let s = Scratch::new();
    set(&s);
    let study = "title = \"t\"\nseeds = 3\nlayout = { name = \"mm-y\" }\nscene = { points = [{ flux = \"1Jy\" }] }\n[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n\
                 [image]\nsize = 64\ncell = \"1mrad\"\n[clean]\nniter = 10\n[corrupt]\nphase-rms = \"5deg\"\n";
    s.write("study.toml", study);
    s.write("run.toml", RUN);
    flight(&s);
    s.ok("corrupt v.uvh5 --phase-rms 5deg -o errors.uvh5 --gains g.calh5");
    let before = s.names();
    for command in [
        "dirty v.uvh5 -o out.fits --size 256",
        "beam v.uvh5 -o out.fits --size 256",
        "grid v.uvh5 -o out.h5 --size 256",
        "clean v.uvh5 -o out --size 256 --niter 500",
        "clean v.uvh5 -o out --size 256 --niter 500 --algorithm multiscale --rehearse 0s",
        "mem v.uvh5 -o out --size 256 --rehearse 0s",
        "simulate --layout mm-spiral --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 4 -o v.uvh5",
        "predict v.uvh5 --model s.csv -o out.uvh5",
        "selfcal v.uvh5 -o out --size 256 --solint inf",
        "selfcal v.uvh5 -o out --size 256 --solint inf --deconvolver multiscale --rounds 2 --hold-out 0",
        "corrupt v.uvh5 --phase-rms 5deg --delay-rms 1ns -o out.uvh5",
        "applycal v.uvh5 g.calh5 -o out.uvh5",
        "applycal v.uvh5 g.calh5 -o out.uvfits",
        "convert v.uvh5 out.uvfits",
        "convert v.uvh5 out.uvh5",
        "study study.toml -o out",
        "run run.toml -o out",
        "scene render tank.toml -o out.fits --scene-size 300",
        "scene render tank.toml -o out.fits --scene-size 300 --mode realtime --error-map error.fits",
        "scene fly path.toml -o out --size 64 --no-video",
        "film path.toml -o out.gif --size 64 --show truth",
    ] {
        let json = s.json(&format!("{command} --dry-run"));
        assert_eq!(s.names(), before, "{command}");
        let name = json["command"].as_str().unwrap();
        assert!(json["dry_run"] == true && command.starts_with(name), "{command}: {name}");
        let stages = json["stages"].as_array().unwrap();
        let sum: f64 = stages.iter().map(|stage| stage["seconds"].as_f64().unwrap()).sum();
        let most = stages.iter().map(|stage| stage["bytes"].as_f64().unwrap()).fold(0.0, f64::max);
        assert!(stages.len() > 2 && sum > 0.0 && (json["seconds"].as_f64().unwrap() / sum - 1.0).abs() < 1e-9, "{command}: {json}");
        assert!(most > 1e6 && json["peak_bytes"].as_f64().unwrap() >= most, "{command}: {json}");
        assert!(json["output_bytes"].as_f64().unwrap() > 1e3, "{command}: {json}");
        assert!(s.ok(&format!("{command} --dry-run --speeds {}", speeds())).out.contains("nothing was written"));
    }
    s.fails("convert v.uvh5 out.uvfits --dry-run --nodes 2", 2, &["one process"]);
    s.fails("study study.toml -o out --dry-run --visibilities 1e9", 2, &["--visibilities"]);
    for alone in ["run run.toml -o out", "scene render tank.toml -o out.fits", "scene fly path.toml -o out", "film path.toml -o out.gif"] {
        s.fails(&format!("{alone} --dry-run --nodes 2"), 2, &["one process"]);
        s.fails(&format!("{alone} --dry-run --visibilities 1e9"), 2, &["--visibilities"]);
    }
    s.fails("applycal v.uvh5 g.calh5 -o out.uvh5 --dry-run --nodes 2", 2, &["one process"]);
    s.fails("corrupt v.uvh5 -o out.uvh5 --pointing-rms 1arcmin --scene none.csv --dry-run", 2, &["none.csv", "does not exist"]);
}

/// Self-calibration says what it assumes of the rounds, and takes longer with more of them and where baselines are held out.
#[test]
fn a_forecast_of_self_calibration_follows_its_rounds() {
    let s = Scratch::new();
    set(&s);
    let of = |options: &str| s.json(&format!("selfcal v.uvh5 -o out --size 256 --solint inf --dry-run {options}"));
    let work = |json: &Value| {
        let all = json["stages"].as_array().unwrap().iter().map(|stage| stage["work"].clone());
        all.filter_map(|w| w["pass.node"].as_f64()).sum::<f64>()
    };
    let (ten, four, unjudged) = (of("--rounds 10"), of("--rounds 4"), of("--rounds 4 --hold-out 0"));
    assert!(work(&ten) > work(&four) && work(&four) > work(&unjudged), "{ten} {four} {unjudged}");
    assert!(ten["assumptions"][0].as_str().unwrap().contains("10 rounds"), "{ten}");
    assert!(ten["assumptions"].to_string().contains("not known before"), "{ten}");
}

/// More of anything takes no less.
#[test]
fn more_work_takes_more_time_and_memory() {
    let s = Scratch::new();
    set(&s);
    let of = |options: &str| {
        let json = s.json(&format!("dirty v.uvh5 -o out.fits --threads 1 --dry-run {options}"));
        let work: f64 =
            json["stages"].as_array().unwrap().iter().flat_map(|x| x["work"].as_object().unwrap().values()).filter_map(Value::as_f64).sum();
        (work, json["peak_bytes"].as_f64().unwrap())
    };
    let (work, bytes) = of("--size 512");
    for more in ["--size 1024", "--size 512 --visibilities 3e7", "--size 512 --epsilon 1e-9"] {
        let (w, b) = of(more);
        assert!(w > work && b > bytes, "{more}: {w} {work} {b} {bytes}");
    }
}

/// The size, the grid and the memory of the visibilities are those that the run then takes.
#[test]
fn a_forecast_chooses_the_image_of_the_run() {
    let s = Scratch::new();
    set(&s);
    let planned = s.json("dirty v.uvh5 -o out.fits --dry-run");
    let done = s.json("dirty v.uvh5 -o out.fits");
    assert_eq!(planned["facts"]["size"], done["size"], "{planned} {done}");
}

#[test]
fn a_cluster_has_a_limit_and_options_alone_are_refused() {
    let s = Scratch::new();
    set(&s);
    let line = "dirty v.uvh5 -o out.fits --dry-run --visibilities 1e10 --size 4096 --cell 0.05mrad --nodes";
    let cluster = |more: &str| s.json(&format!("{line} {more}"))["cluster"].clone();
    let (few, many) = (cluster("4 --node-memory 64GiB"), cluster("64 --node-memory 64GiB"));
    assert!(many["seconds"].as_f64().unwrap() < few["seconds"].as_f64().unwrap(), "{few} {many}");
    assert_eq!(cluster("64 --node-memory 100MB")["limit"], "memory");
    assert_eq!(cluster("64 --storage 1MB/s")["limit"], "storage");
    assert!(s.ok(&format!("{line} 64")).out.contains("what breaks first"));
    // Processes share out the minor cycles of the output channels, and each has its share of the visibilities.
    let minor = |channels: usize, nodes: usize| {
        let line = format!("clean v.uvh5 -o out --dry-run --size 512 --channels-out {channels} --nodes {nodes} --speeds {}", speeds());
        let json = s.json(&line);
        let spans = json["cluster"]["stages"].as_array().unwrap().iter().filter(|x| x["stage"] == "minor cycles");
        spans.map(|x| x["seconds"].as_f64().unwrap()).sum::<f64>()
    };
    let ratio = |channels: usize| minor(channels, 2) / minor(channels, 1);
    assert!((ratio(1) - 1.0).abs() < 1e-9 && (ratio(4) - 0.5).abs() < 1e-9, "{} {}", ratio(1), ratio(4));
    for (wrong, part) in [
        ("dirty v.uvh5 -o out.fits --nodes 4", "--dry-run"),
        ("dirty v.uvh5 -o out.fits --dry-run --network 1Gbit/s", "--nodes"),
        ("dirty v.uvh5 -o out.fits --dry-run --nodes 0", "--nodes is 0"),
        ("dirty v.uvh5 -o out.fits --dry-run --nodes 2 --network 10", "10Gbit/s"),
        ("dirty v.uvh5 -o out.fits --dry-run --visibilities 0", "--visibilities"),
        ("info v.uvh5 --dry-run", "there is a forecast for"),
    ] {
        s.fails(wrong, 2, &[part]);
    }
}

/// A script for Slurm asks for what the forecast says, twice the time and a quarter more memory.
#[test]
fn a_script_asks_for_what_is_forecast() {
    let s = Scratch::new();
    set(&s);
    let script = s.json("clean v.uvh5 -o out --size 512 --niter 500 --slurm --slurm-cpus 2");
    let planned = s.json("clean v.uvh5 -o out --size 512 --niter 500 --dry-run --threads 2");
    let (time, memory) = (script["time_s"].as_f64().unwrap(), script["memory_bytes"].as_f64().unwrap());
    // The two calls test the speed of the machine each.
    assert!(time >= 120.0 && time < 120.0 + 20.0 * planned["seconds"].as_f64().unwrap() + 60.0, "{script} {planned}");
    // The memory of the program itself differs by pages of its libraries from call to call: it was 27.6 to 29.0 MB in 16 of them.
    let forecast = 1.25 * planned["peak_bytes"].as_f64().unwrap() + f64::from(256 << 20);
    assert!((memory - forecast).abs() < 1.25 * 2e6, "{script} {planned}");
}

/// The set and the images of a run are those that it then makes, and each of its sections is a stage.
#[test]
fn a_forecast_of_a_run_sees_the_set_that_does_not_exist_yet() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    s.write("run.toml", RUN);
    let planned = s.json("run run.toml -o out --dry-run");
    let stages: Vec<&str> = planned["stages"].as_array().unwrap().iter().filter_map(|stage| stage["stage"].as_str()).collect();
    for name in ["start", "layout", "simulate", "beam", "dirty", "clean", "mem", "corrupt", "selfcal", "pictures"] {
        assert!(stages.contains(&name), "{name}: {stages:?}");
    }
    assert_eq!(stages.iter().filter(|name| **name == "start").count(), 1);
    assert!(planned["assumptions"].to_string().contains("selfcal: all 2 rounds"), "{planned}");
    // The single commands say the same of the set that the run makes.
    let done = s.json("run run.toml -o out");
    assert_eq!((&planned["facts"]["rows"], &planned["facts"]["size"]), (&66.0.into(), &done["dirty"]["size"]), "{planned}");
    let alone = s.json("clean out/vis.uvh5 -o c --size 128 --niter 200 --algorithm hogbom --dry-run --rehearse 0s");
    let nodes = |json: &Value, stage: &dyn Fn(&str) -> bool| {
        let all = json["stages"].as_array().unwrap().iter().filter(|x| stage(x["stage"].as_str().unwrap()));
        all.filter_map(|x| x["work"]["pass.node"].as_f64()).sum::<f64>()
    };
    // The run cleans the set once without errors and once with them.
    let (in_run, once) = (nodes(&planned, &|name| name == "clean"), nodes(&alone, &|_| true));
    assert!(once > 0.0 && (in_run / once - 2.0).abs() < 0.2, "{in_run} {once}");
    let wrong = RUN.replace("tsys = \"500K\"\n", "");
    s.write("wrong.toml", wrong);
    s.fails("run wrong.toml -o new --dry-run", 1, &["simulate", "neither an SEFD nor a Tsys"]);
    s.fails("run missing.toml -o new --dry-run", 1, &["missing.toml"]);
}

/// What has no forecast is told, and the other commands of the run are counted.
#[test]
fn a_forecast_of_a_run_says_what_it_leaves_out() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n");
    // Total power tells the level of a smooth scene behind the pattern of the elements.
    let behind = RUN.replace("noise = true\n", "noise = true\nautos = true\nelement = \"airy\"\n");
    s.write("run.toml", behind.replace("[selfcal]\n", "[selfcal]\ndeconvolver = \"mem\"\n"));
    let planned = s.json("run run.toml -o out --dry-run");
    let first = planned["assumptions"][0].as_str().unwrap();
    assert!(first.contains("selfcal") && first.contains("not counted") && first.contains("smooth scene"), "{planned}");
    assert!(planned["seconds"].as_f64().unwrap() > 0.0);
}

/// Small pictures of a scene say how many rays a large one takes, and of the wrong scene what `scene render` says.
#[test]
fn small_pictures_say_how_many_rays_a_large_one_takes() {
    let s = Scratch::new();
    flight(&s);
    for (options, tolerance) in [("", 0.15), ("--antialias 1", 0.15), ("--mode realtime", 0.35)] {
        let line = format!("scene render tank.toml -o out.fits --scene-size 417 --overwrite {options}");
        let (planned, done) = (s.json(&format!("{line} --dry-run")), s.json(&line));
        let (planned_rays, rays) = (planned["facts"]["rays"].as_f64().unwrap(), done["rays"].as_f64().unwrap());
        assert!((planned_rays / rays - 1.0).abs() < tolerance, "{options}: {planned_rays} {rays}");
    }
    for (wrong, part) in [
        ("scene render tank.toml -o new.fits --scene-cell 1mrad", "--scene-cell needs --scene-size"),
        ("scene render tank.toml -o new.fits --error-map e.fits", "--mode realtime"),
        ("scene render tank.toml -o new.fits --scene-size 20000", "134217728"),
        ("scene render missing.toml -o new.fits", "missing.toml"),
        ("film path.toml -o out.xyz", "out.xyz"),
        ("film missing.toml -o out.gif", "missing.toml"),
        ("scene fly path.toml -o out --pol I,Q", "one plane"),
    ] {
        let told = |more: &str| {
            let said = s.run(&format!("{wrong}{more}"));
            (said.code, said.err)
        };
        let (real, planned) = (told(""), told(&format!(" --dry-run --speeds {}", speeds())));
        assert!(real.0 != 0 && planned == real && real.1.contains(part), "{wrong}: {real:?} {planned:?}");
    }
}
