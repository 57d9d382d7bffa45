//! Amplitude and phase against the length of the baseline.

use super::axes::{Axis, BOTTOM_ROOM, Panel, prefix, title, whole_prefix};
use super::canvas::{Canvas, Rect};
use super::colors::LINES;
use super::curves::legend;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisUnit, VisibilityBlock, VisibilityHeader};

/// Points kept at most; when there are more, every other one goes.
const MOST_POINTS: usize = 200_000;

/// Collects visibilities from blocks, evenly thinned, and draws them.
#[derive(Debug, Clone)]
pub struct VisPlot {
    /// Wavelengths, amplitude, phase in rad, product.
    points: Vec<(f64, f64, f64, usize)>,
    /// Every how manieth visibility is kept.
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

    /// Take a block. Flagged data and autocorrelations are left out.
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
                        self.points.push((length * f / SPEED_OF_LIGHT_M_S, f64::from(v.norm()), f64::from(v.arg()), pol));
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
    pub fn draw(&self, heading: &str, width: usize, height: usize) -> Result<Vec<u8>> {
        let longest = self.points.iter().map(|p| p.0).fold(0.0, f64::max);
        let largest = self.points.iter().map(|p| p.1).fold(0.0, f64::max);
        if self.points.is_empty() {
            return Err(ChainError::NoData("the set holds no unflagged visibility to draw".into()));
        }
        let mut canvas = Canvas::new(width, height)?;
        let (unit, letter) = whole_prefix(longest);
        let (vis_unit, vis_letter) = prefix(largest);
        let x = Axis::linear(0.0, 1.03 * longest.max(1e-9) / unit, format!("Baseline ({letter}\u{3bb})"));
        let amplitude = match self.unit {
            VisUnit::Jy => format!("Amplitude ({vis_letter}Jy)"),
            VisUnit::KelvinSr => format!("Amplitude ({vis_letter}K sr)"),
            VisUnit::Uncalibrated => "Amplitude (uncalibrated)".to_owned(),
        };
        let vis_unit = if self.unit == VisUnit::Uncalibrated { 1.0 } else { vis_unit };
        let amplitude = Axis::linear(0.0, 1.05 * largest.max(1e-300) / vis_unit, amplitude);
        let phase = Axis { step: Some(90.0), ..Axis::linear(-180.0, 180.0, "Phase (deg)") };
        let top = if heading.is_empty() { 18.0 } else { 44.0 };
        let widest = [&phase, &amplitude].map(|y| Panel::tick_width(y, &canvas, height as f64)).into_iter().fold(0.0, f64::max);
        let label_room = Some(widest);
        let x0 = Panel::left_room(&phase, &canvas, height as f64).max(Panel::left_room(&amplitude, &canvas, height as f64)).round();
        let x1 = width as f64 - 24.0;
        let split = (top + (height as f64 - top - BOTTOM_ROOM) * 0.54).round();
        let upper = Panel { area: Rect { x0, y0: top, x1, y1: split - 9.0 }, x: x.clone(), y: amplitude, label_room };
        let lower = Panel { area: Rect { x0, y0: split + 9.0, x1, y1: height as f64 - BOTTOM_ROOM }, x, y: phase, label_room };
        upper.grid(&mut canvas);
        lower.grid(&mut canvas);
        let n = self.points.len() as f64;
        let radius = (90.0 / n.sqrt()).clamp(0.8, 2.0);
        let alpha = if n < 5e3 { 0.8 } else { 0.45 };
        for (uv, amplitude, phase, pol) in &self.points {
            let color = LINES[pol % LINES.len()];
            canvas.dot(upper.at(uv / unit, amplitude / vis_unit), radius, color, alpha, upper.area);
            canvas.dot(lower.at(uv / unit, phase.to_degrees()), radius, color, alpha, lower.area);
        }
        upper.axes(&mut canvas, false)?;
        lower.axes(&mut canvas, true)?;
        if self.products.len() > 1 {
            legend(&mut canvas, upper.area, &self.products.iter().map(String::as_str).collect::<Vec<_>>())?;
        }
        if !heading.is_empty() {
            title(&mut canvas, upper.area, heading, width as f64 - 20.0)?;
        }
        canvas.png()
    }
}
