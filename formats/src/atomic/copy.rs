//! Copies of files and folders into hidden outputs. A copy is changed there and then takes the place of the original.

use rustix::fs::{SeekFrom as Part, ioctl_ficlone, seek};
use rustix::io::Errno;
use std::fs::{self, File, Permissions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

/// Largest depth of folders. A deeper one is a link that leads back to a folder above it.
const DEEPEST: usize = 32;

/// Copy the bytes of a file into an empty one. Where the file system can do it, both share their blocks. Holes stay holes.
pub(super) fn copy_bytes(from: &mut File, to: &mut File) -> io::Result<()> {
    if ioctl_ficlone(&*to, &*from).is_ok() {
        return Ok(());
    }
    let len = from.metadata()?.len();
    to.set_len(len)?;
    let mut at = 0;
    while at < len {
        let (start, end) = match seek(&*from, Part::Data(at)) {
            Ok(start) => (start, seek(&*from, Part::Hole(start))?),
            Err(Errno::NXIO) => break,
            // The file system knows no holes.
            Err(_) => (at, len),
        };
        from.seek(SeekFrom::Start(start))?;
        to.seek(SeekFrom::Start(start))?;
        if io::copy(&mut Read::take(&mut *from, end - start), to)? < end - start {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the file became shorter while it was copied"));
        }
        at = end;
    }
    Ok(())
}

/// Copy a file under a new name. Its owner may write to the copy.
fn copy_file(from: &Path, to: &Path, mode: u32) -> io::Result<()> {
    let mut new = File::create_new(to)?;
    copy_bytes(&mut File::open(from)?, &mut new)?;
    new.set_permissions(Permissions::from_mode(mode & 0o777 | 0o600))
}

/// Copy all that is in a folder into an empty folder. What links lead to is copied, so that a change of the copy never reaches another place.
pub(super) fn copy_folder(from: &Path, to: &Path) -> io::Result<()> {
    copy_level(from, to, 0)
}

fn copy_level(from: &Path, to: &Path, depth: usize) -> io::Result<()> {
    if depth > DEEPEST {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "a link in it leads back to a folder above"));
    }
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (old, new) = (entry.path(), to.join(entry.file_name()));
        match fs::metadata(&old) {
            Ok(meta) if meta.is_dir() => {
                fs::create_dir(&new)?;
                copy_level(&old, &new, depth + 1)?;
                fs::set_permissions(&new, Permissions::from_mode(meta.permissions().mode() & 0o777 | 0o700))?;
            }
            Ok(meta) if meta.is_file() => copy_file(&old, &new, meta.permissions().mode())?,
            Ok(_) => return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{} is no file and no folder", old.display()))),
            Err(_) if entry.file_type()?.is_symlink() => symlink(fs::read_link(&old)?, &new)?,
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::fs::MetadataExt;

    #[test]
    fn a_copy_has_the_same_bytes_and_holes() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        let mut file = File::create(&a).unwrap();
        file.write_all(&[7; 5000]).unwrap();
        file.seek(SeekFrom::Start(8 << 20)).unwrap();
        file.write_all(b"end").unwrap();
        file.set_len(16 << 20).unwrap();
        copy_bytes(&mut File::open(&a).unwrap(), &mut File::create(&b).unwrap()).unwrap();
        assert!(fs::read(&a).unwrap() == fs::read(&b).unwrap());
        // Both take about as much room on the disk. A file system without holes stores all of both.
        let (a, b) = (fs::metadata(&a).unwrap().blocks(), fs::metadata(&b).unwrap().blocks());
        assert!(b <= 2 * a, "{a} and {b} blocks");
    }

    #[test]
    fn a_copy_of_a_folder_holds_what_links_lead_to_and_can_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        fs::create_dir_all(a.join("SUB")).unwrap();
        fs::create_dir(&b).unwrap();
        fs::write(dir.path().join("outside"), b"1").unwrap();
        fs::write(a.join("SUB/table.dat"), b"2").unwrap();
        fs::set_permissions(a.join("SUB/table.dat"), Permissions::from_mode(0o444)).unwrap();
        symlink("../outside", a.join("link")).unwrap();
        symlink("nowhere", a.join("broken")).unwrap();
        copy_folder(&a, &b).unwrap();
        assert!(!fs::symlink_metadata(b.join("link")).unwrap().is_symlink());
        assert_eq!((fs::read(b.join("link")).unwrap(), fs::read(b.join("SUB/table.dat")).unwrap()), (b"1".to_vec(), b"2".to_vec()));
        assert!(fs::symlink_metadata(b.join("broken")).unwrap().is_symlink());
        assert_eq!(fs::metadata(b.join("SUB/table.dat")).unwrap().permissions().mode() & 0o777, 0o644);
        symlink("..", a.join("SUB/up")).unwrap();
        fs::create_dir(dir.path().join("c")).unwrap();
        assert!(copy_folder(&a, &dir.path().join("c")).is_err());
    }
}
