//! 1/f noise: a sum of relaxations whose rates are an octave apart.
//!
//! A relaxation with the rate r and the variance v has the one-sided spectrum 4 v r / (r^2 + w^2). With v in proportion to r^(1 - a), the sum over all
//! octaves is the power law w^-a to a millionth. The octaves that are slower and faster than those summed have their power too: the slow ones as one more relaxation,
//! the fast ones as noise that is independent from sample to sample.

use super::drift::{Drifts, Wander};
use super::moment::Moment;
use super::part::{Made, NoisePart, Receiver};
use super::step::Mode;
use crate::Result;
use crate::sensor::scans::Samples;
use crate::values::need;
use ndarray::Array2;
use std::f64::consts::{LN_2, PI, TAU};

/// Frames, or times between calibrations, in the slowest period for which the spectrum is a power law.
const SLOWEST: f64 = 64.0;
/// Octaves beyond the slowest period. At that period, one relaxation for all that are slower has their spectrum to 0.5 %.
const SLOWER: i32 = 3;
/// Octaves beyond the rate 1 / dwell. The correlation that faster ones have from sample to sample is below 0.4 %.
const FASTER: i32 = 7;

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
    let dwell_s = receiver.samples.dwell_s;
    let (modes, white) = modes(white, knee.si(), options.slope, slowest_s, dwell_s);
    let wander = Wander { modes, white, dwell_s, calibration_s, calibrated: calibration_s.is_some(), purpose: "sensor 1/f noise" };
    Ok(Some(Box::new(Flicker { wander, samples: receiver.samples.clone() })))
}

/// Relaxations whose sum has the one-sided spectrum `white` (`knee` / f)^`slope`, and the variance that faster ones have in the mean over `dwell_s`.
fn modes(white: f64, knee_hz: f64, slope: f64, slowest_s: f64, dwell_s: f64) -> (Vec<Mode>, f64) {
    // The integral of u^(1 - a) / (1 + u^2) is pi / (2 sin(pi a / 2)).
    let constant = white * (TAU * knee_hz).powf(slope) * LN_2 * (0.5 * PI * slope).sin() / TAU;
    let first = TAU / slowest_s * 2.0_f64.powi(-SLOWER);
    let octaves = (2.0_f64.powi(FASTER) / dwell_s / first).log2().ceil().max(0.0) as i32;
    let rate = |k: i32| first * 2.0_f64.powi(k);
    // The sum of v r over the octaves below the first is that of one relaxation.
    let slower = Mode { rate: rate(-1), variance: constant * first.powf(2.0 - slope) / (2.0_f64.powf(2.0 - slope) - 1.0) / rate(-1) };
    let mode = |k: i32| Mode { rate: rate(k), variance: constant * rate(k).powf(1.0 - slope) };
    // Above, the variance of the mean over x relaxation times is 2 v (1 / x - 1 / x^2).
    let power = |n: i32| {
        let power = slope + f64::from(n) - 1.0;
        (rate(octaves + 1) * dwell_s).powi(-n) * rate(octaves + 1).powf(1.0 - slope) / (1.0 - 2.0_f64.powf(-power))
    };
    let faster = 2.0 * constant * (power(1) - power(2));
    (std::iter::once(slower).chain((0..=octaves).map(mode)).collect(), faster)
}

impl NoisePart for Flicker {
    fn begin(&self, seed: u64, plane: u64) -> Drifts {
        self.wander.begin(self.samples.detectors(), seed, plane)
    }

    fn add(&self, temperatures: &mut Array2<f64>, drifts: &mut Drifts, moment: Moment) {
        *temperatures += &self.wander.frame(&self.samples, drifts, moment);
    }

    fn variance(&self, temperatures: &Array2<f64>, moment: Moment) -> Array2<f64> {
        Array2::from_shape_fn(temperatures.dim(), |(r, c)| self.wander.variance(moment.time_s + self.samples.middle_s(r, c)))
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

    /// Knee of the tests, Hz, and the thermal noise that they have, K^2/Hz.
    const KNEE: f64 = 100.0;
    const WHITE: f64 = 2.0 * 1000.0 * 1000.0 / 1e9;

    fn part(slope: f64, samples: &Samples) -> Box<dyn NoisePart> {
        let (knee, tsys) = (Some(Frequency(KNEE)), Some(Temperature(1000.0)));
        let noise = NoiseOptions { tsys, knee, slope, ..NoiseOptions::default() };
        make(&Receiver::new(&noise, samples, 1e9, 1.0)).unwrap().unwrap()
    }

    /// One-sided spectrum at a frequency of means over a dwell that follow each other without pause, if the law holds at all frequencies: the law times sinc^2, and
    /// all that is folded onto it.
    fn definition(slope: f64, f_hz: f64, dwell_s: f64) -> f64 {
        let at = |k: i32| {
            let u = (f_hz + f64::from(k) / dwell_s).abs();
            WHITE * (KNEE / u).powf(slope) * ((PI * u * dwell_s).sin() / (PI * u * dwell_s)).powi(2)
        };
        (-300..=300).map(at).sum()
    }

    #[test]
    fn the_modes_have_the_spectrum_of_the_definition() {
        for slope in [0.15, 0.3, 0.7, 1.0, 1.5, 1.85] {
            for (slowest_s, dwell_s) in [(64.0, 1.0 / 65536.0), (64.0 * 0.04, 0.04)] {
                let (modes, white) = modes(WHITE, KNEE, slope, slowest_s, dwell_s);
                // Cosine series of the covariance: two means k dwells apart share what is kept over k - 1 of them.
                let spectrum = |f: f64| {
                    let of = |mode: &Mode| {
                        let x = mode.rate * dwell_s;
                        let (kept, mean) = ((-x).exp(), -(-x).exp_m1() / x);
                        let turn = Complex64::from_polar(1.0, -TAU * f * dwell_s);
                        mode.of_mean(dwell_s) + 2.0 * mode.variance * mean * mean * (turn / (1.0 - kept * turn)).re
                    };
                    2.0 * dwell_s * (white + modes.iter().map(of).sum::<f64>())
                };
                let fractions = [0.01, 0.1, 0.25, 0.5].map(|f| f / dwell_s).into_iter().filter(|f| *f > 2.0 / slowest_s);
                for f in fractions.chain([1.0 / slowest_s, 2.0 / slowest_s]) {
                    let (found, want) = (spectrum(f), definition(slope, f, dwell_s));
                    let bound = if f * slowest_s < 1.5 { 0.005 } else { 0.0015 };
                    assert!((found / want - 1.0).abs() < bound, "{slope} {dwell_s} s {f} Hz: {found} {want}");
                }
            }
        }
    }

    /// Runs whose spectra are averaged.
    const RUNS: u64 = 24;

    /// Frequency of each third of a decade, the mean over runs of the spectrum of one beam over the definition, and its standard deviation.
    fn levels(slope: f64) -> Vec<(f64, f64, f64)> {
        let n: usize = 1 << 16;
        let samples = samples("raster", (256, 256));
        let part = part(slope, &samples);
        let mut power = vec![0.0; n / 2];
        for run in 0..RUNS {
            let mut frame = Array2::zeros((256, 256));
            part.add(&mut frame, &mut part.begin(run, 0), Moment { seed: run, index: 0, time_s: 0.0 });
            let hann = |k: usize| (0.5 - 0.5 * (TAU * k as f64 / n as f64).cos()) * (8.0_f64 / 3.0).sqrt();
            let mean = frame.mean().unwrap();
            let series: Vec<_> = frame.iter().enumerate().map(|(k, v)| Complex64::from((v - mean) * hann(k))).collect();
            let spectrum = forward(Array2::from_shape_vec((1, n), series).unwrap());
            // One-sided density, K^2/Hz: the frame lasts a second.
            power.iter_mut().zip(spectrum.iter()).for_each(|(p, s)| *p += 2.0 * s.norm_sqr() / (n as f64 * n as f64) / RUNS as f64);
        }
        let edge = |k: u32| (40.0 * 10.0_f64.powf(f64::from(k) / 3.0)).round() as usize;
        let band = |k: u32| {
            let (a, b) = (edge(k), edge(k + 1).min(n / 2 - 1));
            let step = ((b - a) / 1000).max(1);
            let some: Vec<f64> = (a..b).step_by(step).map(|f| power[f] / definition(slope, f as f64, samples.dwell_s)).collect();
            let count = some.len() as f64;
            // The window makes one of two neighbours independent.
            ((a as f64 * b as f64).sqrt(), some.iter().sum::<f64>() / count, (2.0 / (count * RUNS as f64)).sqrt())
        };
        (0..9).map(band).collect()
    }

    #[test]
    fn the_spectrum_has_the_level_and_the_slope_of_the_definition() {
        for slope in [0.3, 0.7, 1.0, 1.5] {
            let levels = levels(slope);
            for (f, level, deviation) in &levels {
                assert!((level - 1.0).abs() < 3.5 * deviation, "{slope}: {level} of the definition at {f} Hz, deviation {deviation}");
            }
            let mean = levels.iter().map(|l| l.1).sum::<f64>() / levels.len() as f64;
            assert!((mean - 1.0).abs() < 0.02, "{slope}: {mean} of the definition");
            // Slope of the ratio in a plot of logarithms.
            let (x, y): (Vec<f64>, Vec<f64>) = levels.iter().map(|l| (l.0.ln(), l.1.ln())).unzip();
            let of = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let (middle, high) = (of(&x), of(&y));
            let tilt =
                x.iter().zip(&y).map(|(x, y)| (x - middle) * (y - high)).sum::<f64>() / x.iter().map(|x| (x - middle).powi(2)).sum::<f64>();
            assert!(tilt.abs() < 0.05 * slope, "{slope}: {tilt}");
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
