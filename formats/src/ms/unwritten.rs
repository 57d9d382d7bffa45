//! The end of the process where casacore cannot write.
//!
//! casacore writes the last bytes of a table in destructors. An exception in a destructor cannot be caught and ends the process. This happens where
//! the disk becomes full although there was room before. The process then ends with one clear message, and removes what it began.

use super::ffi;
use std::ffi::{CStr, c_char};
use std::io::Write;
use std::sync::Once;

/// Exit code of a failure.
const FAILED: i32 = 1;

/// From now on the process ends in order where casacore cannot write.
pub(super) fn end_in_order() {
    static INSTALLED: Once = Once::new();
    // SAFETY: the function is never unloaded.
    INSTALLED.call_once(|| unsafe { ffi::ct_on_terminate(end) });
}

extern "C" fn end(what: *const c_char) -> ! {
    // SAFETY: the shim gives a NUL-terminated text that outlives this call.
    let what = unsafe { CStr::from_ptr(what) }.to_string_lossy();
    let what = what.lines().next().unwrap_or_default();
    let text = format!("error: a Measurement Set cannot be written, mostly because the disk is full: {what}\n");
    // Nothing can be done where stderr is closed.
    let _ = std::io::stderr().write_all(text.as_bytes());
    crate::atomic::remove_unfinished();
    // SAFETY: ends the process at once. Exit handlers would run the destructors of casacore again.
    unsafe { libc::_exit(FAILED) }
}
