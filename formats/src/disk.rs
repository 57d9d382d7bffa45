//! The free space of a disk.

use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// Bytes that this user may still write to the disk on which a file of this name lies or will lie; `None` where the system does not tell.
#[must_use]
pub fn free_disk(path: &Path) -> Option<u64> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = std::ffi::CString::new(folder.as_os_str().as_bytes()).ok()?;
    // SAFETY: the struct is plain numbers, for which all bits 0 are valid; it and the name outlive the call.
    let (failed, facts) = unsafe {
        let mut facts: libc::statvfs = std::mem::zeroed();
        (libc::statvfs(name.as_ptr(), &raw mut facts) != 0, facts)
    };
    (!failed).then(|| facts.f_bavail.saturating_mul(facts.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_has_room_and_a_missing_folder_tells_nothing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(free_disk(&folder.path().join("a.uvh5")).is_some_and(|bytes| bytes > 0));
        assert!(free_disk(&folder.path().join("no/a.uvh5")).is_none());
    }
}
