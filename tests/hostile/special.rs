//! Pipes, devices, links to other files and requests that are too large: each is refused at once.

use crate::program::Scratch;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time in which a refusal must come.
const PATIENCE: Duration = Duration::from_secs(20);

/// Run a command that must fail soon with these words.
fn refused(s: &Scratch, line: &str, words: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cittert"));
    command.current_dir(s.path("")).args(line.split_whitespace()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{line}: still at work after {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let out = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success(), "{line} succeeded\n{err}");
    for word in words {
        assert!(err.contains(word), "{line}: {word:?} is not in\n{err}");
    }
    assert!(!err.contains("panicked") && !err.contains("internal error"), "{line}\n{err}");
}

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[test]
fn a_pipe_is_refused_wherever_a_file_is_expected() {
    let s = Scratch::new();
    pipe(&s.path("p"));
    pipe(&s.path("p.toml"));
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    s.ok("simulate --layout mm-y --freq 94GHz --bandwidth 1GHz --scene s.csv -o v.uvh5");
    s.ok("corrupt v.uvh5 --phase-rms 1rad -o c.uvh5");
    s.ok("dirty v.uvh5 --size 64 --cell 1mrad -o i.fits");
    let seen = "[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n";
    let of = |scene: &str| format!("title = \"x\"\nseeds = 1\nlayout = {{ name = \"mm-y\" }}\nscene = {{ {scene} }}\n{seen}");
    s.write("piped.toml", of("file = \"p\""));
    s.write("points.toml", of("points = [{ flux = \"1Jy\" }]") + "[image]\nsize = 64\ncell = \"1mrad\"\n");
    std::fs::create_dir(s.path("folder")).unwrap();
    pipe(&s.path("folder/journal.jsonl"));
    std::fs::create_dir(s.path("listed")).unwrap();
    pipe(&s.path("listed/.cittert-files"));
    pipe(&s.path(".v.uvh5.lock"));
    for line in [
        "study piped.toml -o out",
        "study points.toml -o folder",
        "scene fly p.toml -o listed --overwrite",
        "film p.toml -o f.png",
        "predict v.uvh5 --model s.csv --into model -o v.uvh5 --overwrite",
        "predict v.uvh5 --model p -o w.uvh5",
        "applycal v.uvh5 p -o w.uvh5",
        "corrupt v.uvh5 --phase-rms 1rad --gains p -o w.uvh5 --overwrite",
        "selfcal v.uvh5 --model p -o x",
        "mem v.uvh5 --prior p --size 64 --cell 1mrad -o x",
        "closure p",
        "identify p",
        "plot i.fits --like p -o q.png",
        "plot c.calh5 --truth p -o q.png",
        "scene convert p x.toml",
        "scene probe p --rays p",
        "mask p --freq 94GHz --bandwidth 1GHz --size 64 --cell 1mrad -o x.fits",
        "info p",
        "clean p -o c",
        "dirty p -o d.fits",
        "plot p -o p.png",
        "compare p p",
        "convert p q.uvh5",
        "layout show p",
        "run p.toml -o out",
        "study p.toml -o out",
        "simulate --layout mm-y --freq 94GHz --bandwidth 1GHz --scene p -o w.uvh5",
        "simulate --layout p --freq 94GHz --bandwidth 1GHz --scene s.csv -o w.uvh5",
        "corrupt v.uvh5 --config p.toml -o w.uvh5",
        "scene render p.toml -o x.fits",
        "clean v.uvh5 --mask p -o c",
        "clean v.uvh5 --log p -o c --overwrite",
        "dirty v.uvh5 -o p --overwrite",
    ] {
        refused(&s, line, &["named pipe"]);
    }
}

#[test]
fn a_device_without_an_end_is_refused() {
    let s = Scratch::new();
    for line in [
        "info /dev/zero",
        "layout show /dev/zero",
        "run /dev/zero -o out",
        "simulate --layout mm-y --freq 94GHz --bandwidth 1GHz --scene /dev/zero -o w.uvh5",
        "scene render /dev/zero -o x.fits",
    ] {
        refused(&s, line, &["/dev/zero", "device"]);
    }
}

#[test]
fn a_million_channels_are_told_or_refused_before_the_work() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    let line =
        "simulate --layout mm-y --freq 94GHz --bandwidth 8GHz --channels 1000000 --duration 10h --integration 1s --scene s.csv -o w.uvh5";
    refused(&s, line, &["w.uvh5", "visibilities", "GB", "disk"]);
    assert_eq!(s.names(), ["s.csv"]);
}
