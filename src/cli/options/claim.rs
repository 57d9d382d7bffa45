//! The guard of every command that writes: no output is an input, and no two outputs are one file.

use crate::cli::failure::{Failure, Result};
use std::fs::Metadata;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// Where a path leads, by all links.
struct Place {
    path: PathBuf,
    full: PathBuf,
    /// Device and inode of a file that exists. Two hard links have the same.
    inode: Option<(u64, u64)>,
}

fn inode(meta: &Metadata) -> (u64, u64) {
    (meta.dev(), meta.ino())
}

impl Place {
    fn of(path: &Path) -> Self {
        let beside = || {
            let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            parent.canonicalize().ok().zip(path.file_name()).map(|(folder, name)| folder.join(name))
        };
        let full = path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_path_buf());
        Self { path: path.to_path_buf(), full, inode: path.metadata().ok().as_ref().map(inode) }
    }

    /// A standard stream that goes to a file.
    fn of_stream(device: &str, name: &str) -> Option<Self> {
        let meta = std::fs::metadata(device).ok().filter(Metadata::is_file)?;
        Some(Self { path: name.into(), full: Path::new(device).canonicalize().ok()?, inode: Some(inode(&meta)) })
    }

    fn is(&self, other: &Self) -> bool {
        self.full == other.full || self.inode.is_some() && self.inode == other.inode
    }

    fn holds(&self, other: &Self) -> bool {
        self.full.is_dir() && other.full.starts_with(&self.full)
    }

    fn name(&self) -> std::path::Display<'_> {
        self.path.display()
    }
}

/// Whether two paths lead to one file.
pub(super) fn is_one_file(a: &Path, b: &Path) -> bool {
    Place::of(a).is(&Place::of(b))
}

/// Refuse outputs that would replace an input or one another. Outputs of a private input are made private too.
///
/// # Errors
/// The first such pair, with both names.
pub fn keep_apart(outputs: &[&Path], inputs: &[&Path]) -> Result<()> {
    refuse_collisions(outputs, inputs)?;
    if any_private(inputs) {
        cittert_formats::atomic::keep_private();
    }
    Ok(())
}

/// Standard output and standard error count as outputs where they go to a file.
fn refuse_collisions(outputs: &[&Path], inputs: &[&Path]) -> Result<()> {
    let outputs: Vec<Place> = outputs.iter().map(|p| Place::of(p)).collect();
    let inputs: Vec<Place> = inputs.iter().filter(|p| p.exists()).map(|p| Place::of(p)).collect();
    let streams = [("/dev/stdout", "standard output"), ("/dev/stderr", "standard error")];
    let streams: Vec<Place> = streams.into_iter().filter_map(|(device, name)| Place::of_stream(device, name)).collect();
    let usage = |text: String| Err(Failure::usage(text));
    for out in outputs.iter().chain(&streams) {
        for input in &inputs {
            if out.is(input) {
                return usage(format!("{}: this output is the input {}: choose another name for it", out.name(), input.name()));
            }
            if out.holds(input) {
                return usage(format!(
                    "{}: this output is a folder that holds the input {}: choose another folder",
                    out.name(),
                    input.name()
                ));
            }
            if input.holds(out) {
                return usage(format!(
                    "{}: this output lies inside of the input {}: choose another place for it",
                    out.name(),
                    input.name()
                ));
            }
        }
    }
    for (k, a) in outputs.iter().enumerate() {
        if let Some(b) = outputs[..k].iter().chain(&streams).find(|b| a.is(b)) {
            return usage(format!(
                "{} and {}: two outputs cannot go into one file; choose another name for one of them",
                b.name(),
                a.name()
            ));
        }
    }
    Ok(())
}

/// Whether one of the inputs is for its owner alone.
fn any_private(inputs: &[&Path]) -> bool {
    let mode = |path: &&Path| path.metadata().ok().map(|meta| meta.permissions().mode());
    inputs.iter().filter_map(mode).any(|mode| mode & 0o077 == 0)
}
