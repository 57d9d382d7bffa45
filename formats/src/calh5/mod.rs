//! CalH5: antenna gains in HDF5, the format of UVCal in pyuvdata.
//!
//! In the file gains are \[ant, chan, time, jones\], and a keyword states their convention. `divide` is the convention in memory,
//! V_corrupt = g1 conj(g2) V for uvw = r2 - r1. Gains with the convention `multiply` are inverted on reading. Delays become gains of
//! modulus 1, see [`write_delays`].
//!
//! # Reference
//! Hazelton et al. 2017, JOSS 2, 140 (pyuvdata); the CalH5 memo of that project.

mod delays;
mod format;
mod leakage;
mod names;
mod read;
mod write;
mod write_delays;

pub use read::{is_gains, read_gains, read_gains_for};
pub use write::{write_gains, write_gains_on};
pub use write_delays::write_delays;

pub(crate) use format::CalH5;

#[cfg(test)]
mod tests;
