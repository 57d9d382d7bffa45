//! Fixed pattern: each detector has an offset and a gain of its own that no calibration removes.

use super::drift::Drifts;
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use crate::Result;
use crate::sensor::scans::Samples;
use crate::values::need;
use cittert_arrays::random::stream;
use ndarray::Array2;
use rand_distr::{Distribution, StandardNormal};

#[derive(Debug)]
struct Pattern {
    /// Standard deviations of offset in K and of relative gain.
    offset_k: f64,
    gain: f64,
    samples: Samples,
    /// Offset and gain of each detector, as multiples of these \[detector\].
    detectors: Vec<(f64, f64)>,
}

pub(super) fn make(receiver: &Receiver<'_>) -> Result<Made> {
    let options = receiver.options;
    let offset_k = options.offset_pattern.map_or(0.0, |t| t.si());
    if let Some(offset) = options.offset_pattern {
        need("offset_pattern", offset, offset_k >= 0.0, "a temperature of at least 0K")?;
    }
    need("gain_pattern", options.gain_pattern, (0.0..=1.0).contains(&options.gain_pattern), "a fraction from 0 to 1")?;
    if offset_k == 0.0 && options.gain_pattern == 0.0 {
        return Ok(None);
    }
    // The detectors are those of the instrument: they are the same in all runs of this seed.
    let mut rng = stream(options.seed, "sensor fixed pattern", 0);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let detectors = (0..receiver.samples.detectors()).map(|_| (normal(), normal())).collect();
    Ok(Some(Box::new(Pattern { offset_k, gain: options.gain_pattern, samples: receiver.samples.clone(), detectors })))
}

impl NoisePart for Pattern {
    fn add(&self, temperatures: &mut Array2<f64>, _: &mut Drifts, _: Moment) {
        for ((r, c), value) in temperatures.indexed_iter_mut() {
            let (offset, gain) = self.detectors[self.samples.detector(r, c)];
            *value += self.offset_k * offset + self.gain * gain * *value;
        }
    }

    fn variance(&self, temperatures: &Array2<f64>, _: Moment) -> Array2<f64> {
        temperatures.mapv(|scene_k| self.offset_k.powi(2) + (self.gain * scene_k).powi(2))
    }
}
