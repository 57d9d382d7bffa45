//! The memory of the pixels of a frame, kept for the next frame.
//!
//! The kernel clears fresh memory page by page, which took a tenth of the time of a frame.

use super::face::{Face, Shown};
use std::sync::{Mutex, PoisonError};

/// Numbers for each pixel of a frame. What they hold before the frame is without meaning.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// What the pixels show. // [m, l]
    pub shown: Vec<Shown>,
    /// The face of each pixel if what it scatters needs a correction, else the sky. // [m, l]
    pub scattering: Vec<Face>,
    /// Temperatures, RJ, K. // [m, l]
    pub rj_k: Vec<f64>,
    /// Corrections for what surfaces scatter, RJ, K. // [m, l][chan, pol]
    pub corrections: Vec<f64>,
}

impl Memory {
    /// The same memory for another number of pixels.
    pub(super) fn sized(mut self, pixels: usize) -> Self {
        self.shown.resize(pixels, Shown::default());
        self.scattering.resize(pixels, Face::SKY);
        self.rj_k.resize(pixels, 0.0);
        self
    }
}

/// The memory that is not in use: one piece for each frame that was computed at the same time as others.
#[derive(Debug, Default)]
pub(super) struct Kept(Mutex<Vec<Memory>>);

impl Kept {
    /// Memory of an earlier frame, or none yet.
    pub(super) fn take(&self) -> Memory {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// Keeps memory for the next frame.
    pub(super) fn keep(&self, memory: Memory) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }
}
