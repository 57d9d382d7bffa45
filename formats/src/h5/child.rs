//! A process that looks at files for this one, kept from file to file: a fork for each file would cost more than the look.
//!
//! Three processes: the program sends paths through a pipe; a worker reads them, looks, and answers 0; between the two stands the
//! keeper, which never touches a file. When the worker dies of a file, the keeper answers with the signal and starts another one.
//! The worker also makes room for another one after some files, or where the library kept a part of a damaged file open.

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

/// Longest time that a worker may compute on a small file, s, and on each 16 MiB of a larger one; a good one takes milliseconds.
const PATIENCE_S: u64 = 1;
/// Longest time for one file where the disk is slow, s.
const LONG_PATIENCE_S: u32 = 60;
/// Memory that a worker may take above what the process has and twice the file, bytes.
const MORE_MEMORY: u64 = 2 << 30;
/// Answer in place of a signal where the file made the library ask for more memory than that.
pub(super) const NO_MEMORY: i32 = 255;
/// Least answer where the look itself found what must not be read; which flaw is added to it. Signals are smaller.
pub(super) const UNSOUND: i32 = 200;
/// Files that one worker looks at.
const FILES_OF_A_WORKER: usize = 500;
/// Exit codes of a worker: the program is gone; another one shall follow.
const ALONE: i32 = 0;
const NEXT: i32 = 1;

/// What a worker does with a file; the number of the flaw for which it must not be read.
type Look = fn(&Path) -> Option<usize>;

/// The keeper, seen from the program.
struct Child {
    requests: File,
    replies: File,
    /// Process of the program and of the keeper: a copy of the program by fork must not use its pipes.
    owner: u32,
    keeper: libc::pid_t,
}

/// True in the child process, which reads the files that it looks at.
static CHILD: AtomicBool = AtomicBool::new(false);

/// True in the child process.
pub(super) fn in_the_child() -> bool {
    CHILD.load(SeqCst)
}

static KEPT: Mutex<Option<Child>> = Mutex::new(None);

/// 0 for a file that did the worker no harm, else the signal of which it died, [`NO_MEMORY`], or [`UNSOUND`] plus the number of a flaw; `None`
/// where no process can be started.
pub(super) fn look_at(path: &Path, look: Look) -> Option<i32> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let owner = std::process::id();
    if let Some(child) = kept.as_mut().filter(|c| c.owner == owner)
        && let Ok(signal) = child.ask(path)
    {
        return Some(signal);
    }
    // None yet, or somebody ended it.
    drop(kept.take());
    let (mut child, lasting) = Child::start(look).ok()?;
    let signal = child.ask(path).ok()?;
    if lasting {
        *kept = Some(child);
    }
    Some(signal)
}

impl Child {
    /// Start a keeper; true where it may be kept. While this process has HDF5 files open, a child would take them for its own, long
    /// after they changed: such a child serves for one file.
    fn start(look: Look) -> Result<(Self, bool)> {
        let (their_requests, requests) = pipe()?;
        let (replies, their_replies) = pipe()?;
        let owner = std::process::id();
        // The library's lock is held over the fork, so that no other thread is inside it then.
        let (keeper, lasting) = hdf5::sync::sync(|| {
            let lasting = open_objects(H5F_OBJ_FILE) == 0;
            // SAFETY: the child uses nothing of other threads: it holds the lock of HDF5, the C library sees to the lock of its allocator,
            // and it ends without running what the parent left to do at its end.
            let pid = unsafe { libc::fork() };
            if pid == 0 {
                // Its copies of the program's ends would keep it waiting for itself.
                // SAFETY: the copies are used no more, as the keeper never returns.
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
        // A relative path, or one through links of this process, means what it means to the program now.
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
        // Without this pipe the worker and its keeper end by themselves; then nothing of them is left to the system.
        if let Ok(nothing) = File::open("/dev/null") {
            drop(std::mem::replace(&mut self.requests, nothing));
            wait(self.keeper);
        }
    }
}

/// A pipe: its end to read and its end to write.
fn pipe() -> Result<(File, File)> {
    let mut ends: [RawFd; 2] = [-1; 2];
    // SAFETY: the array has room for the two ends, which nobody else owns.
    unsafe {
        if libc::pipe(ends.as_mut_ptr()) < 0 {
            return Err(Error::last_os_error());
        }
        // Programs that this one starts must not hold the ends open.
        ends.iter().for_each(|end| {
            libc::fcntl(*end, libc::F_SETFD, libc::FD_CLOEXEC);
        });
        Ok((File::from_raw_fd(ends[0]), File::from_raw_fd(ends[1])))
    }
}

/// Objects of these kinds that HDF5 has open in this process.
fn open_objects(kinds: u32) -> isize {
    // SAFETY: counts only; the lock of the library is held.
    hdf5::sync::sync(|| unsafe { H5Fget_obj_count(i64::from(hdf5_sys::h5f::H5F_OBJ_ALL), kinds) })
}

/// How a process ended; `None` where there is none to wait for.
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

/// The life of the keeper.
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
                // Nobody waits for an answer where the worker was ended between two files.
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

/// No output, no core file, the usual ends by signals, and no files of the program but the two pipes.
fn alone(requests: &File, replies: &File, lasting: bool) {
    // SAFETY: plain calls of the C library in a process of one thread; what is closed is used no more, as the process never returns from
    // its keeper.
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
        // The program may handle this key; it then closes the pipe when it ends.
        libc::signal(libc::SIGINT, libc::SIG_IGN);
        if lasting {
            libc::chdir(c"/".as_ptr());
            let most = libc::sysconf(libc::_SC_OPEN_MAX).clamp(256, 65_536) as RawFd;
            (3..most).filter(|fd| ![requests.as_raw_fd(), replies.as_raw_fd()].contains(fd)).for_each(|fd| {
                libc::close(fd);
            });
        }
    }
}

/// The life of a worker.
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
        // A failure of another kind, so that the mark below is this file's.
        // SAFETY: there is no such file.
        unsafe { libc::close(-1) };
        bound_time(LONG_PATIENCE_S, PATIENCE_S * (1 + (bytes >> 24)));
        // A panic is for the program to meet as well.
        let flaw = catch_unwind(AssertUnwindSafe(|| look(&path))).unwrap_or(None);
        bound_time(0, 0);
        busy.store(0, SeqCst);
        // The program has no bound: where this process got no memory the library would go on there, and may crash. The C library
        // leaves this mark, which nothing takes away but another failure.
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

/// The next path; an error where the program is gone.
fn next(mut requests: &File) -> Result<PathBuf> {
    let mut length = [0; 4];
    requests.read_exact(&mut length)?;
    let mut bytes = vec![0; u32::from_ne_bytes(length) as usize];
    requests.read_exact(&mut bytes)?;
    Ok(PathBuf::from(std::ffi::OsString::from_vec(bytes)))
}

/// End this process after so much time on the wall and of computing, s; 0 for never.
fn bound_time(wall: u32, computing: u64) {
    let zero = libc::timeval { tv_sec: 0, tv_usec: 0 };
    let timer = libc::itimerval { it_interval: zero, it_value: libc::timeval { tv_sec: computing as libc::time_t, tv_usec: 0 } };
    // SAFETY: plain calls; the timer outlives them.
    unsafe {
        libc::alarm(wall);
        libc::setitimer(libc::ITIMER_PROF, &timer, null_mut());
    }
}

/// Address space that this process has, bytes; 0 where the system does not say.
fn memory() -> u64 {
    let digits = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = digits.split(' ').next().and_then(|n| n.parse::<u64>().ok()).unwrap_or(0);
    // SAFETY: a plain call.
    pages.saturating_mul(u64::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap_or(4096))
}

/// Bound the address space of this process. The hard bound stays, so that the next file may have another one.
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
