//! Where casacore throws in places in which nobody can catch it. Each test runs itself again in a process of its own.

use super::{temp, write};
use crate::common::earth;
use cittert_formats::CreateOptions;
use cittert_formats::ms::MsWriter;
use std::path::Path;
use std::process::{Command, Output};

/// The place of the set in the second process.
const PLACE: &str = "CITTERT_TEST_PLACE";

/// The limit of the size of files in that process, bytes.
const LIMIT: &str = "CITTERT_TEST_LIMIT";

/// Run one test of this program again, with a place for its set.
fn again(test: &str, place: &Path, change: impl FnOnce(&mut Command)) -> Output {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--nocapture"]).env(PLACE, place);
    change(&mut command);
    command.output().unwrap()
}

#[test]
fn without_home_a_set_is_an_error_and_the_program_lives() {
    if let Some(path) = std::env::var_os(PLACE) {
        let e = MsWriter::create(Path::new(&path), &earth().header, &CreateOptions::default()).unwrap_err().to_string();
        assert!(e.contains("HOME"), "{e}");
        return;
    }
    let (dir, path) = temp();
    for empty in [false, true] {
        let out = again("endings::without_home_a_set_is_an_error_and_the_program_lives", &path, |c| {
            if empty {
                c.env("HOME", "")
            } else {
                c.env_remove("HOME")
            };
        });
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn a_disk_that_becomes_full_ends_in_a_message_and_leaves_nothing() {
    if let Some(path) = std::env::var_os(PLACE) {
        // A limit of the size of files is met as a full disk is.
        let bytes: u64 = std::env::var(LIMIT).unwrap().parse().unwrap();
        // SAFETY: plain calls; the limit outlives them.
        unsafe {
            libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
            let limit = libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
            libc::setrlimit(libc::RLIMIT_FSIZE, &limit);
        }
        write(Path::new(&path), &earth(), 100);
        return;
    }
    let (dir, path) = temp();
    let mut caught = [0, 0];
    for bytes in [0, 100, 1000, 4000, 40_000] {
        let out = again("endings::a_disk_that_becomes_full_ends_in_a_message_and_leaves_nothing", &path, |c| {
            c.env(LIMIT, bytes.to_string());
        });
        let said = String::from_utf8_lossy(&out.stderr);
        // The exit code is that of a failure, or that of a failed test where casacore gave an error that could be caught.
        match out.status.code() {
            Some(1) => caught[0] += 1,
            Some(101) => caught[1] += 1,
            other => panic!("{bytes} bytes: {other:?} {said}"),
        }
        assert!(said.contains("cannot be written") || said.contains("write error"), "{said}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{said}");
    }
    assert!(caught[0] > 0, "no exception was thrown in a destructor: {caught:?}");
}
