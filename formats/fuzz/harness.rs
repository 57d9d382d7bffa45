//! Bounded mutation fuzzing on the stable compiler: good small files with bytes changed, given to a reader under limits of memory and
//! of time. CI runs some thousands of each target; `make fuzz N=1000000` runs that many, in several processes with other seeds.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Counts the bytes in use and their peak.
struct Counting;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged; only sums are kept.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(LIVE.fetch_add(layout.size(), Relaxed).saturating_add(layout.size()), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(LIVE.fetch_add(layout.size(), Relaxed).saturating_add(layout.size()), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Memory that a case may take whatever its size, bytes.
pub(crate) const MEMORY: usize = 64 << 20;
/// Memory that a case may take for each byte of its input: gzip and the filters of HDF5 shrink by this at most.
pub(crate) const MEMORY_PER_BYTE: usize = 1100;
/// Longest time of computing in this process on a case, and of waiting for it.
const PATIENCE: Duration = Duration::from_secs(5);
const LONG_PATIENCE: Duration = Duration::from_secs(120);

/// Time that this thread has computed.
fn computed() -> Duration {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` outlives the call.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// A small generator of numbers that are the same in every run (splitmix64; Steele, Lea & Flood 2014).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Numbers and words that have broken readers before.
const NASTY: [&str; 20] = [
    "0",
    "-1",
    "1e999",
    "-1e308",
    "nan",
    "inf",
    "2147483648",
    "4294967296",
    "9223372036854775807",
    "1000000000000",
    "1e-320",
    "\"",
    "=",
    "[",
    "]]",
    "'''",
    "\u{e9}",
    ",",
    "\n",
    "{",
];

/// Change a good input in one to twelve places, most of them in its first `head` bytes.
pub(crate) fn mutate(input: &mut Vec<u8>, head: usize, numbers: &mut Numbers) {
    for _ in 0..1 + numbers.below(12) {
        let reach = if numbers.below(4) > 0 { head.min(input.len()) } else { input.len() };
        let at = numbers.below(reach);
        match numbers.below(11) {
            0 if numbers.below(4) == 0 => input.truncate(at),
            1 | 2 => input.get_mut(at).into_iter().for_each(|b| *b ^= 1 << numbers.below(8)),
            3 | 4 => input.get_mut(at).into_iter().for_each(|b| *b = numbers.next() as u8),
            5 => input.get_mut(at).into_iter().for_each(|b| *b = b'0' + numbers.below(10) as u8),
            6 | 7 => {
                // Over what stands there, so that cards and records keep their places.
                let word = NASTY[numbers.below(NASTY.len())].as_bytes();
                let end = (at + word.len()).min(input.len());
                input.splice(at..end, word.iter().copied());
            }
            8 => {
                let word = NASTY[numbers.below(NASTY.len())].as_bytes();
                input.splice(at..at, word.iter().copied());
            }
            9 => {
                // A piece of the input copied over another.
                let from = numbers.below(input.len());
                let piece: Vec<u8> = input[from.min(input.len())..].iter().take(1 + numbers.below(80)).copied().collect();
                let end = (at + piece.len()).min(input.len());
                input.splice(at..end, piece);
            }
            _ => {
                let end = (at + 1 + numbers.below(40)).min(input.len());
                input.drain(at.min(end)..end);
            }
        }
    }
}

/// Executions of each target: CITTERT_FUZZ, or `usual`.
pub(crate) fn executions(usual: usize) -> usize {
    std::env::var("CITTERT_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

/// Seed of the changes: CITTERT_FUZZ_SEED, or 0.
fn seed() -> u64 {
    std::env::var("CITTERT_FUZZ_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(0)
}

/// Files of a folder of the corpus with their names, in order of these.
pub(crate) fn corpus_files(folder: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(crate::CORPUS).join(folder);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "no corpus in {}", folder.display());
    paths.iter().map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(p).unwrap())).collect()
}

/// Contents of the files of a folder of the corpus.
pub(crate) fn corpus(folder: &str) -> Vec<Vec<u8>> {
    corpus_files(folder).into_iter().map(|f| f.1).collect()
}

/// Memory is counted for the whole process, so one target runs at a time.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Give `read` every input of the corpus (which it must accept), then `usual` or CITTERT_FUZZ changed ones. A panic, a case that takes too
/// long or too much memory fails, and leaves its input in a file that the message names.
pub(crate) fn fuzz(target: &str, inputs: &[Vec<u8>], head: usize, usual: usize, read: impl Fn(&[u8]) -> bool) {
    let _alone = alone();
    let (n, started) = (executions(usual), Instant::now());
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{target}"));
    for (k, input) in inputs.iter().enumerate() {
        assert!(read(input), "{target}: input {k} of the corpus is not accepted");
    }
    let mut numbers = Numbers(0x5eed + seed());
    let (mut accepted, mut worst, mut faults) = (0_usize, Duration::ZERO, Vec::new());
    for k in 0..n {
        let mut input = inputs[numbers.below(inputs.len())].clone();
        mutate(&mut input, head, &mut numbers);
        let base = LIVE.load(Relaxed);
        PEAK.store(base, Relaxed);
        let (begun, idle) = (Instant::now(), computed());
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| read(&input)));
        // The machine may be busy with other things: what counts is the time of computing.
        let (waited, took, memory) = (begun.elapsed(), computed().saturating_sub(idle), PEAK.load(Relaxed).saturating_sub(base));
        worst = worst.max(took);
        let fault = match result {
            Err(_) => Some("a panic".to_owned()),
            Ok(_) if memory > MEMORY + MEMORY_PER_BYTE * input.len() => Some(format!("{memory} bytes of memory for {}", input.len())),
            Ok(_) if took > PATIENCE || waited > LONG_PATIENCE => Some(format!("{took:?} of computing in {waited:?}")),
            Ok(ok) => {
                accepted += usize::from(ok);
                None
            }
        };
        if let Some(fault) = fault {
            let kept = format!("{}-{}", kept.display(), faults.len());
            std::fs::write(&kept, &input).unwrap();
            faults.push(format!("{target}, execution {k}: {fault}; the input is in {kept}"));
            // A long run goes on to what else there is.
            if faults.len() >= 20 {
                break;
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    println!("{target}: {n} executions in {:.1?}, {accepted} accepted, the longest {worst:.1?}", started.elapsed());
}

/// A file of scratch that each case writes anew, in memory where the system has such a place.
pub(crate) struct Scratch {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

impl Scratch {
    pub(crate) fn new(name: &str) -> Self {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
        let path = folder.path().join(name);
        Self { _folder: folder, path }
    }

    /// The path of a file with this content.
    pub(crate) fn file(&self, content: &[u8]) -> &Path {
        // A new file each time: HDF5 knows files by their inode, and may have kept one open that was damaged.
        let _ = std::fs::remove_file(&self.path);
        std::fs::write(&self.path, content).unwrap();
        &self.path
    }
}
