//! 1/f noise: a sum of relaxations whose rates are an octave apart.
//!
//! A relaxation with the rate r and the variance v has the one-sided spectrum 4 v r / (r^2 + w^2). With v in proportion to r^(1 - a), the sum over
//! octaves is a power law w^-a between the slowest and the fastest rate, to a fraction of a percent.

use super::drift::{Drifts, Mode, Wander};
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use crate::Result;
use crate::sensor::scans::Samples;
use crate::values::need;
use ndarray::Array2;
use std::f64::consts::{LN_2, PI, TAU};

/// Frames, or times between calibrations, in the slowest period for which the spectrum is a power law.
const SLOWEST: f64 = 64.0;
/// Octaves beyond the slowest period: the law needs its neighbours.
const MORE: i32 = 6;

#[derive(Debug)]
struct Flicker {
    wander: Wander,
    samples: Samples,
}

pub(super) fn make(receiver: &Receiver<'_>) -> Result<Made> {
    let options = receiver.options;
    let Some(knee) = options.knee else { return Ok(None) };
    need("knee", knee, knee.si() > 0.0, "a frequency above 0Hz")?;
    need("slope", options.slope, options.slope > 0.1 && options.slope < 1.9, "an exponent from 0.1 to 1.9")?;
    // Level of the thermal noise at room temperature of the scene: 1/f noise is a property of the receiver.
    let system_k = receiver.system_k(290.0);
    need(
        "knee",
        knee,
        system_k.is_some(),
        "--tsys or --receiver with it, as the knee is the frequency where thermal and 1/f noise are equal",
    )?;
    let white = 2.0 * (options.radiometer.factor() * system_k.unwrap_or(0.0)).powi(2) / receiver.bandwidth_hz;
    let calibration_s = super::gain::calibration_s(options)?;
    let slowest_s = SLOWEST * receiver.frame_s.max(calibration_s.unwrap_or(0.0));
    let modes = modes(white, knee.si(), options.slope, slowest_s, receiver.samples.dwell_s);
    let wander = Wander { modes, calibration_s, calibrated: calibration_s.is_some(), purpose: "sensor 1/f noise" };
    Ok(Some(Box::new(Flicker { wander, samples: receiver.samples.clone() })))
}

/// Relaxations whose sum has the one-sided spectrum `white` (`knee` / f)^`slope`, as the mean over samples of `dwell_s` sees it.
fn modes(white: f64, knee_hz: f64, slope: f64, slowest_s: f64, dwell_s: f64) -> Vec<Mode> {
    // The integral of u^(1 - a) / (1 + u^2) is pi / (2 sin(pi a / 2)).
    let constant = white * (TAU * knee_hz).powf(slope) * LN_2 * (0.5 * PI * slope).sin() / TAU;
    let first = TAU / slowest_s * 2.0_f64.powi(-MORE);
    let octaves = (TAU / dwell_s / first).log2().ceil().max(0.0) as usize;
    let mode = |k: usize| {
        let rate = first * 2.0_f64.powi(k as i32);
        let x = rate * dwell_s;
        // Variance of the mean over a sample. The difference of nearly equal numbers would lose digits for slow modes.
        let mean = if x < 1e-4 { 1.0 - x / 3.0 } else { 2.0 * ((-x).exp_m1() + x) / (x * x) };
        Mode { rate, variance: constant * rate.powf(1.0 - slope) * mean }
    };
    (0..=octaves).map(mode).collect()
}

impl NoisePart for Flicker {
    fn begin(&self, seed: u64, plane: u64) -> Drifts {
        self.wander.begin(self.samples.detectors(), seed, plane)
    }

    fn add(&self, temperatures: &mut Array2<f64>, drifts: &mut Drifts, moment: Moment) {
        *temperatures += &self.wander.frame(&self.samples, drifts, moment);
    }

    fn variance(&self, temperatures: &Array2<f64>, moment: Moment) -> Array2<f64> {
        let stationary: f64 = self.wander.modes.iter().map(|mode| mode.variance).sum();
        Array2::from_shape_fn(temperatures.dim(), |(r, c)| {
            if !self.wander.calibrated {
                return stationary;
            }
            let time = moment.time_s + self.samples.middle_s(r, c);
            let age = time - self.wander.calibrated_s(time);
            self.wander.modes.iter().map(|mode| mode.structure(age)).sum()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::options::NoiseOptions;
    use crate::sensor::scans::{Field, ScanPattern};
    use crate::sensor::transform::forward;
    use cittert_arrays::quantity::{Duration, Frequency, Temperature};
    use num_complex::Complex64;

    fn samples(pattern: &str, dim: (usize, usize)) -> Samples {
        let field = Field { dim, pitch_rad: 1e-3, frame_s: 1.0, efficiency: 1.0, beams: 1, step: false, size_rad: 0.0 };
        pattern.parse::<ScanPattern>().unwrap().samples(field).unwrap()
    }

    /// Exponent of a power law through the spectrum of the samples of one beam, over two decades, and the spectrum over the law at its middle.
    fn slope_of(slope: f64) -> (f64, f64) {
        let n: usize = 1 << 16;
        let samples = samples("raster", (256, 256));
        let (knee, tsys) = (Some(Frequency(100.0)), Some(Temperature(1000.0)));
        let noise = NoiseOptions { tsys, knee, slope, ..NoiseOptions::default() };
        let part = make(&Receiver::new(&noise, &samples, 1e9, 1.0)).unwrap().unwrap();
        let mut power = vec![0.0; n / 2];
        let runs = 24;
        for run in 0..runs {
            let mut frame = Array2::zeros((256, 256));
            part.add(&mut frame, &mut part.begin(run, 0), Moment { seed: run, index: 0, time_s: 0.0 });
            let hann = |k: usize| (0.5 - 0.5 * (TAU * k as f64 / n as f64).cos()) * (8.0_f64 / 3.0).sqrt();
            let mean = frame.mean().unwrap();
            let series: Vec<_> = frame.iter().enumerate().map(|(k, v)| Complex64::from((v - mean) * hann(k))).collect();
            let spectrum = forward(Array2::from_shape_vec((1, n), series).unwrap());
            // One-sided density, K^2/Hz: the frame lasts a second.
            power.iter_mut().zip(spectrum.iter()).for_each(|(p, s)| *p += 2.0 * s.norm_sqr() / (n as f64 * n as f64) / runs as f64);
        }
        let bins: Vec<(f64, f64)> = (0..20)
            .map(|k| {
                let edge = |k: i32| (20.0 * 10.0_f64.powf(f64::from(k) / 10.0)).round() as usize;
                let (a, b) = (edge(k), edge(k + 1));
                let mean = power[a..b].iter().sum::<f64>() / (b - a) as f64;
                let frequency = (a..b).map(|f| (f as f64).ln()).sum::<f64>() / (b - a) as f64;
                (frequency, mean.ln())
            })
            .collect();
        let count = bins.len() as f64;
        let (x, y) = (bins.iter().map(|b| b.0).sum::<f64>() / count, bins.iter().map(|b| b.1).sum::<f64>() / count);
        let fit = bins.iter().map(|b| (b.0 - x) * (b.1 - y)).sum::<f64>() / bins.iter().map(|b| (b.0 - x).powi(2)).sum::<f64>();
        let law = (2.0 * 1000.0_f64.powi(2) / 1e9).ln() + slope * (100.0_f64.ln() - x);
        (-fit, (y - law).exp())
    }

    #[test]
    fn the_spectrum_has_its_slope_within_5_percent_and_its_level() {
        for slope in [0.7, 1.0, 1.5] {
            let (found, level) = slope_of(slope);
            assert!((found / slope - 1.0).abs() < 0.05, "{slope}: {found}");
            assert!((level - 1.0).abs() < 0.06, "{slope}: {level}");
        }
    }

    #[test]
    fn the_map_is_the_scatter_of_runs() {
        let samples = samples("pushbroom", (40, 8));
        for calibration in [None, Some(Duration(0.2))] {
            let noise =
                NoiseOptions { tsys: Some(Temperature(1000.0)), knee: Some(Frequency(50.0)), calibration, ..NoiseOptions::default() };
            let part = make(&Receiver::new(&noise, &samples, 1e9, 1.0)).unwrap().unwrap();
            let moment = |seed| Moment { seed, index: 0, time_s: 0.0 };
            let mut scatter = Array2::<f64>::zeros((40, 8));
            let runs = 600;
            for seed in 0..runs {
                let mut frame = Array2::zeros((40, 8));
                part.add(&mut frame, &mut part.begin(seed, 0), moment(seed));
                scatter += &frame.mapv(|v| v * v / runs as f64);
            }
            let expected = part.variance(&scatter, moment(0));
            for r in 1..40 {
                // 8 columns and 600 runs.
                let (found, want) = (scatter.row(r).mean().unwrap(), expected.row(r).mean().unwrap());
                assert!((found - want).abs() <= 0.12 * want, "{calibration:?} {r}: {found} {want}");
            }
        }
    }
}
