//! Outputs that get their final name only when they are complete.
//!
//! The bytes go to a hidden file (or directory) beside the final name; `commit` flushes them to the disk and renames the
//! file. A run that fails or is killed therefore leaves the old output unchanged.

use crate::{FormatError, Result};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Counter that makes the names of the hidden files of one process different.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// A file being written beside its final name. Dropping it without [`AtomicFile::commit`] removes what was written.
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    temp: PathBuf,
    overwrite: bool,
    done: bool,
}

impl AtomicFile {
    /// Begin an output with the final name `path`.
    ///
    /// # Errors
    /// The output exists and `overwrite` is false, it is a directory or another special file, or its directory is missing or not writable.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self> {
        let target = resolve(path);
        refuse_existing(&target, overwrite)?;
        if let Ok(meta) = fs::metadata(&target)
            && !meta.is_file()
        {
            let found = if meta.is_dir() { "it is a directory" } else { "it is a device or pipe" };
            return Err(FormatError::not_a(&target, "the name of a file to write", found));
        }
        let temp = hidden_name(&target)?;
        OpenOptions::new().write(true).create_new(true).open(&temp).map_err(|e| FormatError::io(&target, "create", explain(&target, e)))?;
        Ok(Self { target, temp, overwrite, done: false })
    }

    /// The file to write to: an empty file with a hidden name in the directory of the output.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.temp
    }

    /// The final name.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The hidden file, opened to write.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn open(&self) -> Result<File> {
        OpenOptions::new().read(true).write(true).open(&self.temp).map_err(|e| FormatError::io(&self.target, "write", e))
    }

    /// Flush the bytes to the disk and give the file its final name.
    ///
    /// # Errors
    /// An error of the file system; a full disk often shows here. The old output then stays in place.
    pub fn commit(mut self) -> Result<()> {
        let file = self.open()?;
        file.sync_all().map_err(|e| FormatError::io(&self.target, "flush to disk", e))?;
        drop(file);
        refuse_existing(&self.target, self.overwrite)?;
        fs::rename(&self.temp, &self.target).map_err(|e| FormatError::io(&self.target, "rename the finished file to", e))?;
        self.done = true;
        sync_folder(&self.target);
        Ok(())
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if !self.done {
            // A failure cannot be reported here, and the file is hidden.
            let _ = fs::remove_file(&self.temp);
        }
    }
}

/// A directory being written beside its final name (a Measurement Set, the results of a run).
#[derive(Debug)]
pub struct AtomicDir {
    target: PathBuf,
    temp: PathBuf,
    done: bool,
}

impl AtomicDir {
    /// Begin a directory with the final name `path`. Only a directory that holds a file called `marker` is replaced, so that a mistyped name
    /// cannot delete another directory.
    ///
    /// # Errors
    /// The output exists and `overwrite` is false, or is not a directory with `marker` in it, or its parent directory is not writable.
    pub fn create(path: &Path, overwrite: bool, marker: &str) -> Result<Self> {
        let target = resolve(path);
        refuse_existing(&target, overwrite)?;
        if target.exists() && !target.join(marker).exists() {
            let found = if target.is_dir() { format!("a directory without {marker}") } else { "a file".into() };
            return Err(FormatError::not_a(&target, format!("a directory with {marker}, which may be replaced"), found));
        }
        let temp = hidden_name(&target)?;
        fs::create_dir(&temp).map_err(|e| FormatError::io(&target, "create", explain(&target, e)))?;
        Ok(Self { target, temp, done: false })
    }

    /// The directory to write to: an empty directory with a hidden name beside the output.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.temp
    }

    /// Flush every file to the disk and give the directory its final name.
    ///
    /// # Errors
    /// An error of the file system. The old output then stays in place.
    pub fn commit(mut self) -> Result<()> {
        sync_tree(&self.temp).map_err(|e| FormatError::io(&self.target, "flush to disk", e))?;
        let rename = |from: &Path, to: &Path| fs::rename(from, to).map_err(|e| FormatError::io(&self.target, "rename to", e));
        if self.target.exists() {
            let old = hidden_name(&self.target)?;
            rename(&self.target, &old)?;
            if let Err(e) = rename(&self.temp, &self.target) {
                let _ = fs::rename(&old, &self.target);
                return Err(e);
            }
            fs::remove_dir_all(&old).map_err(|e| FormatError::io(&old, "remove the replaced directory", e))?;
        } else {
            rename(&self.temp, &self.target)?;
        }
        self.done = true;
        sync_folder(&self.target);
        Ok(())
    }
}

impl Drop for AtomicDir {
    fn drop(&mut self) {
        if !self.done {
            let _ = fs::remove_dir_all(&self.temp);
        }
    }
}

/// Write the whole content of a small output at once.
///
/// # Errors
/// As [`AtomicFile::create`] and [`AtomicFile::commit`].
pub fn write_file(path: &Path, overwrite: bool, content: &[u8]) -> Result<()> {
    let out = AtomicFile::create(path, overwrite)?;
    io::Write::write_all(&mut out.open()?, content).map_err(|e| FormatError::io(path, "write", e))?;
    out.commit()
}

/// Follow symbolic links, so that a link to an output stays a link.
fn resolve(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(meta) if meta.is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.into()),
        _ => path.into(),
    }
}

fn refuse_existing(target: &Path, overwrite: bool) -> Result<()> {
    if !overwrite && fs::symlink_metadata(target).is_ok() {
        return Err(FormatError::Exists { path: target.into() });
    }
    Ok(())
}

/// Directory of an output: `.` for a name without a directory.
fn folder(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn hidden_name(target: &Path) -> Result<PathBuf> {
    let Some(name) = target.file_name() else {
        return Err(FormatError::not_a(target, "the name of an output", "a path without a name"));
    };
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    // Long names are cut: the hidden name must not exceed the 255 bytes of most file systems.
    let short: String = name.to_string_lossy().chars().take(60).collect();
    Ok(folder(target).join(format!(".{short}.{}-{number}.partial", std::process::id())))
}

/// An error that says that the directory is missing, not the file.
fn explain(target: &Path, error: io::Error) -> io::Error {
    let folder = folder(target);
    if error.kind() == io::ErrorKind::NotFound && !folder.is_dir() {
        return io::Error::new(error.kind(), format!("there is no directory {}", folder.display()));
    }
    error
}

/// Flush the rename to the disk. A file system that cannot do this is not an error.
fn sync_folder(target: &Path) {
    if let Ok(dir) = File::open(folder(target)) {
        let _ = dir.sync_all();
    }
}

fn sync_tree(dir: &Path) -> io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_tree(&entry.path())?;
        } else {
            File::open(entry.path())?.sync_all()?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(dir: &Path) -> Vec<String> {
        let mut n: Vec<String> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        n.sort();
        n
    }

    #[test]
    fn an_output_appears_only_when_it_is_complete() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.fits");
        let out = AtomicFile::create(&path, false).unwrap();
        out.open().unwrap().write_all(b"new").unwrap();
        assert!(!path.exists());
        out.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(dir.path()), ["a.fits"]);
    }

    #[test]
    fn an_abandoned_output_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.fits");
        fs::write(&path, b"old").unwrap();
        assert!(matches!(AtomicFile::create(&path, false), Err(FormatError::Exists { .. })));
        let out = AtomicFile::create(&path, true).unwrap();
        out.open().unwrap().write_all(b"half").unwrap();
        drop(out);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(dir.path()), ["a.fits"]);
    }

    #[test]
    fn a_missing_folder_and_a_directory_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let e = AtomicFile::create(&dir.path().join("no/where.fits"), false).unwrap_err().to_string();
        assert!(e.contains("there is no directory") && e.contains("where.fits"), "{e}");
        let e = AtomicFile::create(dir.path(), true).unwrap_err().to_string();
        assert!(e.contains("it is a directory"), "{e}");
    }

    #[test]
    fn a_full_disk_is_an_error_and_no_file() {
        // /dev/full refuses every write as a full disk does.
        let Ok(mut full) = OpenOptions::new().write(true).open("/dev/full") else { return };
        let e = full.write_all(b"x").unwrap_err();
        assert!(FormatError::io(Path::new("x.fits"), "write", e).to_string().contains("No space left"));
    }

    #[test]
    fn a_directory_is_replaced_only_when_it_holds_the_marker() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ms");
        let out = AtomicDir::create(&path, false, "table.dat").unwrap();
        fs::write(out.path().join("table.dat"), b"1").unwrap();
        out.commit().unwrap();
        let out = AtomicDir::create(&path, true, "table.dat").unwrap();
        fs::write(out.path().join("table.dat"), b"2").unwrap();
        out.commit().unwrap();
        assert_eq!(fs::read(path.join("table.dat")).unwrap(), b"2");
        fs::remove_file(path.join("table.dat")).unwrap();
        assert!(matches!(AtomicDir::create(&path, true, "table.dat"), Err(FormatError::NotA { .. })));
        assert_eq!(names(dir.path()), ["a.ms"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_to_an_output_stays_a_link() {
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real"), dir.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_file(&link, true, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }
}
