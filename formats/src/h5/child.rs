//! A child process that reads files on trial. It is kept from file to file, because a fork for each file would cost more than the trial.
//!
//! There are three processes. The program sends paths through a pipe. A worker receives each path, reads the file and answers 0. The keeper
//! starts the worker and never opens a file: when a file crashes the worker, the keeper answers with the signal and starts another worker.
//! A worker is also replaced after a number of files, and when the library has left a part of a damaged file open.

use hdf5_sys::h5f::{H5F_OBJ_DATASET, H5F_OBJ_FILE, H5F_OBJ_GROUP, H5Fget_obj_count};
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::os::fd::{AsRawFd, FromRawFd, RawFd};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering::SeqCst};
use std::sync::{Mutex, PoisonError};

/// Largest computing time of a worker on a small file, and on each 16 MiB of a larger one, s. A sound file takes milliseconds.
const PATIENCE_S: u64 = 1;
/// Largest elapsed time for one file, s. A slow disk may need this long.
const LONG_PATIENCE_S: u32 = 60;
/// Memory that a worker may use in addition to the memory of the program and twice the size of the file, bytes.
const MORE_MEMORY: u64 = 2 << 30;
/// Answer if the library needs more memory than that for the file. It takes the place of a signal number.
pub(super) const NO_MEMORY: i32 = 255;
/// Base of the answers for files with a flaw: the number of the flaw is added. Signal numbers are smaller.
pub(super) const UNSOUND: i32 = 200;
/// Number of files that one worker reads.
const FILES_OF_A_WORKER: usize = 500;
/// Exit codes of a worker: the program has ended; the keeper must start another worker.
const ALONE: i32 = 0;
const NEXT: i32 = 1;

/// The function that a worker runs on a file. The result is the number of the flaw, for a file that must not be read.
type Look = fn(&Path) -> Option<usize>;

/// The keeper, as the program holds it.
struct Child {
    requests: File,
    replies: File,
    /// Process number of the program: a forked copy of the program must not use these pipes.
    owner: u32,
    keeper: libc::pid_t,
}

/// True in the child process, which reads the files.
static CHILD: AtomicBool = AtomicBool::new(false);

/// True in the child process.
pub(super) fn in_the_child() -> bool {
    CHILD.load(SeqCst)
}

static KEPT: Mutex<Option<Child>> = Mutex::new(None);

/// Let a worker read a file. The answer is 0 for a sound file, or the signal that ended the worker, or [`NO_MEMORY`], or [`UNSOUND`] plus the
/// number of a flaw. It is `None` where no process can be started.
pub(super) fn look_at(path: &Path, look: Look) -> Option<i32> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let owner = std::process::id();
    if let Some(child) = kept.as_mut().filter(|c| c.owner == owner)
        && let Ok(signal) = child.ask(path)
    {
        return Some(signal);
    }
    // There is no keeper yet, or it was ended from outside.
    drop(kept.take());
    let (mut child, lasting) = Child::start(look).ok()?;
    let signal = child.ask(path).ok()?;
    if lasting {
        *kept = Some(child);
    }
    Some(signal)
}

impl Child {
    /// Start a keeper; true where it may be kept. A child that is forked while this process has HDF5 files open inherits them, and would use
    /// their old state later. Such a child is used for one file only.
    fn start(look: Look) -> Result<(Self, bool)> {
        let (their_requests, requests) = pipe()?;
        let (replies, their_replies) = pipe()?;
        let owner = std::process::id();
        // The lock of the library is held during the fork, so that no other thread is inside the library.
        let (keeper, lasting) = hdf5::sync::sync(|| {
            let lasting = open_objects(H5F_OBJ_FILE) == 0;
            // SAFETY: the child uses nothing of other threads. It holds the lock of HDF5, and the C library handles the lock of its allocator.
            // The child ends without running the exit handlers of the parent.
            let pid = unsafe { libc::fork() };
            if pid == 0 {
                // With its copies of the program's pipe ends open, the keeper would never see that the program has closed them.
                // SAFETY: the copies are not used again, because the keeper never returns.
                unsafe {
                    libc::close(requests.as_raw_fd());
                    libc::close(replies.as_raw_fd());
                }
                keep(&their_requests, &their_replies, lasting, look);
            }
            (pid, lasting)
        });
        if keeper < 0 { Err(Error::last_os_error()) } else { Ok((Self { requests, replies, owner, keeper }, lasting)) }
    }

    fn ask(&mut self, path: &Path) -> Result<i32> {
        // The path is resolved now: the child has another working directory.
        let path = path.canonicalize().or_else(|_| std::path::absolute(path))?;
        let bytes = path.as_os_str().as_bytes();
        let mut request = Vec::with_capacity(bytes.len() + 4);
        request.extend((bytes.len() as u32).to_ne_bytes());
        request.extend(bytes);
        self.requests.write_all(&request)?;
        let mut reply = [0];
        self.replies.read_exact(&mut reply)?;
        Ok(i32::from(reply[0]))
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        if self.owner != std::process::id() {
            return;
        }
        // When this pipe is closed the worker and the keeper end. Waiting for the keeper removes it from the process table.
        if let Ok(nothing) = File::open("/dev/null") {
            drop(std::mem::replace(&mut self.requests, nothing));
            wait(self.keeper);
        }
    }
}

/// A pipe: the end for reading and the end for writing.
fn pipe() -> Result<(File, File)> {
    let mut ends: [RawFd; 2] = [-1; 2];
    // SAFETY: the array has room for the two ends, which have no other owner.
    unsafe {
        if libc::pipe(ends.as_mut_ptr()) < 0 {
            return Err(Error::last_os_error());
        }
        // Programs started by this one must not inherit the ends.
        ends.iter().for_each(|end| {
            libc::fcntl(*end, libc::F_SETFD, libc::FD_CLOEXEC);
        });
        Ok((File::from_raw_fd(ends[0]), File::from_raw_fd(ends[1])))
    }
}

/// Number of objects of these kinds that HDF5 has open in this process.
fn open_objects(kinds: u32) -> isize {
    // SAFETY: counts only; the lock of the library is held.
    hdf5::sync::sync(|| unsafe { H5Fget_obj_count(i64::from(hdf5_sys::h5f::H5F_OBJ_ALL), kinds) })
}

/// Wait for a process; its exit status, or `None` where there is no such process.
fn wait(pid: libc::pid_t) -> Option<i32> {
    let mut status = 0;
    // SAFETY: `status` outlives the call.
    while unsafe { libc::waitpid(pid, &mut status, 0) } < 0 {
        if Error::last_os_error().kind() != ErrorKind::Interrupted {
            return None;
        }
    }
    Some(status)
}

/// The main loop of the keeper.
fn keep(requests: &File, replies: &File, lasting: bool, look: Look) -> ! {
    alone(requests, replies, lasting);
    // SAFETY: memory that no other code knows, shared with the workers and never unmapped.
    let busy = unsafe {
        let page = libc::mmap(null_mut(), 4096, libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_ANONYMOUS, -1, 0);
        if page == libc::MAP_FAILED {
            libc::_exit(ALONE);
        }
        AtomicU8::from_ptr(page.cast())
    };
    loop {
        // SAFETY: this process has one thread.
        let worker = unsafe { libc::fork() };
        if worker == 0 {
            let _ = catch_unwind(AssertUnwindSafe(|| work(requests, replies, busy, look)));
        }
        let status = if worker > 0 { wait(worker) } else { None };
        match status {
            Some(s) if libc::WIFSIGNALED(s) => {
                // The program waits for an answer only while the worker is busy with a file.
                let signal = u8::try_from(libc::WTERMSIG(s)).unwrap_or(u8::MAX);
                if busy.swap(0, SeqCst) == 1 && (&*replies).write_all(&[signal]).is_err() {
                    break;
                }
            }
            Some(s) if libc::WIFEXITED(s) && libc::WEXITSTATUS(s) == NEXT => {}
            _ => break,
        }
    }
    // SAFETY: ends the process at once.
    unsafe { libc::_exit(ALONE) }
}

/// Prepare the child: no output, no core file, default signal handling, and no open files of the program except the two pipes.
fn alone(requests: &File, replies: &File, lasting: bool) {
    // SAFETY: plain calls of the C library in a process of one thread; what is closed is not used again, because the process never
    // returns from the keeper.
    unsafe {
        let none = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        libc::setrlimit(libc::RLIMIT_CORE, &none);
        let null = libc::open(c"/dev/null".as_ptr(), libc::O_RDWR);
        for standard in 0..3 {
            libc::dup2(null, standard);
        }
        let mut signals = vec![libc::SIGSEGV, libc::SIGBUS, libc::SIGABRT, libc::SIGFPE, libc::SIGILL, libc::SIGALRM, libc::SIGPROF];
        signals.extend([libc::SIGCHLD, libc::SIGPIPE, libc::SIGTERM, libc::SIGHUP]);
        signals.iter().for_each(|s| {
            libc::signal(*s, libc::SIG_DFL);
        });
        // The program may handle the interrupt key. It closes the pipe when it ends.
        libc::signal(libc::SIGINT, libc::SIG_IGN);
        if lasting {
            libc::chdir(c"/".as_ptr());
            let (a, b) = (requests.as_raw_fd(), replies.as_raw_fd());
            let most = libc::sysconf(libc::_SC_OPEN_MAX).clamp(256, 65_536) as RawFd;
            for range in [3..a.min(b), (a.min(b) + 1).max(3)..a.max(b), (a.max(b) + 1).max(3)..most] {
                close_all(range);
            }
        }
    }
}

/// Close some descriptors. A program may have 20,000, and to close each by itself takes milliseconds in which the program waits.
fn close_all(range: std::ops::Range<RawFd>) {
    if range.is_empty() {
        return;
    }
    // SAFETY: what is closed is not used again.
    unsafe {
        #[cfg(target_os = "linux")]
        if libc::syscall(libc::SYS_close_range, range.start as libc::c_uint, (range.end - 1) as libc::c_uint, 0) == 0 {
            return;
        }
        range.for_each(|fd| {
            libc::close(fd);
        });
    }
}

/// The main loop of a worker.
fn work(requests: &File, replies: &File, busy: &AtomicU8, look: Look) -> ! {
    // SAFETY: ends the process at once.
    let end = |code| unsafe { libc::_exit(code) };
    CHILD.store(true, SeqCst);
    let had = memory();
    for _ in 0..FILES_OF_A_WORKER {
        let Ok(path) = next(requests) else { end(ALONE) };
        busy.store(1, SeqCst);
        let bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
        if had > 0 {
            bound_memory(had.saturating_add(MORE_MEMORY).saturating_add(bytes.saturating_mul(2)));
        }
        // This call fails on purpose. It replaces the last error, so that the check below sees only errors of this file.
        // SAFETY: there is no such file.
        unsafe { libc::close(-1) };
        bound_time(LONG_PATIENCE_S, PATIENCE_S * (1 + (bytes >> 24)));
        // The program will meet the same panic and report it.
        let flaw = catch_unwind(AssertUnwindSafe(|| look(&path))).unwrap_or(None);
        bound_time(0, 0);
        busy.store(0, SeqCst);
        // The program itself has no memory limit: where this process ran out of memory, the library would continue there and may crash.
        // The C library keeps ENOMEM as the last error until another call fails.
        let greedy = Error::last_os_error().raw_os_error() == Some(libc::ENOMEM);
        let answer = if greedy { NO_MEMORY } else { flaw.map_or(0, |f| UNSOUND + f as i32) };
        if (&*replies).write_all(&[answer as u8]).is_err() {
            end(ALONE);
        }
        if greedy {
            break;
        }
        if open_objects(H5F_OBJ_FILE | H5F_OBJ_DATASET | H5F_OBJ_GROUP) != 0 {
            break;
        }
    }
    end(NEXT)
}

/// The next path; an error where the program has ended.
fn next(mut requests: &File) -> Result<PathBuf> {
    let mut length = [0; 4];
    requests.read_exact(&mut length)?;
    let mut bytes = vec![0; u32::from_ne_bytes(length) as usize];
    requests.read_exact(&mut bytes)?;
    Ok(PathBuf::from(std::ffi::OsString::from_vec(bytes)))
}

/// End this process after the given elapsed time and computing time, s; 0 means never.
fn bound_time(wall: u32, computing: u64) {
    let zero = libc::timeval { tv_sec: 0, tv_usec: 0 };
    let timer = libc::itimerval { it_interval: zero, it_value: libc::timeval { tv_sec: computing as libc::time_t, tv_usec: 0 } };
    // SAFETY: plain calls; the timer outlives them.
    unsafe {
        libc::alarm(wall);
        libc::setitimer(libc::ITIMER_PROF, &timer, null_mut());
    }
}

/// Address space of this process, bytes; 0 where the system does not report it.
fn memory() -> u64 {
    let digits = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = digits.split(' ').next().and_then(|n| n.parse::<u64>().ok()).unwrap_or(0);
    // SAFETY: a plain call.
    pages.saturating_mul(u64::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap_or(4096))
}

/// Limit the address space of this process. Only the soft limit changes, so that the next file may get another limit.
fn bound_memory(bytes: u64) {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: plain calls; the limit outlives them.
    unsafe {
        if libc::getrlimit(libc::RLIMIT_AS, &mut limit) == 0 {
            limit.rlim_cur = bytes.min(limit.rlim_max);
            libc::setrlimit(libc::RLIMIT_AS, &limit);
        }
    }
}
