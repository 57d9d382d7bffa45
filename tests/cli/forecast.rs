//! `--dry-run`.

use crate::program::Scratch;
use serde_json::Value;

fn set(s: &Scratch) {
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    s.ok("simulate --layout mm-spiral --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 4 --noise --tsys 500K -o v.uvh5");
}

/// Every command with a forecast gives the same keys, writes nothing, and takes an output that exists as it is.
#[test]
fn a_forecast_writes_nothing_and_has_its_keys() {
    let s = Scratch::new();
    set(&s);
    let study = "title = \"t\"\nseeds = 3\nlayout = { name = \"mm-y\" }\nscene = { points = [{ flux = \"1Jy\" }] }\n[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n\
                 [image]\nsize = 64\ncell = \"1mrad\"\n[clean]\nniter = 10\n[corrupt]\nphase-rms = \"5deg\"\n";
    s.write("study.toml", study);
    s.ok("corrupt v.uvh5 --phase-rms 5deg -o errors.uvh5 --gains g.calh5");
    let before = s.names();
    for command in [
        "dirty v.uvh5 -o out.fits --size 256",
        "beam v.uvh5 -o out.fits --size 256",
        "grid v.uvh5 -o out.h5 --size 256",
        "clean v.uvh5 -o out --size 256 --niter 500",
        "clean v.uvh5 -o out --size 256 --niter 500 --algorithm multiscale",
        "mem v.uvh5 -o out --size 256",
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
    ] {
        let json = s.json(&format!("{command} --dry-run"));
        assert_eq!(s.names(), before, "{command}");
        assert_eq!((json["dry_run"].as_bool(), json["command"].as_str()), (Some(true), command.split(' ').next()));
        let stages = json["stages"].as_array().unwrap();
        let sum: f64 = stages.iter().map(|stage| stage["seconds"].as_f64().unwrap()).sum();
        let most = stages.iter().map(|stage| stage["bytes"].as_f64().unwrap()).fold(0.0, f64::max);
        assert!(stages.len() > 2 && sum > 0.0 && (json["seconds"].as_f64().unwrap() / sum - 1.0).abs() < 1e-9, "{command}: {json}");
        assert!(most > 1e6 && json["peak_bytes"].as_f64().unwrap() >= most, "{command}: {json}");
        assert!(json["output_bytes"].as_f64().unwrap() > 1e3, "{command}: {json}");
        assert!(s.ok(&format!("{command} --dry-run")).out.contains("nothing was written"));
    }
    s.fails("convert v.uvh5 out.uvfits --dry-run --nodes 2", 2, &["one process"]);
    s.fails("study study.toml -o out --dry-run --visibilities 1e9", 2, &["--visibilities"]);
    s.fails("applycal v.uvh5 g.calh5 -o out.uvh5 --dry-run --nodes 2", 2, &["one process"]);
    s.fails("corrupt v.uvh5 -o out.uvh5 --pointing-rms 1arcmin --scene s.csv --dry-run", 2, &["the scene", "pointing"]);
    s.fails("selfcal v.uvh5 -o out --deconvolver mem --dry-run", 2, &["joint solution", "--deconvolver multiscale"]);
    s.fails("selfcal v.uvh5 -o out --solve leakage --dry-run", 2, &["--solve"]);
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
    assert!((memory / (1.25 * planned["peak_bytes"].as_f64().unwrap() + f64::from(256 << 20)) - 1.0).abs() < 1e-6, "{script} {planned}");
}
