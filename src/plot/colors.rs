//! Colour maps and the colour bar.

use super::axes::{linear_ticks, short};
use super::canvas::{Align, Canvas, INK, Rect, Rgb};
use super::panel::{LABEL_EM, TICK_EM, fitted};
use crate::Result;

/// Colours that can be told apart in print and by colour-blind readers.
///
/// # Reference
/// Okabe & Ito 2008, Color Universal Design, in an order that puts the strongest contrasts first.
pub(crate) const LINES: [Rgb; 8] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [230, 159, 0], [90, 90, 90], [180, 160, 0]];

/// A colour map with the range and stretch of its values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColorScale {
    pub(crate) gradient: colorous::Gradient,
    /// Whether the gradient runs from its end to its beginning.
    pub(crate) reversed: bool,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) stretch: Curve,
    /// Colour of cells without a value.
    pub(crate) blank: Rgb,
}

/// How values are spread over the colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Curve {
    /// In proportion.
    Linear,
    /// asinh((v - origin) / linear): in proportion near the origin, and logarithmic beyond `linear`.
    Asinh { origin: f64, linear: f64 },
}

impl Curve {
    fn of(self, v: f64) -> f64 {
        match self {
            Self::Linear => v,
            Self::Asinh { origin, linear } => ((v - origin) / linear).asinh(),
        }
    }
}

/// Cells without a value, unless the scale says otherwise.
pub(crate) const BLANK: Rgb = [200, 200, 204];

impl ColorScale {
    /// Place of a value on the scale, 0 to 1.
    pub(crate) fn place(&self, v: f64) -> f64 {
        let (low, high) = (self.stretch.of(self.low), self.stretch.of(self.high));
        let x = if high > low { (self.stretch.of(v) - low) / (high - low) } else { 0.5 };
        x.clamp(0.0, 1.0)
    }

    pub(crate) fn color(&self, v: f64) -> Rgb {
        if v.is_nan() { self.blank } else { self.color_at(self.place(v)) }
    }

    pub(crate) fn color_at(&self, place: f64) -> Rgb {
        let c = self.gradient.eval_continuous(if self.reversed { 1.0 - place } else { place });
        [c.r, c.g, c.b]
    }

    /// Ticks of a bar of this height, the roundest first where there are too many.
    fn ticks(&self, height: f64, unit: f64) -> Vec<(f64, String)> {
        let (lo, hi) = (self.low / unit, self.high / unit);
        match self.stretch {
            Curve::Linear => linear_ticks(lo, hi, ((height / 70.0) as usize).max(2)),
            Curve::Asinh { .. } => stretched_ticks(lo, hi),
        }
    }

    /// Room that a bar of this height takes to the right of a panel with its ticks and its label, pixels.
    pub(crate) fn bar_room(&self, canvas: &Canvas, height: f64, unit: f64) -> f64 {
        let ticks = self.ticks(height, unit);
        let widest = ticks.iter().map(|t| canvas.text_width(&t.1, TICK_EM)).fold(0.0, f64::max);
        (BAR_RIGHT + 9.0 + widest + 10.0 + 0.75 * LABEL_EM + 14.0).max(BAR_ROOM)
    }

    /// Draw the bar in `area` with ticks to its right; values are shown divided by `unit`.
    pub(crate) fn bar(&self, canvas: &mut Canvas, area: Rect, unit: f64, label: &str) -> Result<()> {
        canvas.shade(area, |_, y| self.color_at(1.0 - y));
        canvas.frame(area, INK, 1.0);
        let mut widest = 0.0_f64;
        let mut taken: Vec<f64> = Vec::new();
        for (v, text) in self.ticks(area.height(), unit) {
            let y = area.y1 - self.place(v * unit) * area.height();
            if taken.iter().any(|t| (t - y).abs() < 1.8 * TICK_EM) {
                continue;
            }
            taken.push(y);
            canvas.fill(Rect { x0: area.x1, x1: area.x1 + 5.0, y0: y - 0.5, y1: y + 0.5 }, INK);
            canvas.text((area.x1 + 9.0, y + 0.365 * TICK_EM), &text, TICK_EM, Align::Left, INK)?;
            widest = widest.max(canvas.text_width(&text, TICK_EM));
        }
        let x = area.x1 + 9.0 + widest + 10.0 + 0.75 * LABEL_EM;
        let (label, em) = fitted(canvas, label, LABEL_EM, area.height() + 36.0);
        canvas.text_up((x, f64::midpoint(area.y0, area.y1)), &label, em, Align::Center, INK)
    }
}

/// Values 1, 2 and 5 times powers of ten on both sides of zero, the roundest first. There are too many of them: the caller keeps those
/// whose labels do not touch.
fn stretched_ticks(lo: f64, hi: f64) -> Vec<(f64, String)> {
    let largest = lo.abs().max(hi.abs());
    let top = largest.log10().ceil() as i32;
    let mut values = vec![0.0];
    for m in [1.0, 5.0, 2.0] {
        for exponent in (top - 3..=top).rev() {
            let v = m * 10_f64.powi(exponent);
            values.extend([v, -v]);
        }
    }
    values.into_iter().filter(|v| (lo..=hi).contains(v)).map(|v| (v, short(v))).collect()
}

/// Room that a colour bar with short tick labels takes to the right of a panel, pixels.
pub(crate) const BAR_ROOM: f64 = 118.0;
/// Distance of the right edge of the bar from the panel, pixels.
const BAR_RIGHT: f64 = 36.0;

/// The bar's rectangle next to a panel.
pub(crate) fn bar_area(panel: Rect) -> Rect {
    Rect { x0: panel.x1 + 16.0, x1: panel.x1 + BAR_RIGHT, ..panel }
}
