//! Nothing is lost: inputs, the files of others in a folder of results, and what two processes add to one file.

use crate::program::Scratch;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A small set of visibilities and its scene.
fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --duration 20s --integration 10s -o v.uvh5");
    s
}

fn command(s: &Scratch, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cittert"));
    command.current_dir(s.path("")).args(line.split_whitespace()).env("HDF5_USE_FILE_LOCKING", "FALSE");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn start(s: &Scratch, line: &str) -> Child {
    command(s, line).spawn().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn rows(s: &Scratch, file: &str) -> u64 {
    s.json(&format!("info {file}"))["n_blts"].as_u64().unwrap()
}

#[test]
fn a_log_in_the_place_of_the_data_is_refused_before_the_data_are_touched() {
    let s = scratch();
    let before = std::fs::read(s.path("v.uvh5")).unwrap();
    for line in [
        "clean v.uvh5 -o p --log v.uvh5 --overwrite",
        "mem v.uvh5 -o p --log ./v.uvh5 --overwrite",
        "mem v.uvh5 -o p --terms vis --log v.uvh5 --overwrite",
    ] {
        s.fails(line, 2, &["v.uvh5", "this output is the input"]);
        assert_eq!(std::fs::read(s.path("v.uvh5")).unwrap(), before, "{line}");
    }
    s.fails("clean v.uvh5 -o p --log p-image.fits", 2, &["p-image.fits", "two outputs cannot go into one file"]);
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn data_and_true_gains_under_two_names_of_one_file_are_refused() {
    let s = scratch();
    s.fails("corrupt v.uvh5 --phase-rms 1rad -o y.uvh5 --gains ./y.uvh5", 2, &["./y.uvh5", "one file"]);
    s.fails("corrupt v.uvh5 --phase-rms 1rad -o y.uvh5 --gains v.uvh5 --overwrite", 2, &["v.uvh5", "this output is the input"]);
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn results_that_are_printed_into_an_input_are_refused() {
    let s = scratch();
    let before = std::fs::read(s.path("v.uvh5")).unwrap();
    let file = std::fs::OpenOptions::new().append(true).open(s.path("v.uvh5")).unwrap();
    let out = command(&s, "--json clean v.uvh5 -o p").stdout(file).output().unwrap();
    assert!(!out.status.success() && said(&out).contains("standard output"), "{}", said(&out));
    assert_eq!(std::fs::read(s.path("v.uvh5")).unwrap(), before);
}

#[test]
fn changes_in_place_still_work_and_leave_no_lock() {
    let s = scratch();
    s.ok("corrupt v.uvh5 --phase-rms 1rad -o c.uvh5");
    s.ok("applycal c.uvh5 c.calh5 -o c.uvh5 --overwrite");
    s.ok("predict v.uvh5 --model s.csv --into model -o v.uvh5 --overwrite");
    s.ok("info v.uvh5");
    s.fails("applycal c.uvh5 c.calh5 -o c.calh5 --overwrite", 2, &["c.calh5"]);
    assert_eq!(s.names(), ["c.calh5", "c.uvh5", "s.csv", "v.uvh5"]);
}

const CONFIG: &str = r#"
title = "a small run"
layout = { name = "mm-y" }
scene = { file = "s.csv" }
[simulate]
freq = "94GHz"
bandwidth = "1GHz"
[image]
size = 64
cell = "1mrad"
"#;

#[test]
fn a_run_replaces_its_own_files_and_keeps_those_of_others() {
    let s = scratch();
    s.write("c.toml", CONFIG);
    s.ok("run c.toml -o out");
    s.write("out/thesis.tex", "years");
    s.ok("run c.toml -o out --overwrite");
    assert_eq!(std::fs::read(s.path("out/thesis.tex")).unwrap(), b"years");
    // A name that the run needs.
    s.write("c.toml", format!("{CONFIG}[mem]\nniter = 5\n"));
    s.write("out/mem-image.fits", "mine");
    s.fails("run c.toml -o out --overwrite", 1, &["mem-image.fits", "cittert run has not written this file"]);
    assert_eq!(std::fs::read(s.path("out/mem-image.fits")).unwrap(), b"mine");
    // Its own configuration.
    std::fs::create_dir(s.path("in")).unwrap();
    s.write("in/c.toml", CONFIG);
    s.write("in/s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.write("in/report.html", "a page");
    s.fails("run in/c.toml -o in --overwrite", 2, &["in/c.toml", "holds the input"]);
    // Another folder with a page, as an older version left it.
    s.fails("run c.toml -o in --overwrite", 1, &["in", "older versions"]);
    assert_eq!(std::fs::read_dir(s.path("in")).unwrap().count(), 3);
    // An error names the files of the run by their final names.
    s.write("c.toml", CONFIG.replace("1mrad", "50deg"));
    let said = s.fails("run c.toml -o other", 1, &["other/vis.uvh5"]);
    assert!(!said.contains("partial"), "{said}");
    s.write("c.toml", CONFIG);
    assert_eq!(s.names(), ["c.toml", "in", "out", "s.csv", "v.uvh5"]);
}

const STUDY: &str = r#"
title = "a small study"
seeds = 2
layout = { name = "mm-y" }
scene = { points = [{ flux = "1Jy" }] }
[simulate]
freq = "94GHz"
bandwidth = "1GHz"
[image]
size = 64
cell = "1mrad"
[clean]
niter = 10
[corrupt]
phase-rms = "20deg"
"#;

#[test]
fn a_run_does_not_replace_the_folder_of_a_study_nor_a_study_the_files_of_others() {
    let s = scratch();
    s.write("c.toml", CONFIG);
    s.write("study.toml", STUDY);
    s.ok("study study.toml -o out");
    let journal = std::fs::read(s.path("out/journal.jsonl")).unwrap();
    s.fails("run c.toml -o out --overwrite", 1, &["out", "cittert study"]);
    assert_eq!(std::fs::read(s.path("out/journal.jsonl")).unwrap(), journal);
    s.write("out/failures.csv", "mine");
    s.fails("study study.toml -o out --overwrite", 1, &["failures.csv", "cittert study has not written this file"]);
    assert_eq!(std::fs::read(s.path("out/failures.csv")).unwrap(), b"mine");
    std::fs::remove_file(s.path("out/failures.csv")).unwrap();
    s.write("out/notes", "mine");
    s.ok("study study.toml -o out --overwrite");
    assert_eq!(std::fs::read(s.path("out/notes")).unwrap(), b"mine");
    s.ok("run c.toml -o r");
    s.fails("study study.toml -o r --overwrite", 1, &["journal.jsonl"]);
}

#[test]
fn a_set_is_not_appended_to_itself_and_two_appends_at_once_lose_no_row() {
    let s = scratch();
    let one = rows(&s, "v.uvh5");
    s.fails("convert v.uvh5 v.uvh5 --append", 2, &["v.uvh5", "this output is the input"]);
    s.ok("convert v.uvh5 w.uvh5");
    let both = [start(&s, "convert v.uvh5 w.uvh5 --append"), start(&s, "convert v.uvh5 w.uvh5 --append")];
    let done = both.map(|child| child.wait_with_output().unwrap());
    let appended = done.iter().filter(|out| out.status.success()).count() as u64;
    assert!(appended >= 1 && done.iter().all(|out| out.status.success() || said(out).contains("w.uvh5: another process")));
    assert_eq!(rows(&s, "w.uvh5"), (1 + appended) * one);
    assert_eq!(s.names(), ["s.csv", "v.uvh5", "w.uvh5"]);
}

#[test]
fn two_columns_that_are_added_at_once_are_both_kept() {
    let s = scratch();
    let line = |column: &str| format!("predict v.uvh5 --model s.csv --into {column} -o v.uvh5 --overwrite");
    let both = [start(&s, &line("model")), start(&s, &line("residual"))];
    let done = both.map(|child| child.wait_with_output().unwrap());
    for (column, out) in ["model", "residual"].into_iter().zip(&done) {
        assert!(out.status.success() || said(out).contains("v.uvh5: another process"), "{}", said(out));
        if out.status.success() {
            s.ok(&format!("dirty v.uvh5 --column {column} -o {column}.fits"));
        }
    }
    assert!(done.iter().any(|out| out.status.success()));
}

#[test]
fn a_file_that_another_program_has_locked_is_called_locked() {
    let s = scratch();
    let held = std::fs::File::open(s.path("v.uvh5")).unwrap();
    held.lock().unwrap();
    for line in ["info v.uvh5", "dirty v.uvh5 -o d.fits"] {
        let out = command(&s, line).env("HDF5_USE_FILE_LOCKING", "TRUE").output().unwrap();
        assert!(out.status.code() == Some(1) && said(&out).contains("locked it"), "{line}: {}", said(&out));
    }
    held.unlock().unwrap();
    let out = command(&s, "info v.uvh5").env("HDF5_USE_FILE_LOCKING", "TRUE").output().unwrap();
    assert!(out.status.success(), "{}", said(&out));
}

#[test]
fn results_that_cannot_be_printed_are_an_error() {
    let s = scratch();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for line in ["--json info v.uvh5", "info v.uvh5"] {
        let out = command(&s, line).stdout(full()).output().unwrap();
        assert!(out.status.code() == Some(1) && said(&out).contains("standard output"), "{line}: {}", said(&out));
    }
    s.fails("clean v.uvh5 -o p --log /dev/full --overwrite", 1, &["/dev/full", "device"]);
    assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
}

#[test]
fn names_that_are_not_utf_8_are_refused_at_once() {
    let s = scratch();
    let odd = std::ffi::OsStr::from_bytes(b"odd-\xff");
    std::fs::copy(s.path("v.uvh5"), s.path("").join(odd)).unwrap();
    for line in ["info", "clean v.uvh5 -o", "dirty v.uvh5 -o", "layout show", "run c.toml -o"] {
        let out = command(&s, line).arg(odd).output().unwrap();
        assert!(out.status.code() == Some(2) && said(&out).contains("not UTF-8"), "{line}: {}", said(&out));
    }
    assert_eq!(std::fs::read_dir(s.path("")).unwrap().count(), 3);
}

#[test]
fn a_run_works_in_a_folder_whose_name_is_no_text() {
    let s = Scratch::new();
    let odd = s.path("").join(std::ffi::OsStr::from_bytes(b"odd-\xff"));
    std::fs::create_dir(&odd).unwrap();
    std::fs::write(odd.join("s.csv"), "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n").unwrap();
    std::fs::write(odd.join("c.toml"), CONFIG).unwrap();
    for line in ["run c.toml -o out", "run c.toml -o out/ --overwrite"] {
        let out = command(&s, line).current_dir(&odd).output().unwrap();
        assert!(out.status.success(), "{line}: {}", said(&out));
    }
    assert!(odd.join("out/report.html").is_file());
    assert_eq!(std::fs::read_dir(&odd).unwrap().count(), 3);
}

#[test]
fn a_name_that_is_too_long_and_a_folder_without_leave_to_write_are_said_at_once() {
    let s = scratch();
    let long = "x".repeat(250);
    s.fails(&format!("clean v.uvh5 -o {long}"), 1, &["too long"]);
    s.fails(&format!("selfcal v.uvh5 -o {long}"), 1, &["too long"]);
    std::fs::create_dir(s.path("shut")).unwrap();
    std::fs::set_permissions(s.path("shut"), std::fs::Permissions::from_mode(0o500)).unwrap();
    // The administrator may write everywhere.
    if std::fs::write(s.path("shut/try"), "").is_err() {
        s.fails("clean v.uvh5 -o shut/p", 1, &["shut", "may not write"]);
    }
    assert_eq!(s.names(), ["s.csv", "shut", "v.uvh5"]);
}

#[test]
fn what_is_made_of_a_private_input_is_private() {
    let s = scratch();
    std::fs::set_permissions(s.path("v.uvh5"), std::fs::Permissions::from_mode(0o600)).unwrap();
    s.ok("clean v.uvh5 -o p --size 64 --cell 1mrad --log p.jsonl");
    s.ok("corrupt v.uvh5 --phase-rms 1rad -o c.uvh5");
    s.ok("convert v.uvh5 w.uvfits");
    for name in s.names().iter().filter(|n| *n != "s.csv") {
        let mode = s.path(name).metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(mode, 0o600, "{name}");
    }
    s.ok("dirty c.uvh5 -o d.fits --size 64 --cell 1mrad");
    s.ok("layout convert mm-y -o m.toml");
    assert_ne!(s.path("m.toml").metadata().unwrap().permissions().mode() & 0o077, 0);
}

#[test]
fn a_table_quotes_names_with_commas() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    let antenna = |name: &str, x: f64| format!("[[antenna]]\nname = '{name}'\nposition_m = [{x:?}, 0.5, 0.0]\n");
    let antennas: String = ["a,1", "b\"2", "c", "d"].iter().zip([0.0, 1.0, 3.0, 7.0]).map(|(n, x)| antenna(n, x)).collect();
    s.write("l.toml", format!("name = \"x\"\nframe = \"boresight\"\n{antennas}"));
    s.ok("simulate --layout l.toml --scene s.csv --freq 94GHz --bandwidth 1GHz -o v.uvh5");
    s.ok("closure v.uvh5 -o c.csv");
    let mut table = csv::Reader::from_path(s.path("c.csv")).unwrap();
    let columns = table.headers().unwrap().clone();
    let ant = columns.iter().position(|c| c == "ant1").unwrap();
    let records: Vec<csv::StringRecord> = table.records().collect::<Result<_, _>>().unwrap();
    assert!(records.iter().any(|r| &r[ant] == "a,1") && records.iter().any(|r| &r[ant + 1] == "b\"2"));
    assert!(records.iter().all(|r| r.len() == columns.len()));
}

#[test]
fn a_run_that_is_ended_by_a_signal_removes_what_it_began() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.write("v.uvh5", "an older file");
    let line = "simulate --layout mm-u --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 64 --duration 400s --method dft -q -o v.uvh5 --overwrite";
    // The children of a process that ignores a signal, as under `nohup`, ignore it too.
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = u64::from_str_radix(status.lines().find_map(|l| l.strip_prefix("SigIgn:")).unwrap().trim(), 16).unwrap();
    for (signal, number) in [("TERM", 15), ("INT", 2), ("HUP", 1)].into_iter().filter(|(_, n)| ignored >> (n - 1) & 1 == 0) {
        let mut child = start(&s, line);
        let begun = Instant::now();
        while s.names().len() < 3 {
            assert!(begun.elapsed() < Duration::from_secs(20) && child.try_wait().unwrap().is_none());
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(20));
        assert!(Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap().success());
        let status = child.wait().unwrap();
        assert_eq!(std::os::unix::process::ExitStatusExt::signal(&status), Some(number));
        assert_eq!(s.names(), ["s.csv", "v.uvh5"]);
        assert_eq!(std::fs::read(s.path("v.uvh5")).unwrap(), b"an older file");
    }
}

#[test]
fn a_picture_that_a_scene_names_is_not_replaced_by_the_rendered_scene() {
    let s = Scratch::new();
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_pixel(20, 20, image::Luma([128])).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let picture = s.write("heights.png", png.get_ref());
    let scene = "kind = \"solids\"\nname = \"hill\"\ncamera = { position_m = [0, 0, 200], pitch_deg = -90, fov_deg = 5, size_px = [16, 16] }\n\
        [surface.soil]\nlayer = [{ material = \"soil\" }]\n[ground]\nsurface = \"soil\"\n\
        height_field = { origin_m = [-10, -10], cell_m = 1, image = \"heights.png\", low_m = 0, high_m = 9.5 }\n";
    s.write("t.toml", scene);
    s.ok("scene render t.toml -o t.fits");
    s.fails("scene render t.toml -o heights.png --overwrite", 2, &["heights.png", "this output is the input"]);
    s.fails("scene convert t.toml heights.png --overwrite", 2, &["heights.png", "this output is the input"]);
    assert_eq!(std::fs::read(picture).unwrap(), *png.get_ref());
}

#[test]
fn what_a_killed_run_has_left_is_told_and_removed() {
    let s = scratch();
    std::fs::create_dir(s.path(".d.fits.0123456789ab.partial")).unwrap();
    s.write(".d.fits.0123456789ab.partial/d.fits", "half");
    let said = s.ok("dirty v.uvh5 -o d.fits --size 64 --cell 1mrad");
    assert!(said.err.contains(".d.fits.0123456789ab.partial: removed"), "{}", said.err);
    assert_eq!(s.names(), ["d.fits", "s.csv", "v.uvh5"]);
}

#[test]
fn corrupted_data_appear_only_with_their_true_gains() {
    let s = scratch();
    std::fs::create_dir(s.path("c.calh5")).unwrap();
    s.fails("corrupt v.uvh5 --phase-rms 1rad -o c.uvh5 --overwrite", 1, &["c.calh5", "directory"]);
    assert_eq!(s.names(), ["c.calh5", "s.csv", "v.uvh5"]);
}
