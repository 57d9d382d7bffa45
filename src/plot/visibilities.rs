//! Amplitude and phase against the length of the baseline.

use super::axes::{Axis, prefix, whole_prefix};
use super::canvas::{Canvas, Rect};
use super::colors::LINES;
use super::legend::legend;
use super::panel::{Panel, RIGHT_ROOM, Sheet};
use super::picture::Picture;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisUnit, VisibilityBlock, VisibilityHeader};

/// Largest number of points that are kept. If there are more, every second point is removed.
const MOST_POINTS: usize = 200_000;

/// One visibility of the picture.
#[derive(Debug, Clone, Copy)]
struct Point {
    baseline_wavelengths: f64,
    amplitude: f64,
    phase_rad: f64,
    /// Index of the polarisation product.
    pol: usize,
}

/// Collects visibilities from blocks, thinned evenly, and draws them.
#[derive(Debug, Clone)]
pub struct VisPlot {
    points: Vec<Point>,
    /// One visibility in so many is kept.
    step: usize,
    seen: usize,
    freq_hz: Vec<f64>,
    products: Vec<String>,
    unit: VisUnit,
}

impl VisPlot {
    /// An empty plot of a set.
    #[must_use]
    pub fn new(header: &VisibilityHeader) -> Self {
        Self {
            points: Vec::new(),
            step: 1,
            seen: 0,
            freq_hz: header.spectrum.freq_hz().to_vec(),
            products: header.polarizations.iter().map(ToString::to_string).collect(),
            unit: header.unit,
        }
    }

    /// Add a block. Flagged data and autocorrelations are left out.
    pub fn add(&mut self, block: &VisibilityBlock) {
        for row in 0..block.n_rows() {
            if block.coverage.ant1[row] == block.coverage.ant2[row] {
                continue;
            }
            let length = block.coverage.uvw_m[[row, 0]].hypot(block.coverage.uvw_m[[row, 1]]);
            for (chan, f) in self.freq_hz.iter().enumerate() {
                for pol in 0..self.products.len() {
                    if block.usable_weight(row, chan, pol) == 0.0 {
                        continue;
                    }
                    self.seen += 1;
                    if self.seen.is_multiple_of(self.step) {
                        let v = block.vis[[row, chan, pol]];
                        let baseline_wavelengths = length * f / SPEED_OF_LIGHT_M_S;
                        self.points.push(Point {
                            baseline_wavelengths,
                            amplitude: f64::from(v.norm()),
                            phase_rad: f64::from(v.arg()),
                            pol,
                        });
                    }
                }
            }
            if self.points.len() > MOST_POINTS {
                let mut keep = false;
                self.points.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.step *= 2;
            }
        }
    }

    /// Draw amplitude above phase.
    ///
    /// # Errors
    /// No unflagged visibility, a picture below 100 or above 8000 pixels.
    pub fn draw(&self, heading: &str, width: usize, height: usize) -> Result<Picture> {
        let longest = self.points.iter().map(|p| p.baseline_wavelengths).fold(0.0, f64::max);
        let largest = self.points.iter().map(|p| p.amplitude).fold(0.0, f64::max);
        if self.points.is_empty() {
            return Err(ChainError::NoData("the set holds no unflagged visibility to draw".into()));
        }
        let mut canvas = Canvas::new(width, height)?;
        let (unit, letter) = whole_prefix(longest);
        let (vis_unit, vis_letter) = prefix(largest);
        let x = Axis::linear(0.0, 1.03 * longest.max(1e-9) / unit, format!("Baseline ({letter}\u{3bb})"));
        let (vis_unit, amplitude) = match self.unit {
            VisUnit::Jy => (vis_unit, format!("Amplitude ({vis_letter}Jy)")),
            VisUnit::KelvinSr => (vis_unit, format!("Amplitude ({vis_letter}K sr)")),
            VisUnit::Uncalibrated => (1.0, "Amplitude (uncalibrated)".to_owned()),
        };
        let amplitude = Axis::linear(0.0, 1.05 * largest.max(1e-300) / vis_unit, amplitude);
        let phase = Axis { step: Some(90.0), ..Axis::linear(-180.0, 180.0, "Phase (deg)") };
        let sheet = Sheet::new(heading, width, height);
        let larger =
            |room: fn(&Axis, &Canvas, f64) -> f64| room(&phase, &canvas, sheet.height).max(room(&amplitude, &canvas, sheet.height));
        let (label_room, x0) = (Some(larger(Panel::tick_width)), larger(Panel::left_room).round());
        let (top, x1, bottom) = (sheet.top(), sheet.width - RIGHT_ROOM, sheet.height - sheet.bottom(&canvas));
        let split = (top + (bottom - top) * 0.54).round();
        let upper = Panel { area: Rect { x0, y0: top, x1, y1: split - 9.0 }, x: x.clone(), y: amplitude, label_room };
        let lower = Panel { area: Rect { x0, y0: split + 9.0, x1, y1: bottom }, x, y: phase, label_room };
        upper.grid(&mut canvas);
        lower.grid(&mut canvas);
        let n = self.points.len() as f64;
        let radius = (90.0 / n.sqrt()).clamp(0.8, 2.0);
        let alpha = if n < 5e3 { 0.8 } else { 0.45 };
        for p in &self.points {
            let (color, length) = (LINES[p.pol % LINES.len()], p.baseline_wavelengths / unit);
            canvas.dot(upper.at(length, p.amplitude / vis_unit), radius, color, alpha, upper.area);
            canvas.dot(lower.at(length, p.phase_rad.to_degrees()), radius, color, alpha, lower.area);
        }
        upper.axes(&mut canvas, false)?;
        lower.axes(&mut canvas, true)?;
        if self.products.len() > 1 {
            legend(&mut canvas, upper.area, &self.products.iter().map(String::as_str).collect::<Vec<_>>())?;
        }
        sheet.finish(canvas, upper.area)
    }
}
