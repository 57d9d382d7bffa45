//! The `cittert` program: parse, run, print, exit.

use std::process::ExitCode;

fn main() -> ExitCode {
    keep_freed_memory();
    match cittert::cli::run(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Blocks of visibilities and planes of the grid come and go by the hundred megabytes. The C library gives each back to the system and
/// asks for it anew, and the pages of a new one are cleared; kept, they save a quarter of the processor time of a CLEAN (decision 0024).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_freed_memory() {
    // SAFETY: there is one thread yet, and these options only say how the allocator grows and shrinks its heap.
    unsafe {
        libc::mallopt(libc::M_MMAP_MAX, 0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 128 << 20);
        libc::mallopt(libc::M_TOP_PAD, 16 << 20);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_freed_memory() {}
