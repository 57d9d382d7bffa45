//! The `cittert` program: parse, run, print, exit.
//!
//! It also says how it takes memory from the system: it keeps what it frees, small blocks of zeros do not wait for the lock of the heap, and pages come
//! from all NUMA nodes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::process::ExitCode;

fn main() -> ExitCode {
    keep_freed_memory();
    cittert::cli::spread_memory();
    match cittert::cli::run(std::env::args_os()) {
        Ok(()) => {
            cittert::cli::end();
            ExitCode::SUCCESS
        }
        Err(failure) => {
            cittert::cli::fail(&failure);
            ExitCode::from(failure.exit_code())
        }
    }
}

/// The allocator of the program: that of the C library, but for small blocks of zeros.
///
/// The C library keeps some freed blocks of up to this size for each thread. It gives them out without the one lock of the heap, but not to `calloc`:
/// there each block of zeros waits for the lock, which another thread may hold while the heap grows.
struct Heap;

#[global_allocator]
static HEAP: Heap = Heap;

/// Largest block that the C library keeps for each thread, bytes.
const KEPT: usize = 1032;

// SAFETY: every call goes to the allocator of the system with its own arguments. A zeroed block is one that has just been allocated with this
// layout, all of whose bytes are written.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if layout.size() > KEPT {
            return unsafe { System.alloc_zeroed(layout) };
        }
        let block = unsafe { System.alloc(layout) };
        if !block.is_null() {
            unsafe { block.write_bytes(0, layout.size()) };
        }
        block
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        unsafe { System.realloc(block, layout, size) }
    }
}

/// Keep the memory that the program frees. Blocks of visibilities and planes of the grid take hundreds of megabytes and are allocated again
/// in every pass. By default the C library returns each block to the system, and the system clears the pages of the next one. Keeping them
/// saves a quarter of the processor time of a CLEAN (decision 0024).
///
/// All threads take memory from one heap. With one heap for each thread, a plane that one thread frees is of no use to the next
/// thread, and the peak of maximum entropy is up to 45 % higher, by chance.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_freed_memory() {
    // SAFETY: there is only one thread at this point, and these options only set how the allocator grows and shrinks its heap.
    unsafe {
        libc::mallopt(libc::M_MMAP_MAX, 0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 128 << 20);
        libc::mallopt(libc::M_TOP_PAD, 16 << 20);
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_freed_memory() {}
