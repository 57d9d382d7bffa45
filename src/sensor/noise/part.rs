//! What a part of the noise is, and what it acts on.

use super::drift::Drifts;
use super::moment::Moment;
use crate::Result;
use crate::sensor::options::NoiseOptions;
use crate::sensor::scans::Samples;
use ndarray::Array2;
use std::fmt;

/// What the parts are made for.
#[derive(Debug, Clone, Copy)]
pub struct Receiver<'a> {
    pub(super) options: &'a NoiseOptions,
    pub(super) samples: &'a Samples,
    pub(super) bandwidth_hz: f64,
    pub(super) frame_s: f64,
}

impl<'a> Receiver<'a> {
    pub(in crate::sensor) fn new(options: &'a NoiseOptions, samples: &'a Samples, bandwidth_hz: f64, frame_s: f64) -> Self {
        Self { options, samples, bandwidth_hz, frame_s }
    }

    /// System temperature that the noise of the receiver has for a scene of this temperature; `None` without a noise temperature.
    pub(super) fn system_k(&self, scene_k: f64) -> Option<f64> {
        match (self.options.tsys, self.options.receiver) {
            (Some(tsys), _) => Some(tsys.si()),
            (None, Some(receiver)) => Some(receiver.si() + scene_k.max(0.0)),
            (None, None) => None,
        }
    }
}

/// A part of the noise, made for one pattern of samples.
pub(in crate::sensor) trait NoisePart: fmt::Debug + Send + Sync {
    /// State before the first frame.
    fn begin(&self, _seed: u64, _plane: u64) -> Drifts {
        Vec::new()
    }

    /// Add it to the temperatures of samples \[row, column\], K.
    fn add(&self, temperatures: &mut Array2<f64>, drifts: &mut Drifts, moment: Moment);

    /// Expected variance of each sample of a frame, K^2.
    fn variance(&self, temperatures: &Array2<f64>, moment: Moment) -> Array2<f64>;
}

/// A part, or `None` if the options do not ask for it.
pub(in crate::sensor) type Made = Option<Box<dyn NoisePart>>;

/// One row of the table of parts.
#[derive(Debug, Clone, Copy)]
pub struct NoiseKind {
    /// Its name.
    pub name: &'static str,
    /// Function that makes it; `None` if the options do not ask for it.
    pub(in crate::sensor) make: fn(&Receiver<'_>) -> Result<Made>,
    /// What it is.
    pub about: &'static str,
    /// Author and year of its definition.
    pub source: &'static str,
}
