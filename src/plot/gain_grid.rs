//! A small panel for each antenna: solved gains as dots over the truth as a line, against time.

use super::axes::Axis;
use super::canvas::{Align, Canvas, INK, Rect};
use super::colors::LINES;
use super::gain_values::{GainQuantity, GainValues};
use super::panel::{LABEL_EM, NOTE_EM, Panel, Sheet};
use super::picture::Picture;
use crate::Result;
use ndarray::{Array2, Axis as Dimension};

/// Distance between panels, pixels.
const GAP: f64 = 7.0;
/// Columns for each row of panels where both are as large as they can be: panels are wider than high.
const SHAPE: f64 = 0.9;

pub(super) fn grid(mut canvas: Canvas, sheet: &Sheet, values: &GainValues) -> Result<Picture> {
    let n = values.names.len();
    let columns = ((n as f64 * SHAPE).sqrt().round() as usize).clamp(1, n);
    let rows = n.div_ceil(columns);
    let shown: Vec<&Array2<f64>> = std::iter::once(&values.solved).chain(&values.truth).collect();
    let (low, high) = values.ends(&shown);
    let y = Axis { step: (high == 180.0).then_some(180.0), ..Axis::linear(low, high, "") };
    let last = values.minutes.last().copied().unwrap_or(0.0);
    let margin = (0.04 * last).max(1e-3);
    let x = Axis::linear(-margin, last + margin, "");
    let left = (Panel::left_room(&y, &canvas, 70.0) + 2.0).round();
    // The legend stands above the panels.
    let top = sheet.top() + 20.0;
    let bottom = sheet.height - sheet.bottom(&canvas);
    let w = (sheet.width - left - 16.0 - GAP * (columns - 1) as f64) / columns as f64;
    let h = (bottom - top - GAP * (rows - 1) as f64) / rows as f64;
    let whole = Rect { x0: left, x1: sheet.width - 16.0, y0: top, y1: bottom };
    for (a, name) in values.names.iter().enumerate() {
        let (row, column) = (a / columns, a % columns);
        let (x0, y0) = ((left + column as f64 * (w + GAP)).round(), (top + row as f64 * (h + GAP)).round());
        let area = Rect { x0, y0, x1: (x0 + w).round(), y1: (y0 + h).round() };
        let panel = Panel { area, x: x.clone(), y: y.clone(), label_room: None };
        panel.grid(&mut canvas);
        let points = |of: &Array2<f64>| -> Vec<(f64, f64)> {
            let at = |(t, v): (usize, &f64)| (values.minutes[t], *v);
            of.index_axis(Dimension(1), a).iter().enumerate().map(at).collect()
        };
        if let Some(truth) = &values.truth {
            for line in pieces(&points(truth), values.quantity) {
                canvas.line(&line.into_iter().map(|p| panel.at(p.0, p.1)).collect::<Vec<_>>(), LINES[1], 1.4)?;
            }
        }
        for p in points(&values.solved).into_iter().filter(|p| p.1.is_finite()) {
            canvas.dot(panel.at(p.0, p.1), if last > 0.0 && values.minutes.len() > 60 { 1.3 } else { 2.0 }, LINES[0], 1.0, area);
        }
        // The last row of a column has the ticks of time, also where the grid is not full.
        panel.frame(&mut canvas, a + columns >= n, column == 0)?;
        let room = canvas.text_width(name, NOTE_EM);
        canvas.fill(Rect { x0: area.x0 + 3.0, x1: area.x0 + 9.0 + room, y0: area.y0 + 2.0, y1: area.y0 + 4.0 + NOTE_EM }, [255, 255, 255]);
        canvas.text((area.x0 + 6.0, area.y0 + 2.0 + NOTE_EM), name, NOTE_EM, Align::Left, INK)?;
    }
    let middle = (f64::midpoint(whole.x0, whole.x1), f64::midpoint(whole.y0, whole.y1));
    canvas.text((middle.0, whole.y1 + 34.0 + 0.73 * LABEL_EM), "Time (min)", LABEL_EM, Align::Center, INK)?;
    canvas.text_up((12.0 + 0.73 * LABEL_EM, middle.1), values.label(), LABEL_EM, Align::Center, INK)?;
    if values.truth.is_some() {
        canvas.dot((left + 6.0, top - 11.0), 3.0, LINES[0], 1.0, Rect { x0: 0.0, y0: 0.0, x1: sheet.width, y1: sheet.height });
        canvas.text((left + 14.0, top - 7.0), "solved", NOTE_EM, Align::Left, INK)?;
        canvas.fill(Rect { x0: left + 74.0, x1: left + 94.0, y0: top - 12.0, y1: top - 10.4 }, LINES[1]);
        canvas.text((left + 100.0, top - 7.0), "true", NOTE_EM, Align::Left, INK)?;
    }
    let over = Rect { y0: sheet.top(), ..whole };
    sheet.finish(canvas, over)
}

/// Lines through points, broken where a value is missing and where a phase goes once around.
fn pieces(points: &[(f64, f64)], quantity: GainQuantity) -> Vec<Vec<(f64, f64)>> {
    let mut out: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for p in points {
        let turned = |last: &(f64, f64)| quantity == GainQuantity::Phase && (p.1 - last.1).abs() > 180.0;
        if let Some(line) = out.last_mut()
            && p.1.is_finite()
            && !line.last().is_some_and(turned)
        {
            line.push(*p);
        } else {
            out.push(if p.1.is_finite() { vec![*p] } else { Vec::new() });
        }
    }
    out.retain(|line| line.len() > 1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_where_a_phase_turns_and_where_it_is_missing() {
        let points = [(0.0, 170.0), (1.0, 179.0), (2.0, -178.0), (3.0, -170.0), (4.0, f64::NAN), (5.0, 10.0)];
        let found = pieces(&points, GainQuantity::Phase);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert_eq!(pieces(&points, GainQuantity::Amplitude)[0].len(), 4);
    }
}
