//! The digitiser: evenly spaced levels, and limits beyond which all values are the lowest or the highest.

use super::drift::Drifts;
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use crate::Result;
use crate::values::need;
use ndarray::Array2;

#[derive(Debug)]
struct Levels {
    lowest_k: f64,
    highest_k: f64,
    step_k: f64,
}

pub(super) fn make(receiver: &Receiver<'_>) -> Result<Made> {
    let options = receiver.options;
    let Some(bits) = options.bits else { return Ok(None) };
    need("bits", bits, (1..=24).contains(&bits), "1 to 24")?;
    let (lowest_k, highest_k) = (options.lowest.si(), options.highest.si());
    need("highest", options.highest, highest_k > lowest_k, format!("a temperature above the lowest level, {}", options.lowest))?;
    let step_k = (highest_k - lowest_k) / f64::from((1_u32 << bits) - 1);
    Ok(Some(Box::new(Levels { lowest_k, highest_k, step_k })))
}

impl NoisePart for Levels {
    fn add(&self, temperatures: &mut Array2<f64>, _: &mut Drifts, _: Moment) {
        let level =
            |value: f64| self.lowest_k + ((value.clamp(self.lowest_k, self.highest_k) - self.lowest_k) / self.step_k).round() * self.step_k;
        temperatures.mapv_inplace(level);
    }

    fn variance(&self, temperatures: &Array2<f64>, _: Moment) -> Array2<f64> {
        Array2::from_elem(temperatures.dim(), self.step_k * self.step_k / 12.0)
    }
}
