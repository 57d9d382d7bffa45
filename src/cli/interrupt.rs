//! Signals that end the program. Unfinished outputs are removed first.

use super::failure::{Context as _, Result};
use crate::display::film::end_encoders;
use cittert_formats::atomic::remove_unfinished;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;
use std::sync::Once;

/// Wait on a thread for the signals that end the program. It then ends as if it had no handler, so that a shell sees which signal it was.
///
/// # Errors
/// The system has no handler or no thread to give.
pub(super) fn listen() -> Result<()> {
    static STARTED: Once = Once::new();
    let mut result = Ok(());
    STARTED.call_once(|| result = start().context("cannot wait for signals"));
    result
}

fn start() -> std::io::Result<()> {
    // `nohup` and background jobs of a script ignore some signals, and that must stay so.
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM].into_iter().filter(|s| !is_ignored(*s)))?;
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
            // First the programs that write into unfinished outputs.
            end_encoders();
            remove_unfinished();
            // This returns only where the signal does not end a process.
            let _ = emulate_default_handler(signal);
        }
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).map(drop)
}

fn is_ignored(signal: i32) -> bool {
    // SAFETY: the struct is plain numbers, for which all bits 0 are valid; it outlives the call, which only reads the action of the signal.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &raw mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
    }
}
