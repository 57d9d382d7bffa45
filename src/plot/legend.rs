//! The legend: a box with a line and a marker for each name.

use super::canvas::{Align, Canvas, INK, Rect, WHITE};
use super::colors::LINES;
use super::panel::TICK_EM;
use crate::Result;

/// How to draw one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// Index of its colour.
    pub color: usize,
    /// Join the points.
    pub line: bool,
    /// Draw markers at the points.
    pub dots: bool,
}

/// A corner of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Corner {
    pub(crate) right: bool,
    pub(crate) bottom: bool,
}

/// The corners of a panel. The first is the upper right, where readers look.
pub(crate) const CORNERS: [Corner; 4] = [
    Corner { right: true, bottom: false },
    Corner { right: false, bottom: false },
    Corner { right: true, bottom: true },
    Corner { right: false, bottom: true },
];

/// The box of a legend in a corner.
pub(crate) fn legend_frame(canvas: &Canvas, area: Rect, names: &[&str], corner: Corner) -> Rect {
    let widest = names.iter().map(|n| canvas.text_width(n, TICK_EM)).fold(0.0, f64::max);
    let (w, h) = (widest + 46.0, names.len() as f64 * 20.0 + 10.0);
    let x0 = if corner.right { area.x1 - 12.0 - w } else { area.x0 + 12.0 };
    let y0 = if corner.bottom { area.y1 - 12.0 - h } else { area.y0 + 12.0 };
    Rect { x0, y0, x1: x0 + w, y1: y0 + h }
}

/// Draw a legend in the upper right corner with a line and a marker for each name, in the order of the colours.
pub(crate) fn legend(canvas: &mut Canvas, area: Rect, names: &[&str]) -> Result<()> {
    legend_at(canvas, area, names, CORNERS[0], &|color| Style { color, line: true, dots: true })
}

/// Draw a legend in a corner; `style` gives the style of each name by its index.
pub(crate) fn legend_at(canvas: &mut Canvas, area: Rect, names: &[&str], corner: Corner, style: &dyn Fn(usize) -> Style) -> Result<()> {
    let frame = legend_frame(canvas, area, names, corner);
    let (x0, y0) = (frame.x0, frame.y0);
    canvas.fill(frame, WHITE);
    canvas.frame(frame, [190, 190, 195], 1.0);
    for (k, name) in names.iter().enumerate() {
        let y = y0 + 15.0 + 20.0 * k as f64;
        let style = style(k);
        let color = LINES[style.color % LINES.len()];
        if style.line {
            canvas.fill(Rect { x0: x0 + 8.0, x1: x0 + 32.0, y0: y - 0.9, y1: y + 0.9 }, color);
        }
        if style.dots {
            canvas.dot((x0 + 20.0, y), 3.6, color, 1.0, frame);
        }
        canvas.text((x0 + 38.0, y + 0.365 * TICK_EM), name, TICK_EM, Align::Left, INK)?;
    }
    Ok(())
}
