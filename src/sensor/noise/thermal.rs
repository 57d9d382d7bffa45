//! Thermal noise by the radiometer equation: K Tsys / sqrt(B tau).

use super::drift::Drifts;
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::random::stream;
use ndarray::{Array2, Axis};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

#[derive(Debug)]
struct Thermal {
    /// Temperature to which `scene` times the scene is added, K.
    system_k: f64,
    scene: f64,
    /// K / sqrt(B tau).
    factor: f64,
}

pub(super) fn make(receiver: &Receiver<'_>) -> Result<Made> {
    let options = receiver.options;
    for (name, temperature) in [("tsys", options.tsys), ("receiver", options.receiver)] {
        if let Some(temperature) = temperature {
            need(name, temperature, temperature.si() > 0.0, "a temperature above 0K")?;
        }
    }
    let both = options.tsys.is_some() && options.receiver.is_some();
    ensure!(
        !both,
        ChainError::Incompatible("give either tsys or receiver: the temperature of the system contains that of the receiver".into())
    );
    let Some(system_k) = receiver.system_k(0.0) else { return Ok(None) };
    need("bandwidth", format!("{} Hz", receiver.bandwidth_hz), receiver.bandwidth_hz > 0.0, "a width above 0 for thermal noise")?;
    let factor = options.radiometer.factor() / (receiver.bandwidth_hz * receiver.samples.dwell_s).sqrt();
    Ok(Some(Box::new(Thermal { system_k, scene: f64::from(u8::from(options.tsys.is_none())), factor })))
}

impl Thermal {
    fn sigma_k(&self, scene_k: f64) -> f64 {
        (self.system_k + self.scene * scene_k.max(0.0)) * self.factor
    }
}

impl NoisePart for Thermal {
    fn add(&self, temperatures: &mut Array2<f64>, _: &mut Drifts, moment: Moment) {
        temperatures.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(r, mut row)| {
            let mut rng = stream(moment.seed, "sensor thermal noise", moment.index << 20 | r as u64);
            for value in &mut row {
                let normal: f64 = StandardNormal.sample(&mut rng);
                *value += self.sigma_k(*value) * normal;
            }
        });
    }

    fn variance(&self, temperatures: &Array2<f64>, _: Moment) -> Array2<f64> {
        temperatures.mapv(|scene_k| self.sigma_k(scene_k).powi(2))
    }
}
