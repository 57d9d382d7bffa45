//! The average of frames.

use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, Zip};

#[derive(Debug)]
struct Average;

impl Step for Average {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(frame)
    }

    fn frames(&self, frames: Vec<Array2<f64>>) -> Result<Vec<Array2<f64>>> {
        Ok(average(frames).into_iter().collect())
    }
}

pub(super) fn make(_: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Average))
}

/// The mean of frames of one scene, pixel by pixel: independent noise falls with the square root of their number. `None` without a frame.
#[must_use]
pub fn average(frames: Vec<Array2<f64>>) -> Option<Array2<f64>> {
    let n = frames.len() as f64;
    let mut frames = frames.into_iter();
    let mut sum = frames.next()?;
    frames.for_each(|frame| Zip::from(&mut sum).and(&frame).for_each(|s, v| *s += v));
    Some(sum / n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::{noise, rms};

    #[test]
    fn noise_falls_with_the_root_of_the_number_of_frames() {
        let out = average((0..16).map(|k| noise(64, 64, 100 + k)).collect()).unwrap();
        // The rms of 4096 pixels is uncertain by 1.1 %.
        assert!((rms(out) - 0.25).abs() < 0.25 * 0.04);
    }
}
