//! A pattern that was measured or computed at samples of frequency and direction.
//!
//! Between samples the power is cubic in the angle from the boresight (Hermite's form with the slopes of parabolas through three samples), and
//! linear in frequency and in the angle around the boresight. Beyond the last angle it is 0.

use super::shape::{Shape, Toward};
use crate::{ArrayError, Result};
use ndarray::Array3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// One sample: the power in a direction at a frequency, in any unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternSample {
    /// Frequency, Hz; any one number where the pattern was sampled at one frequency only.
    pub freq_hz: f64,
    /// Angle from the boresight, rad.
    pub theta_rad: f64,
    /// Angle around the boresight, from +l towards +m, rad; 0 for a round pattern.
    pub phi_rad: f64,
    /// Power.
    pub power: f64,
}

/// Power over frequency, angle from the boresight and angle around it, 1 along the boresight at each frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledPattern {
    freq_hz: Vec<f64>,
    theta_rad: Vec<f64>,
    phi_rad: Vec<f64>,
    /// \[freq, theta, phi\].
    power: Array3<f64>,
    /// Derivative by theta.
    slope: Array3<f64>,
}

/// Directions and frequencies closer than this part of themselves are one.
const SAME: f64 = 1e-9;

impl SampledPattern {
    /// From power \[freq, theta, phi\] in any unit. One frequency stands for all frequencies, and one phi for a round pattern.
    ///
    /// # Errors
    /// Axes that do not increase, angles that do not begin at the boresight or go beyond 180 degrees, power that is negative or not finite, or 0
    /// along the boresight.
    pub fn new(freq_hz: Vec<f64>, theta_rad: Vec<f64>, phi_rad: Vec<f64>, mut power: Array3<f64>) -> Result<Self> {
        let shape = [freq_hz.len(), theta_rad.len(), phi_rad.len()];
        ArrayError::unless_shape("power of the element pattern", power.shape(), &shape)?;
        let bad =
            |what: &str, value: String, expected| Err(ArrayError::BadValue { what: format!("element pattern: {what}"), value, expected });
        for (name, axis) in
            [("frequencies", &freq_hz), ("angles from the boresight", &theta_rad), ("angles around the boresight", &phi_rad)]
        {
            let good = !axis.is_empty() && axis.iter().all(|x| x.is_finite()) && axis.windows(2).all(|w| w[1] > w[0]);
            if !good {
                return bad(name, format!("{} values", axis.len()), "finite numbers that increase");
            }
        }
        if !(freq_hz[0] > 0.0) {
            return bad("frequencies", freq_hz[0].to_string(), "positive numbers of Hz");
        }
        let last = theta_rad[theta_rad.len() - 1];
        if theta_rad.len() < 2 || theta_rad[0].abs() > 1e-6 || last > PI + 1e-6 {
            return bad("angles from the boresight", format!("{} to {last} rad", theta_rad[0]), "0 to an angle up to 180 degrees");
        }
        if phi_rad[phi_rad.len() - 1] - phi_rad[0] >= TAU - SAME {
            return bad("angles around the boresight", phi_rad.len().to_string(), "one turn, without its first direction again at its end");
        }
        if let Some(p) = power.iter().find(|p| !(p.is_finite() && **p >= 0.0)) {
            return bad("power", p.to_string(), "a finite number of at least 0");
        }
        for (k, mut plane) in power.outer_iter_mut().enumerate() {
            let peak = plane.row(0).mean().unwrap_or(0.0);
            if !(peak > 0.0) {
                return bad("power along the boresight", format!("{peak} at {} Hz", freq_hz[k]), "a positive power");
            }
            // A pattern that was normalised already keeps its bits.
            if (peak - 1.0).abs() > 1e-14 {
                plane /= peak;
            }
        }
        let slope = slopes(&theta_rad, &power);
        Ok(Self { freq_hz, theta_rad, phi_rad, power, slope })
    }

    /// From samples in any order that fill a grid of frequencies and angles.
    ///
    /// # Errors
    /// A direction that is missing or stated twice at a frequency; see also [`SampledPattern::new`].
    pub fn of_samples(samples: &[PatternSample]) -> Result<Self> {
        let axis = |of: fn(&PatternSample) -> f64| {
            let mut values: Vec<f64> = samples.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values.dedup_by(|b, a| (*b - *a).abs() <= SAME * a.abs().max(SAME));
            values
        };
        let axes = [axis(|s| s.freq_hz), axis(|s| s.theta_rad), axis(|s| s.phi_rad)];
        let shape = (axes[0].len(), axes[1].len(), axes[2].len());
        let full = shape.0 * shape.1 * shape.2;
        let index = |axis: &[f64], x: f64| axis.partition_point(|a| *a < x - SAME * x.abs().max(SAME)).min(axis.len() - 1);
        let mut power = Array3::from_elem(shape, f64::NAN);
        for s in samples {
            power[[index(&axes[0], s.freq_hz), index(&axes[1], s.theta_rad), index(&axes[2], s.phi_rad)]] = s.power;
        }
        if samples.len() != full || power.iter().any(|p| p.is_nan()) {
            return Err(ArrayError::Parse(format!(
                "the element pattern has {} samples, and its {} frequencies, {} angles from the boresight and {} angles around it need {full}: state each \
                 direction once at each frequency",
                samples.len(),
                shape.0,
                shape.1,
                shape.2
            )));
        }
        let [freq_hz, theta_rad, phi_rad] = axes;
        Self::new(freq_hz, theta_rad, phi_rad, power)
    }

    /// The same power at angles from the boresight that are larger by a factor.
    pub(super) fn widened(&self, factor: f64) -> Self {
        let theta_rad = self.theta_rad.iter().map(|t| t * factor).collect();
        Self { theta_rad, slope: &self.slope / factor, ..self.clone() }
    }

    /// Frequencies, Hz.
    #[must_use]
    pub fn freq_hz(&self) -> &[f64] {
        &self.freq_hz
    }

    /// Angles from the boresight, rad.
    #[must_use]
    pub fn theta_rad(&self) -> &[f64] {
        &self.theta_rad
    }

    /// Angles around the boresight, from +l towards +m, rad.
    #[must_use]
    pub fn phi_rad(&self) -> &[f64] {
        &self.phi_rad
    }

    /// Power \[freq, theta, phi\], 1 along the boresight.
    #[must_use]
    pub fn samples(&self) -> &Array3<f64> {
        &self.power
    }

    /// Indices and weights of the two frequencies around one.
    fn freq_weights(&self, freq_hz: f64) -> [(usize, f64); 2] {
        let n = self.freq_hz.len();
        let k = self.freq_hz.partition_point(|f| *f <= freq_hz).clamp(1, n.max(2) - 1) - 1;
        if n == 1 {
            return [(0, 1.0), (0, 0.0)];
        }
        let part = ((freq_hz - self.freq_hz[k]) / (self.freq_hz[k + 1] - self.freq_hz[k])).clamp(0.0, 1.0);
        [(k, 1.0 - part), (k + 1, part)]
    }

    /// Indices and weights of the two angles around the boresight next to one.
    fn phi_weights(&self, phi_rad: f64) -> [(usize, f64); 2] {
        let n = self.phi_rad.len();
        if n == 1 {
            return [(0, 1.0), (0, 0.0)];
        }
        let phi = self.phi_rad[0] + (phi_rad - self.phi_rad[0]).rem_euclid(TAU);
        let k = self.phi_rad.partition_point(|p| *p <= phi).max(1) - 1;
        let next = if k + 1 < n { self.phi_rad[k + 1] } else { self.phi_rad[0] + TAU };
        let part = (phi - self.phi_rad[k]) / (next - self.phi_rad[k]);
        [(k, 1.0 - part), ((k + 1) % n, part)]
    }

    fn at(&self, theta: f64, phi: f64, freq_hz: f64) -> f64 {
        let n = self.theta_rad.len();
        if theta > self.theta_rad[n - 1] {
            return 0.0;
        }
        let k = self.theta_rad.partition_point(|t| *t <= theta).clamp(1, n - 1) - 1;
        let h = self.theta_rad[k + 1] - self.theta_rad[k];
        let x = (theta - self.theta_rad[k]) / h;
        // Hermite's cubics.
        let [a, b] = [(1.0 + 2.0 * x) * (1.0 - x).powi(2), x * x * (3.0 - 2.0 * x)];
        let [c, d] = [h * x * (1.0 - x).powi(2), h * x * x * (x - 1.0)];
        let mut sum = 0.0;
        for (f, of_freq) in self.freq_weights(freq_hz) {
            for (p, of_phi) in self.phi_weights(phi) {
                let weight = of_freq * of_phi;
                if weight > 0.0 {
                    let (v, s) = (&self.power, &self.slope);
                    sum += weight * (a * v[[f, k, p]] + b * v[[f, k + 1, p]] + c * s[[f, k, p]] + d * s[[f, k + 1, p]]);
                }
            }
        }
        sum.max(0.0)
    }
}

/// Derivatives by theta: of the parabola through each sample and its neighbours, and 0 at the boresight of a round pattern.
fn slopes(theta: &[f64], power: &Array3<f64>) -> Array3<f64> {
    let (n_freq, n, n_phi) = power.dim();
    Array3::from_shape_fn((n_freq, n, n_phi), |(f, k, p)| {
        let chord = |j: usize| (power[[f, j + 1, p]] - power[[f, j, p]]) / (theta[j + 1] - theta[j]);
        if k == 0 && n_phi == 1 {
            return 0.0;
        }
        if n == 2 {
            return chord(0);
        }
        let at = k.clamp(1, n - 2);
        let (left, right) = (theta[at] - theta[at - 1], theta[at + 1] - theta[at]);
        let bend = (chord(at) - chord(at - 1)) / (left + right);
        chord(at - 1) + bend * (2.0 * theta[k] - theta[at] - theta[at - 1])
    })
}

impl Shape for SampledPattern {
    fn check(&self) -> Result<()> {
        Ok(())
    }

    fn power(&self, toward: Toward, freq_hz: f64) -> f64 {
        self.at(toward.sin_theta.min(1.0).asin(), toward.m.atan2(toward.l), freq_hz)
    }

    fn solid_angle_sr(&self, freq_hz: f64) -> f64 {
        // Four parts of each interval, each by the rule of its middle.
        let turn = |theta: f64| {
            let n = if self.phi_rad.len() == 1 { 1 } else { 4 * self.phi_rad.len() };
            (0..n).map(|k| self.at(theta, TAU * k as f64 / n as f64, freq_hz)).sum::<f64>() * TAU / n as f64
        };
        let mut sum = 0.0;
        for pair in self.theta_rad.windows(2) {
            let h = (pair[1] - pair[0]) / 4.0;
            for k in 0..4 {
                let theta = pair[0] + h * (f64::from(k) + 0.5);
                if theta < FRAC_PI_2 {
                    sum += turn(theta) * theta.sin() * h;
                }
            }
        }
        sum
    }

    fn varies_with_frequency(&self) -> bool {
        self.freq_hz.len() > 1
    }

    fn check_band(&self, (low, high): (f64, f64)) -> Result<()> {
        let (first, last) = (self.freq_hz[0], self.freq_hz[self.freq_hz.len() - 1]);
        let inside = self.freq_hz.len() == 1 || (low >= first * (1.0 - SAME) && high <= last * (1.0 + SAME));
        if inside {
            return Ok(());
        }
        Err(ArrayError::Parse(format!(
            "the element pattern is known from {:.6} to {:.6} GHz, and the band reaches from {:.6} to {:.6} GHz: use a band within, or a pattern for more \
             frequencies",
            first / 1e9,
            last / 1e9,
            low / 1e9,
            high / 1e9
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::{Airy, ElementPattern};

    fn of(pattern: &ElementPattern, freq: &[f64], step: f64, n: usize) -> SampledPattern {
        let mut samples = Vec::new();
        for f in freq {
            samples.extend((0..n).map(|k| {
                let theta = step * k as f64;
                PatternSample { freq_hz: *f, theta_rad: theta, phi_rad: 0.0, power: 40.0 * pattern.power(theta.sin(), 0.0, *f) }
            }));
        }
        samples.reverse();
        SampledPattern::of_samples(&samples).unwrap()
    }

    #[test]
    fn a_fine_table_of_an_airy_pattern_is_that_pattern() {
        let airy = ElementPattern::Airy(Airy { diameter_m: 0.01, blockage: 0.1 });
        let table = ElementPattern::Sampled(of(&airy, &[90e9, 92e9, 94e9, 96e9, 98e9], 2e-3, 700).into());
        let mut worst = 0.0_f64;
        for k in 0..500 {
            let (l, m) = (0.8 * (f64::from(k) / 500.0), 0.3 * f64::from(k % 7) / 7.0);
            worst = worst.max((table.power(l, m, 95.3e9) - airy.power(l, m, 95.3e9)).abs());
        }
        assert!(worst < 2e-4, "{worst}");
        let ratio = table.solid_angle_sr(94e9).unwrap() / airy.solid_angle_sr(94e9).unwrap();
        assert!((ratio - 1.0).abs() < 0.06, "a small aperture loses a part of its pattern to the horizon: {ratio}");
        assert!(table.varies_with_frequency() && table.check_band((90e9, 98e9)).is_ok());
        assert!(table.check_band((89e9, 98e9)).unwrap_err().to_string().contains("89.0"));
    }

    #[test]
    fn an_oval_pattern_is_wider_along_one_axis() {
        let gauss = |theta: f64, phi: f64| (-theta * theta * (30.0 * phi.cos().powi(2) + 90.0 * phi.sin().powi(2))).exp();
        let mut samples = Vec::new();
        for t in 0..60 {
            for p in 0..72 {
                let (theta_rad, phi_rad) = (0.01 * f64::from(t), TAU * f64::from(p) / 72.0);
                samples.push(PatternSample { freq_hz: 1e9, theta_rad, phi_rad, power: gauss(theta_rad, phi_rad) });
            }
        }
        let table = ElementPattern::Sampled(SampledPattern::of_samples(&samples).unwrap().into());
        for (l, m) in [(0.1, 0.05), (-0.2, 0.1), (0.05, -0.3), (0.0, 0.1), (0.003, -0.002)] {
            let truth = gauss(f64::hypot(l, m).asin(), f64::atan2(m, l));
            assert!((table.power(l, m, 5e9) - truth).abs() < 2e-3, "{l} {m}");
        }
        assert!(!table.varies_with_frequency());
        let along = table.power(0.2, 0.0, 1e9);
        assert!(along > 3.0 * table.power(0.0, 0.2, 1e9), "{along}");
    }

    #[test]
    fn tables_with_gaps_and_impossible_numbers_are_refused() {
        let sample = |theta_rad, power| PatternSample { freq_hz: 1e9, theta_rad, phi_rad: 0.0, power };
        let say = |s: &[PatternSample]| SampledPattern::of_samples(s).unwrap_err().to_string();
        assert!(say(&[]).contains("0 samples") || say(&[]).contains("frequencies"));
        assert!(say(&[sample(0.0, 1.0), sample(0.1, -1.0)]).contains("power"));
        assert!(say(&[sample(0.0, 0.0), sample(0.1, 1.0)]).contains("boresight"));
        assert!(say(&[sample(0.1, 1.0), sample(0.2, 1.0)]).contains("0 to an angle"));
        let gap = PatternSample { freq_hz: 2e9, ..sample(0.0, 1.0) };
        assert!(say(&[sample(0.0, 1.0), sample(0.1, 1.0), gap]).contains("need 4"));
        let twice = sample(0.0, 1.0);
        assert!(say(&[sample(0.0, 1.0), sample(0.1, 1.0), twice]).contains("3 samples"));
    }
}
