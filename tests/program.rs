//! The program in a scratch folder, run as a user runs it.

use assert_cmd::Command;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A scratch folder in which the program runs.
pub struct Scratch {
    folder: TempDir,
}

/// What the program said.
pub struct Said {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Scratch {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Names in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Run a command line, split at spaces.
    pub fn run(&self, line: &str) -> Said {
        // HDF5 locks the files that another test of this process has open, and a program that starts at that moment inherits the lock.
        let mut command = Command::cargo_bin("cittert").unwrap();
        command.current_dir(self.folder.path()).args(line.split_whitespace()).env("HDF5_USE_FILE_LOCKING", "FALSE");
        let output = command.output().unwrap();
        Said {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Run a command line that must succeed.
    pub fn ok(&self, line: &str) -> Said {
        let said = self.run(line);
        assert_eq!(said.code, 0, "{line}\n{}\n{}", said.out, said.err);
        said
    }

    /// Run a command line that must fail with this exit code. Its message on stderr must contain all these words, and there must be no
    /// panic.
    pub fn fails(&self, line: &str, code: i32, words: &[&str]) -> String {
        let said = self.run(line);
        assert_eq!(said.code, code, "{line}\n{}\n{}", said.out, said.err);
        for word in words {
            assert!(said.err.contains(word), "{line}: {word:?} is not in\n{}", said.err);
        }
        for bad in ["panicked", "RUST_BACKTRACE", "internal error", "HDF5-DIAG"] {
            assert!(!said.err.contains(bad), "{line}\n{}", said.err);
        }
        assert!(said.err.lines().count() <= 25, "one clear message, not a page: {line}\n{}", said.err);
        said.err
    }

    /// Run with `--json` and read what it prints.
    pub fn json(&self, line: &str) -> serde_json::Value {
        let said = self.ok(&format!("--json {line}"));
        serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{line}: {e}\n{}", said.out))
    }
}

/// The path of a table of reference values, which must exist.
pub fn oracle(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle").join(name);
    assert!(path.is_file(), "there is no table {}", path.display());
    path
}
