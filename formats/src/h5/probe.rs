//! Look at a file in a child process first: the system's HDF5 library crashes or loops on some damaged files, and no handler can
//! catch that, but a parent can. The child visits every object and reads what a reader would read first.

use super::read::H5In;
use crate::{FormatError, Result};
use num_complex::Complex;
use std::collections::VecDeque;
use std::os::unix::fs::MetadataExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Longest time that a child may look at a file, s; a good one takes milliseconds.
const PATIENCE_S: u32 = 30;
/// Memory that a child may take above what the process has, bytes.
const MORE_MEMORY: u64 = 1 << 30;
/// A dataset below this number of elements is read whole; of a larger one the first and the last row.
const SMALL: usize = 1 << 17;
/// Deepest nesting of groups that is looked at, and most objects.
const DEEPEST: usize = 8;
const MOST_OBJECTS: usize = 10_000;
/// Files remembered as good.
const REMEMBERED: usize = 16;

/// What tells one state of a file from another: device, inode, size, time of change (s, ns).
type Stamp = (u64, u64, u64, i64, i64);

/// Files that were found good, so that a file is looked at once though it is sniffed and opened by several readers.
static GOOD: Mutex<VecDeque<Stamp>> = Mutex::new(VecDeque::new());

/// Refuse a file that ends the process which reads it.
pub(super) fn probe(path: &Path) -> Result<()> {
    let meta = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    let stamp = (meta.dev(), meta.ino(), meta.size(), meta.mtime(), meta.mtime_nsec());
    if GOOD.lock().unwrap_or_else(PoisonError::into_inner).contains(&stamp) {
        return Ok(());
    }
    if let Some(found) = in_a_child(path) {
        let expected = "a sound HDF5 file (make it again, or copy it anew from where it came)";
        return Err(FormatError::malformed(path, "HDF5 structure", expected, found));
    }
    let mut good = GOOD.lock().unwrap_or_else(PoisonError::into_inner);
    if good.len() >= REMEMBERED {
        good.pop_front();
    }
    good.push_back(stamp);
    Ok(())
}

/// What was wrong, where the child died of the file. Where no child can be started the file is not looked at.
fn in_a_child(path: &Path) -> Option<String> {
    // The library's lock is held over the fork, so that no other thread is inside it then.
    let child = hdf5::sync::sync(|| {
        // SAFETY: the child does nothing with other threads: it holds the lock of HDF5, the C library sees to the lock of its allocator,
        // and it ends here without running what the parent left to do at its end.
        let child = unsafe { libc::fork() };
        if child == 0 {
            // A panic is for the parent to meet as well.
            let _ = catch_unwind(AssertUnwindSafe(|| {
                limits();
                if let Ok(file) = H5In::open_unseen(path) {
                    visit(&file, "", 0, &mut 0);
                }
            }));
            // SAFETY: ends the process at once.
            unsafe { libc::_exit(0) }
        }
        child
    });
    if child < 0 {
        return None;
    }
    let mut status = 0;
    // SAFETY: the process is our own child and `status` outlives the call.
    while unsafe { libc::waitpid(child, &mut status, 0) } < 0 {
        if std::io::Error::last_os_error().kind() != std::io::ErrorKind::Interrupted {
            return None;
        }
    }
    if !libc::WIFSIGNALED(status) {
        return None;
    }
    Some(match libc::WTERMSIG(status) {
        libc::SIGALRM => format!("damage on which HDF5 never ends (stopped after {PATIENCE_S} s)"),
        signal => format!("damage on which HDF5 crashes (signal {signal})"),
    })
}

/// No core file, no output, and bounded time and memory.
fn limits() {
    // SAFETY: plain calls of the C library in a process of one thread; the pointers are to values that outlive them.
    unsafe {
        let none = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        libc::setrlimit(libc::RLIMIT_CORE, &none);
        let mut usage = [0_u8; 64];
        let file = libc::open(c"/proc/self/statm".as_ptr(), libc::O_RDONLY);
        let got = libc::read(file, usage.as_mut_ptr().cast(), usage.len());
        libc::close(file);
        let digits = usage.iter().take(usize::try_from(got).unwrap_or(0)).take_while(|b| b.is_ascii_digit());
        let pages = digits.fold(0_u64, |n, b| n.saturating_mul(10).saturating_add(u64::from(b - b'0')));
        if pages > 0 {
            let bytes = pages.saturating_mul(u64::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096)).saturating_add(MORE_MEMORY);
            libc::setrlimit(libc::RLIMIT_AS, &libc::rlimit { rlim_cur: bytes, rlim_max: bytes });
        }
        let null = libc::open(c"/dev/null".as_ptr(), libc::O_WRONLY);
        if null >= 0 {
            libc::dup2(null, libc::STDOUT_FILENO);
            libc::dup2(null, libc::STDERR_FILENO);
        }
        // A crash must end the child, whatever handlers the parent has.
        for signal in [libc::SIGSEGV, libc::SIGBUS, libc::SIGABRT, libc::SIGFPE, libc::SIGILL, libc::SIGALRM] {
            libc::signal(signal, libc::SIG_DFL);
        }
        libc::alarm(PATIENCE_S);
    }
}

/// Read every dataset below a group as far as a reader would at first. Errors are for the parent to meet and to word.
fn visit(file: &H5In, group: &str, depth: usize, seen: &mut usize) {
    for name in file.members(group).unwrap_or_default() {
        *seen += 1;
        if *seen > MOST_OBJECTS {
            return;
        }
        let name = if group.is_empty() { name } else { format!("{group}/{name}") };
        match file.dataset(&name) {
            Ok(Some(dataset)) => look(file, &dataset, &name),
            _ if depth < DEEPEST => visit(file, &name, depth + 1, seen),
            _ => {}
        }
    }
}

fn look(file: &H5In, dataset: &hdf5::Dataset, name: &str) {
    let Ok(shape) = file.shape(dataset, name) else { return };
    let _ = file.texts(name);
    let whole = dataset.size() <= SMALL;
    if whole {
        let _ = file.reals(name);
    }
    let Some(rows) = shape.first().copied().filter(|n| *n > 0) else { return };
    let ends = [0..if whole { rows } else { 1 }, if whole { rows } else { rows - 1 }..rows];
    for range in ends.into_iter().filter(|r| !r.is_empty()) {
        if file.demand_complex(dataset, name).is_ok() {
            let _ = file.rows::<Complex<f32>, ndarray::IxDyn>(dataset, name, range);
        } else if file.demand_numbers(dataset, name).is_ok() {
            let _ = file.rows::<f64, ndarray::IxDyn>(dataset, name, range);
        }
    }
}
