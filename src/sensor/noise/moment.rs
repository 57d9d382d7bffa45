//! The place of a frame in a run.

/// A frame in a run of frames.
#[derive(Debug, Clone, Copy)]
pub(in crate::sensor) struct Moment {
    /// Seed of the run.
    pub(in crate::sensor) seed: u64,
    /// Index of the frame and of the plane in it: no two have the same random numbers.
    pub(in crate::sensor) index: u64,
    /// Time of the begin of the frame since the first calibration, s.
    pub(in crate::sensor) time_s: f64,
}
