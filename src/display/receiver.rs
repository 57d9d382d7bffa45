//! The noise of a picture by the time that its pixels are looked at.

use crate::Result;
use crate::random::stream;
use crate::values::need;
use cittert_arrays::quantity::{Frequency, Temperature};
use ndarray::{Array2, Axis};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Receivers of a camera whose only fault is noise. Without a system temperature there is none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct ReceiverOptions {
    /// System temperature of a receiver. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub tsys: Option<Temperature>,
    /// Bandwidth of a receiver before its detector.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ", default_value_t = ReceiverOptions::default().bandwidth))]
    pub bandwidth: Frequency,
    /// Number of receivers that share the pixels of a frame [default: one for each pixel].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub detectors: Option<usize>,
}

impl Default for ReceiverOptions {
    fn default() -> Self {
        Self { tsys: None, bandwidth: Frequency(1e9), detectors: None }
    }
}

impl ReceiverOptions {
    /// Refuse receivers that cannot be.
    ///
    /// # Errors
    /// A value that is not positive.
    pub fn check(&self) -> Result<()> {
        let tsys = self.tsys.map_or(1.0, Temperature::si);
        need("tsys", tsys, tsys > 0.0 && tsys.is_finite(), "a positive temperature")?;
        let bandwidth = self.bandwidth.si();
        need("bandwidth", bandwidth, bandwidth > 0.0 && bandwidth.is_finite(), "a positive frequency")?;
        let detectors = self.detectors.unwrap_or(1);
        need("detectors", detectors, detectors > 0, "1 or more")
    }

    /// Time for which each of `pixels` pixels is looked at in a frame of a film, s. The receivers look all the time.
    #[must_use]
    pub fn dwell_s(&self, rate_hz: f64, pixels: usize) -> f64 {
        let share = self.detectors.map_or(1.0, |n| (n as f64 / pixels as f64).min(1.0));
        share / rate_hz
    }

    /// Standard deviation of the noise of a pixel, K: Tsys / sqrt(B t) for bandwidth B and dwell t. 0 without a system temperature.
    ///
    /// # Reference
    /// Dicke 1946, Rev. Sci. Instrum. 17, 268, for a receiver that looks at the scene all the time.
    #[must_use]
    pub fn nedt_k(&self, dwell_s: f64) -> f64 {
        self.tsys.map_or(0.0, |tsys| tsys.si() / (self.bandwidth.si() * dwell_s).sqrt())
    }
}

/// Add normal noise of a standard deviation to a frame \[m, l\]. The numbers depend on the seed and the number of the frame alone.
pub fn add_noise(frame: &mut Array2<f64>, sigma: f64, seed: u64, number: u64) {
    if sigma == 0.0 {
        return;
    }
    let rows = frame.nrows() as u64;
    frame.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut values)| {
        let mut rng = stream(seed, "noise of a film", number * rows + row as u64);
        for v in &mut values {
            let x: f64 = StandardNormal.sample(&mut rng);
            *v += sigma * x;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_a_rate_is_that_of_the_radiometer_equation() {
        let staring = ReceiverOptions { tsys: Some(Temperature(500.0)), bandwidth: Frequency(2e9), detectors: None };
        assert_eq!(staring.dwell_s(25.0, 512 * 512), 0.04);
        assert!((staring.nedt_k(0.04) - 500.0 / (2e9_f64 * 0.04).sqrt()).abs() < 1e-12);
        let few = ReceiverOptions { detectors: Some(64), ..staring };
        assert!((few.dwell_s(10.0, 6400) - 1e-3).abs() < 1e-15);
        // More receivers than pixels do not look longer.
        assert_eq!(few.dwell_s(10.0, 10), 0.1);
        assert_eq!(ReceiverOptions::default().nedt_k(1e-3), 0.0);
        assert!(few.check().is_ok() && ReceiverOptions { detectors: Some(0), ..few }.check().is_err());
        assert!(ReceiverOptions { tsys: Some(Temperature(-1.0)), ..few }.check().unwrap_err().to_string().contains("tsys"));
    }

    #[test]
    fn frames_have_independent_noise_of_the_given_size() {
        let frame = |number, seed| {
            let mut plane = Array2::zeros((100, 100));
            add_noise(&mut plane, 2.0, seed, number);
            plane
        };
        let (a, b) = (frame(0, 1), frame(1, 1));
        // The standard deviation of 10,000 numbers is uncertain by 0.7 %, their mean by 0.02; correlation coefficients by 0.01.
        assert!((a.std(0.0) / 2.0 - 1.0).abs() < 0.03 && a.mean().unwrap().abs() < 0.08);
        assert!((&a * &b).mean().unwrap().abs() / 4.0 < 0.04);
        assert!((a == frame(0, 1)) && (a != frame(0, 2)));
    }
}
