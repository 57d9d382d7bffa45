//! Wandering gain: a random walk of each detector since its last calibration. It turns the system temperature into an error of temperature.

use super::drift::{Drifts, Wander};
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use super::step::Mode;
use crate::Result;
use crate::sensor::options::NoiseOptions;
use crate::sensor::scans::Samples;
use crate::values::need;
use ndarray::{Array2, Zip};

/// System temperature over that of the scene where the noise of the receiver is not given.
#[derive(Debug)]
struct Gain {
    wander: Wander,
    samples: Samples,
    tsys_k: Option<f64>,
    receiver_k: f64,
}

/// Time between calibrations, s.
pub(super) fn calibration_s(options: &NoiseOptions) -> Result<Option<f64>> {
    let Some(time) = options.calibration else { return Ok(None) };
    need("calibration", time, time.si() > 0.0, "a time above 0s")?;
    Ok(Some(time.si()))
}

pub(super) fn make(receiver: &Receiver<'_>) -> Result<Made> {
    let options = receiver.options;
    need("gain_drift", options.gain_drift, (0.0..=1.0).contains(&options.gain_drift), "a fraction from 0 to 1")?;
    let calibration_s = calibration_s(options)?;
    if options.gain_drift == 0.0 {
        return Ok(None);
    }
    let modes = vec![Mode { rate: 0.0, variance: options.gain_drift * options.gain_drift }];
    let wander = Wander { modes, white: 0.0, dwell_s: 0.0, calibration_s, calibrated: true, purpose: "sensor gain drift" };
    let tsys_k = options.tsys.map(|t| t.si());
    Ok(Some(Box::new(Gain { wander, samples: receiver.samples.clone(), tsys_k, receiver_k: options.receiver.map_or(0.0, |t| t.si()) })))
}

impl Gain {
    fn system_k(&self, scene_k: f64) -> f64 {
        self.tsys_k.unwrap_or(self.receiver_k + scene_k)
    }
}

impl NoisePart for Gain {
    fn begin(&self, seed: u64, plane: u64) -> Drifts {
        self.wander.begin(self.samples.detectors(), seed, plane)
    }

    fn add(&self, temperatures: &mut Array2<f64>, drifts: &mut Drifts, moment: Moment) {
        let drift = self.wander.frame(&self.samples, drifts, moment);
        Zip::from(temperatures).and(&drift).for_each(|value, drift| *value += self.system_k(*value) * drift);
    }

    fn variance(&self, temperatures: &Array2<f64>, moment: Moment) -> Array2<f64> {
        Array2::from_shape_fn(temperatures.dim(), |(r, c)| {
            let walk = self.wander.variance(moment.time_s + self.samples.middle_s(r, c));
            walk * self.system_k(temperatures[[r, c]]).powi(2)
        })
    }
}
