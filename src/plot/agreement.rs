//! How a model agrees with the data: the amplitudes of both against the length of the baseline, and what is left in units of the noise.

use super::axes::{Axis, prefix, whole_prefix};
use super::canvas::{Canvas, Rect};
use super::colors::LINES;
use super::legend::{CORNERS, Style, legend_at};
use super::panel::{Panel, RIGHT_ROOM, Sheet};
use super::picture::Picture;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisUnit, VisibilityBlock, VisibilityHeader};
use ndarray::ArrayView3;
use num_complex::Complex;

/// Largest number of visibilities that are kept. If there are more, every second one is removed.
const MOST_POINTS: usize = 400_000;
/// Largest number of bins of the length of the baseline.
const MOST_BINS: usize = 48;
/// Visibilities that a bin should have.
const GOOD_BIN: usize = 12;

/// One visibility with its model.
#[derive(Debug, Clone, Copy)]
struct Sample {
    baseline_wavelengths: f64,
    data: f64,
    model: f64,
    /// Amplitude that is expected of the model with the noise of the data.
    expected: f64,
    /// |data - model|^2 over its expectation from the noise.
    misfit: f64,
}

/// A bin of the length of the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bin {
    baseline_wavelengths: f64,
    /// 16th percentile, median and 84th percentile of the amplitudes of the data.
    data: [f64; 3],
    /// Median amplitude of the model.
    model: f64,
    /// Median amplitude that is expected of data with this model and their noise.
    expected: f64,
    /// Rms of data less model, in units of the noise.
    left: f64,
}

/// Collects visibilities and their model from blocks, thinned evenly, and draws them.
#[derive(Debug, Clone)]
pub struct ModelPlot {
    samples: Vec<Sample>,
    /// One visibility in so many is kept.
    step: usize,
    seen: usize,
    freq_hz: Vec<f64>,
    unit: VisUnit,
}

impl ModelPlot {
    /// An empty plot of a set.
    #[must_use]
    pub fn new(header: &VisibilityHeader) -> Self {
        Self { samples: Vec::new(), step: 1, seen: 0, freq_hz: header.spectrum.freq_hz().to_vec(), unit: header.unit }
    }

    /// Add a block and the model of its rows \[row, chan, pol\]. Flagged data, autocorrelations and rows without a model are left out.
    pub fn add(&mut self, block: &VisibilityBlock, model: ArrayView3<'_, Complex<f32>>) {
        for row in 0..block.n_rows() {
            if block.coverage.ant1[row] == block.coverage.ant2[row] {
                continue;
            }
            let length = block.coverage.uvw_m[[row, 0]].hypot(block.coverage.uvw_m[[row, 1]]);
            for (chan, f) in self.freq_hz.iter().enumerate() {
                for pol in 0..block.vis.dim().2 {
                    let (weight, m) = (f64::from(block.usable_weight(row, chan, pol)), model[(row, chan, pol)]);
                    if weight == 0.0 || !m.is_finite() {
                        continue;
                    }
                    self.seen += 1;
                    if self.seen.is_multiple_of(self.step) {
                        let v = block.vis[(row, chan, pol)];
                        self.samples.push(Sample {
                            baseline_wavelengths: length * f / SPEED_OF_LIGHT_M_S,
                            data: f64::from(v.norm()),
                            model: f64::from(m.norm()),
                            // The median amplitude of noise alone is sqrt(2 ln 2) sigma, with 1 / sigma^2 the weight.
                            expected: (f64::from(m.norm_sqr()) + 2.0 * std::f64::consts::LN_2 / weight).sqrt(),
                            // The weight is 1 / sigma^2 of the real part, so the expectation of |noise|^2 is 2 / weight.
                            misfit: 0.5 * weight * f64::from((v - m).norm_sqr()),
                        });
                    }
                }
            }
            if self.samples.len() > MOST_POINTS {
                let mut keep = false;
                self.samples.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.step *= 2;
            }
        }
    }

    fn bins(&self) -> Vec<Bin> {
        let longest = self.samples.iter().map(|s| s.baseline_wavelengths).fold(0.0, f64::max);
        let n = (self.samples.len() / GOOD_BIN).clamp(1, MOST_BINS);
        let mut filled: Vec<Vec<Sample>> = vec![Vec::new(); n];
        for s in &self.samples {
            let k = (s.baseline_wavelengths / longest.max(f64::MIN_POSITIVE) * n as f64) as usize;
            filled[k.min(n - 1)].push(*s);
        }
        let sorted = |of: &[Sample], value: fn(&Sample) -> f64| {
            let mut all: Vec<f64> = of.iter().map(value).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let at = |all: &[f64], part: f64| all[((all.len() - 1) as f64 * part).round() as usize];
        let bin = |of: &Vec<Sample>| {
            let (data, model, expected) = (sorted(of, |s| s.data), sorted(of, |s| s.model), sorted(of, |s| s.expected));
            let count = of.len() as f64;
            Bin {
                baseline_wavelengths: of.iter().map(|s| s.baseline_wavelengths).sum::<f64>() / count,
                data: [at(&data, 0.16), at(&data, 0.5), at(&data, 0.84)],
                model: at(&model, 0.5),
                expected: at(&expected, 0.5),
                left: (of.iter().map(|s| s.misfit).sum::<f64>() / count).sqrt(),
            }
        };
        filled.iter().filter(|of| !of.is_empty()).map(bin).collect()
    }

    /// Draw the amplitudes above what is left.
    ///
    /// # Errors
    /// No unflagged visibility with a model, a picture below 100 or above 8000 pixels.
    pub fn draw(&self, heading: &str, width: usize, height: usize) -> Result<Picture> {
        let bins = self.bins();
        if bins.is_empty() {
            return Err(ChainError::NoData("the set holds no unflagged visibility with a model to draw".into()));
        }
        let longest = bins.iter().map(|b| b.baseline_wavelengths).fold(1e-9, f64::max);
        let largest = bins.iter().map(|b| b.data[2].max(b.model)).fold(1e-300, f64::max);
        let (unit, letter) = whole_prefix(longest);
        let (vis_unit, vis_letter) = if self.unit == VisUnit::Uncalibrated { (1.0, "") } else { prefix(largest) };
        let name = match self.unit {
            VisUnit::Jy => format!("Amplitude ({vis_letter}Jy)"),
            VisUnit::KelvinSr => format!("Amplitude ({vis_letter}K sr)"),
            VisUnit::Uncalibrated => "Amplitude (uncalibrated)".to_owned(),
        };
        let x = Axis::linear(0.0, 1.03 * longest / unit, format!("Baseline ({letter}\u{3bb})"));
        let smallest = bins.iter().map(|b| b.data[0].min(b.model)).filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        // Amplitudes of an extended source fall by orders of magnitude.
        let log = largest > 30.0 * smallest;
        let low = smallest.max(1e-4 * largest) / vis_unit;
        let y = if log {
            Axis { log, ..Axis::linear(low / 1.3, 1.4 * largest / vis_unit, name) }
        } else {
            Axis::linear(0.0, 1.08 * largest / vis_unit, name)
        };
        let most = bins.iter().map(|b| b.left).fold(1.0, f64::max);
        let left_log = most > 12.0;
        let rest = "Data \u{2212} model (\u{3c3})";
        let lower_y = if left_log {
            Axis { log: true, ..Axis::linear(0.5, 1.5 * most, rest) }
        } else {
            Axis::linear(0.0, (1.15 * most).max(1.6), rest)
        };
        let all = (self.samples.iter().map(|s| s.misfit).sum::<f64>() / self.samples.len() as f64).sqrt();
        let note = format!(
            "Points: median of the data, with the 16th and 84th percentile. Data less model is {all:.2} times the noise; 1 is a perfect fit."
        );
        let sheet = Sheet::new(heading, width, height).with_note(note);
        let mut canvas = Canvas::new(width, height)?;
        let (top, x1, bottom) = (sheet.top(), sheet.width - RIGHT_ROOM, sheet.height - sheet.bottom(&canvas));
        let split = (top + (bottom - top) * 0.62).round();
        let larger = |room: fn(&Axis, &Canvas, f64) -> f64| room(&y, &canvas, split - top).max(room(&lower_y, &canvas, bottom - split));
        let (label_room, x0) = (Some(larger(Panel::tick_width)), larger(Panel::left_room).round());
        let upper = Panel { area: Rect { x0, y0: top, x1, y1: split - 9.0 }, x: x.clone(), y, label_room };
        let lower = Panel { area: Rect { x0, y0: split + 9.0, x1, y1: bottom }, x, y: lower_y, label_room };
        upper.grid(&mut canvas);
        lower.grid(&mut canvas);
        let inside = |v: f64| (v / vis_unit).max(upper.y.from);
        for b in &bins {
            let (at, y_high) = upper.at(b.baseline_wavelengths / unit, inside(b.data[2]));
            let (_, y_low) = upper.at(0.0, inside(b.data[0]));
            canvas.fill(Rect { x0: at - 0.7, x1: at + 0.7, y0: y_high, y1: y_low }, LINES[4]);
            canvas.dot(upper.at(b.baseline_wavelengths / unit, inside(b.data[1])), 3.4, LINES[0], 1.0, upper.area);
        }
        let line = |of: fn(&Bin) -> f64| -> Vec<(f64, f64)> {
            bins.iter().map(|b| upper.at(b.baseline_wavelengths / unit, inside(of(b)))).collect()
        };
        canvas.line(&line(|b| b.model), LINES[1], 1.8)?;
        canvas.line(&line(|b| b.expected), LINES[2], 1.8)?;
        let (_, one) = lower.at(0.0, 1.0);
        canvas.fill(Rect { y0: one - 0.6, y1: one + 0.6, ..lower.area }, [120, 120, 128]);
        for b in &bins {
            canvas.dot(lower.at(b.baseline_wavelengths / unit, b.left.max(lower.y.from)), 3.4, LINES[0], 1.0, lower.area);
        }
        upper.axes(&mut canvas, false)?;
        lower.axes(&mut canvas, true)?;
        legend_at(&mut canvas, upper.area, &["Data", "Model", "Model with the noise of the data"], CORNERS[0], &|k| Style {
            color: k,
            line: k > 0,
            dots: k == 0,
        })?;
        sheet.finish(canvas, upper.area)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closure::testdata::Scene;

    #[test]
    fn a_model_that_misses_half_of_the_flux_leaves_what_the_weights_say() {
        let scene = Scene::point(8, 1);
        let set = scene.set(|_, _, _, _| num_complex::Complex64::new(1.0, 0.0));
        let mut plot = ModelPlot::new(&set.header);
        let block = &set.data;
        plot.add(block, block.vis.mapv(|v| v * 0.5).view());
        let bins = plot.bins();
        assert!(!bins.is_empty());
        for (b, s) in bins.iter().zip(std::iter::repeat(&plot.samples[0])) {
            assert!((b.model / b.data[1] - 0.5).abs() < 1e-5);
            // The source has the same amplitude on every baseline.
            let weight = f64::from(block.usable_weight(0, 0, 0));
            let expected = (0.5 * weight).sqrt() * 0.5 * s.data;
            assert!((b.left / expected - 1.0).abs() < 1e-4, "{} {expected}", b.left);
        }
        plot.draw("t", 400, 400).unwrap().png().unwrap();
        let none = ModelPlot::new(&set.header);
        assert!(none.draw("t", 400, 400).err().unwrap().to_string().contains("no unflagged visibility"));
    }
}
