//! The list of the files that a program has written into a folder of results. Only these are replaced.

use crate::files::read_text;
use crate::{FormatError, Result};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Name of the list in the folder.
pub const LIST: &str = ".cittert-files";

/// The files of a folder that one program has written, relative to the folder.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct FileList {
    files: BTreeSet<PathBuf>,
}

/// The first line of the list.
fn head(writer: &str) -> String {
    format!("# Files in this folder that `{writer}` has written. It replaces these and no others.")
}

impl FileList {
    /// The list of a folder that `writer` has written. An empty folder has an empty list.
    ///
    /// # Errors
    /// A folder that has files and no list, or that another program has written.
    pub fn read(folder: &Path, writer: &str) -> Result<Self> {
        let path = folder.join(LIST);
        if fs::symlink_metadata(&path).is_err() {
            return match fs::read_dir(folder).map(|mut entries| entries.next().is_none()) {
                Ok(true) => Ok(Self::default()),
                Ok(false) => {
                    let found = format!("files, and no list {LIST} of those that may be replaced (folders of older versions have none)");
                    Err(FormatError::not_a(folder, expected(writer), found))
                }
                Err(e) => Err(FormatError::io(folder, "list", e)),
            };
        }
        let text = read_text(&path)?;
        let mut lines = text.lines();
        let first = lines.next().unwrap_or_default();
        if first != head(writer) {
            let by = first.split('`').nth(1).unwrap_or("another program");
            return Err(FormatError::not_a(folder, expected(writer), format!("a folder that {by} has written")));
        }
        Ok(Self { files: lines.filter(|l| !l.is_empty()).map(PathBuf::from).collect() })
    }

    /// The list of all files that are in a folder.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn of_all_in(folder: &Path) -> Result<Self> {
        let mut files = BTreeSet::new();
        walk(folder, Path::new(""), &mut |name| {
            files.insert(name);
        })
        .map_err(|e| FormatError::io(folder, "list", e))?;
        Ok(Self { files })
    }

    /// The list with more files.
    #[must_use]
    pub fn with(mut self, names: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        self.files.extend(names.into_iter().map(Into::into));
        self
    }

    /// Whether a file is in the list.
    #[must_use]
    pub fn has(&self, name: impl AsRef<Path>) -> bool {
        self.files.contains(name.as_ref())
    }

    /// The text of the list.
    #[must_use]
    pub fn text(&self, writer: &str) -> String {
        let lines = self.files.iter().filter(|f| f.as_os_str() != LIST).map(|f| f.display().to_string());
        std::iter::once(head(writer)).chain(lines).map(|line| line + "\n").collect()
    }

    /// What a folder holds beside the files of the list: files, links, and folders that are empty.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn others(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let mut others = Vec::new();
        let walked = walk(folder, Path::new(""), &mut |name| {
            if !self.files.contains(&name) && name.as_os_str() != LIST {
                others.push(name);
            }
        });
        walked.map_err(|e| FormatError::io(folder, "list", e)).map(|()| others)
    }
}

fn expected(writer: &str) -> String {
    format!("an empty folder, or one that `{writer}` has written (choose another folder, or move this one away)")
}

/// Call `found` with every file, link and empty folder below a folder.
fn walk(root: &Path, below: &Path, found: &mut dyn FnMut(PathBuf)) -> io::Result<()> {
    for entry in fs::read_dir(root.join(below))? {
        let entry = entry?;
        let name = below.join(entry.file_name());
        if entry.file_type()?.is_dir() && fs::read_dir(entry.path())?.next().is_some() {
            walk(root, &name, found)?;
        } else {
            found(name);
        }
    }
    Ok(())
}
