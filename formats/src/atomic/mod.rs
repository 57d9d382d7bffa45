//! Outputs that get their final name only when they are complete.
//!
//! An output grows in a hidden folder beside its final name; `commit` flushes it to the disk and renames it. A run that fails or is
//! killed therefore leaves the old output unchanged. The outputs of one command get their names together ([`Together`]), and a file that is
//! changed in place is locked ([`EditLock`]).

mod copy;
mod edit;
mod file;
mod folder;
mod list;
mod partial;
mod publish;
mod together;

pub use edit::EditLock;
pub use file::{AtomicFile, Drafts, try_output, write_file, write_file_now};
pub use folder::{AtomicDir, Replaces};
pub use list::{FileList, LIST};
pub use partial::{remove_unfinished, take_notes};
pub use together::{Together, beside, hold, is_private, keep_private, on_the_pool, remove_at_the_end};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FormatError;
    use std::fs::{self, OpenOptions};
    use std::io::Write;
    use std::path::Path;

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
        let out = AtomicDir::create(&path, false, Replaces::Holding("table.dat")).unwrap();
        fs::write(out.path().join("table.dat"), b"1").unwrap();
        out.commit().unwrap();
        let out = AtomicDir::create(&path, true, Replaces::Holding("table.dat")).unwrap();
        fs::write(out.path().join("table.dat"), b"2").unwrap();
        out.commit().unwrap();
        assert_eq!(fs::read(path.join("table.dat")).unwrap(), b"2");
        fs::remove_file(path.join("table.dat")).unwrap();
        assert!(matches!(AtomicDir::create(&path, true, Replaces::Holding("table.dat")), Err(FormatError::NotA { .. })));
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

    /// Whichever thread does the second work, and also where both write.
    #[test]
    fn what_is_written_beside_other_work_belongs_to_the_same_command() {
        let dir = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.scope(|_| {
            for (k, waits) in [false, true].into_iter().enumerate() {
                let paths = ["a", "b"].map(|name| dir.path().join(format!("{name}{k}")));
                let all = Together::begin();
                let begun = std::sync::Barrier::new(2);
                let write = |k: usize| {
                    // Where each waits for the other, they are on two threads.
                    waits.then(|| begun.wait());
                    write_file(&paths[k], false, b"1").map(|()| rayon::current_thread_index())
                };
                let (here, there) = beside(|| write(0), || write(1));
                assert!(!waits || here.unwrap() != there.unwrap());
                assert!(paths.iter().all(|p| !p.exists()));
                all.commit().unwrap();
                assert!(paths.iter().all(|p| p.exists()));
            }
            let (kept, lost) = (dir.path().join("kept"), dir.path().join("lost"));
            let all = Together::begin();
            beside(|| write_file(&kept, false, b"1"), || write_file(&lost, false, b"2")).1.unwrap();
            drop(all);
            assert!(!kept.exists() && !lost.exists());
        });
        assert_eq!(names(dir.path()), ["a0", "a1", "b0", "b1"]);
    }

    /// Outputs, locks and the wish for privacy from before, meanwhile and after belong together.
    #[test]
    fn the_outputs_of_work_on_the_pool_are_those_of_the_thread_that_waits() {
        let dir = tempfile::tempdir().unwrap();
        let [old, a, b, c] = ["old", "a", "b", "c"].map(|name| dir.path().join(name));
        fs::write(&old, b"0").unwrap();
        let all = Together::begin();
        hold(&old).unwrap();
        write_file(&a, false, b"1").unwrap();
        let inside = on_the_pool(|| {
            // The lock is held already.
            hold(&old).unwrap();
            keep_private();
            write_file(&b, false, b"2").unwrap();
            rayon::current_thread_index()
        });
        assert!(inside.is_some() && rayon::current_thread_index().is_none() && is_private());
        write_file(&c, false, b"3").unwrap();
        assert_eq!(names(dir.path()).iter().filter(|n| !n.starts_with('.')).count(), 1);
        all.commit().unwrap();
        assert_eq!(names(dir.path()), ["a", "b", "c", "old"]);
    }

    #[test]
    fn outputs_of_one_command_appear_together_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.uvh5"), dir.path().join("a.calh5"));
        fs::write(&a, b"old").unwrap();
        let both = Together::begin();
        write_file(&a, true, b"new").unwrap();
        write_file(&b, false, b"new").unwrap();
        assert_eq!((fs::read(&a).unwrap(), b.exists()), (b"old".to_vec(), false));
        drop(both);
        assert_eq!(names(dir.path()), ["a.uvh5"]);
        let both = Together::begin();
        write_file(&a, true, b"new").unwrap();
        write_file(&b, false, b"new").unwrap();
        remove_at_the_end(&a.with_file_name("none")).unwrap();
        // What appears in the meantime is not replaced, and then nothing is.
        fs::write(&b, b"of another").unwrap();
        assert!(matches!(both.commit(), Err(FormatError::Exists { .. })));
        assert_eq!((fs::read(&a).unwrap(), fs::read(&b).unwrap()), (b"old".to_vec(), b"of another".to_vec()));
        let both = Together::begin();
        write_file(&a, true, b"new").unwrap();
        remove_at_the_end(&b).unwrap();
        both.commit().unwrap();
        assert_eq!((fs::read(&a).unwrap(), names(dir.path())), (b"new".to_vec(), vec!["a.uvh5".to_owned()]));
    }

    #[test]
    fn what_is_written_inside_of_an_unfinished_folder_is_there_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let all = Together::begin();
        let out = AtomicDir::create(&dir.path().join("out"), false, Replaces::FilesOf("test")).unwrap();
        write_file(&out.path().join("a"), false, b"1").unwrap();
        assert_eq!(fs::read(out.path().join("a")).unwrap(), b"1");
        out.commit().unwrap();
        assert!(!dir.path().join("out").exists());
        all.commit().unwrap();
        assert_eq!(names(&dir.path().join("out")), [LIST, "a"]);
    }

    #[test]
    fn a_folder_of_results_keeps_what_others_have_put_into_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out");
        let write = |names: &[&str], overwrite| -> crate::Result<()> {
            let out = AtomicDir::create(&path, overwrite, Replaces::FilesOf("test"))?;
            names.iter().for_each(|n| fs::write(out.path().join(n), n).unwrap());
            out.commit()
        };
        write(&["a", "b"], false).unwrap();
        fs::create_dir_all(path.join("mine/deep")).unwrap();
        fs::write(path.join("mine/deep/notes"), "notes").unwrap();
        fs::write(path.join("thesis"), "thesis").unwrap();
        write(&["b", "c"], true).unwrap();
        assert_eq!(names(&path), [LIST, "b", "c", "mine", "thesis"]);
        assert_eq!(fs::read(path.join("mine/deep/notes")).unwrap(), b"notes");
        // A name that somebody else has taken is not replaced.
        let e = write(&["thesis"], true).unwrap_err().to_string();
        assert!(e.contains("thesis") && e.contains("test has not written"), "{e}");
        assert_eq!((names(&path).len(), fs::read(path.join("thesis")).unwrap()), (5, b"thesis".to_vec()));
        // Neither is the folder of another program, or one without a list.
        assert!(AtomicDir::create(&path, true, Replaces::FilesOf("other")).unwrap_err().to_string().contains("that test has written"));
        fs::remove_file(path.join(LIST)).unwrap();
        assert!(AtomicDir::create(&path, true, Replaces::FilesOf("test")).unwrap_err().to_string().contains("older versions"));
        assert_eq!(names(dir.path()), ["out"]);
    }

    #[test]
    fn leftovers_of_killed_processes_are_removed_and_those_of_living_ones_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.fits");
        let left = dir.path().join(".a.fits.0123456789ab.partial");
        fs::create_dir(&left).unwrap();
        fs::write(left.join("a.fits"), b"half").unwrap();
        let lock = std::fs::File::open(&left).unwrap();
        lock.lock().unwrap();
        write_file(&path, false, b"1").unwrap();
        assert!(left.exists() && take_notes().is_empty());
        lock.unlock().unwrap();
        write_file(&path, true, b"2").unwrap();
        assert_eq!(names(dir.path()), ["a.fits"]);
        assert!(take_notes().concat().contains("was killed"));
    }

    #[test]
    fn an_old_folder_that_a_killed_process_had_moved_away_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let left = dir.path().join(".out.0123456789ab.partial/replaced/out");
        fs::create_dir_all(&left).unwrap();
        fs::write(left.join("a"), b"1").unwrap();
        assert!(matches!(AtomicDir::create(&dir.path().join("out"), false, Replaces::FilesOf("test")), Err(FormatError::Exists { .. })));
        assert_eq!(fs::read(dir.path().join("out/a")).unwrap(), b"1");
        assert!(take_notes().concat().contains("is back"));
    }

    #[test]
    fn one_process_at_a_time_changes_a_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.uvh5");
        fs::write(&path, b"1").unwrap();
        let first = EditLock::take(&path).unwrap();
        assert!(matches!(EditLock::take(&path), Err(FormatError::InUse { .. })));
        drop(first);
        drop(EditLock::take(&path).unwrap());
        assert_eq!(names(dir.path()), ["a.uvh5"]);
    }

    #[test]
    #[cfg(unix)]
    fn an_output_has_the_permissions_of_what_it_replaces_and_of_private_inputs() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        fs::write(&a, b"1").unwrap();
        fs::set_permissions(&a, fs::Permissions::from_mode(0o640)).unwrap();
        write_file(&a, true, b"2").unwrap();
        let all = Together::begin();
        keep_private();
        write_file(&b, false, b"3").unwrap();
        all.commit().unwrap();
        assert_eq!((mode(&a), mode(&b)), (0o640, 0o600));
    }
}
