//! Solved gains, beside the truth where it is known. One time gives a point for each antenna, a few antennas a small panel each, and many
//! antennas a map of antenna and time.

use super::axes::Axis;
use super::canvas::{Align, Canvas, INK, Rect};
use super::colors::{BLANK, ColorScale, Curve, LINES, bar_area};
use super::gain_grid::grid;
use super::gain_values::{GainQuantity, GainValues};
use super::legend::{CORNERS, Style, legend_at};
use super::panel::{LABEL_EM, Panel, RIGHT_ROOM, Sheet};
use super::picture::Picture;
use super::size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::calibrate::GainDifferences;
use crate::{ChainError, Result};
use cittert_arrays::GainTable;
use ndarray::Array2;

/// How to draw gains.
#[derive(Debug, Clone, PartialEq)]
pub struct GainPlot {
    /// The part of the gains that is shown.
    pub quantity: GainQuantity,
    /// The differences from the truth, where it is known.
    pub differences: Option<GainDifferences>,
    /// Title; empty for none. Its second line is smaller.
    pub title: String,
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels.
    pub height: usize,
}

impl Default for GainPlot {
    fn default() -> Self {
        Self {
            quantity: GainQuantity::Phase,
            differences: None,
            title: String::new(),
            width: DEFAULT_WIDTH,
            height: DEFAULT_HEIGHT * 3 / 4,
        }
    }
}

/// Largest number of antennas that have a panel each.
const MOST_PANELS: usize = 36;
/// Size of antenna names, pixels of an em.
const NAME_EM: f64 = 10.5;

/// Draw the gains of the middle channel and the first feed.
///
/// # Errors
/// No known gain, a picture below 100 or above 8000 pixels.
pub fn gains(table: &GainTable, options: &GainPlot) -> Result<Picture> {
    let values = GainValues::of(table, options.differences.as_ref(), options.quantity);
    if !values.solved.iter().any(|v| v.is_finite()) {
        return Err(ChainError::NoData("every gain of the middle channel and the first feed is flagged".into()));
    }
    let mut said: Vec<String> = Vec::new();
    if let Some(rms) = values.rms() {
        let rms = if values.quantity == GainQuantity::Phase { format!("{rms:.2} deg") } else { format!("{rms:.2e}") };
        said.push(format!("Solved less true: {rms} rms, without what calibration cannot determine."));
    }
    if !values.part.is_empty() {
        said.push(format!("Shown: {}.", values.part));
    }
    let sheet = Sheet::new(&options.title, options.width, options.height).with_note(said.join(" "));
    let canvas = Canvas::new(options.width, options.height)?;
    if values.minutes.len() == 1 {
        of_antennas(canvas, &sheet, &values)
    } else if values.names.len() <= MOST_PANELS {
        grid(canvas, &sheet, &values)
    } else {
        map(canvas, &sheet, &values)
    }
}

/// One time: a point for each antenna, the truth as a ring, and what is left below.
fn of_antennas(mut canvas: Canvas, sheet: &Sheet, values: &GainValues) -> Result<Picture> {
    let n = values.names.len();
    let widest = values.names.iter().map(|name| canvas.text_width(name, NAME_EM)).fold(0.0, f64::max);
    let (top, bottom) = (sheet.top(), sheet.height - sheet.bottom(&canvas) - (widest - 14.0).max(0.0));
    let shown: Vec<&Array2<f64>> = std::iter::once(&values.solved).chain(&values.truth).collect();
    let (low, high) = values.ends(&shown);
    let y = |low: f64, high: f64, label: &str| Axis { step: (high == 180.0).then_some(90.0), ..Axis::linear(low, high, label) };
    let mut axes = vec![(y(low, high, values.label()), 1.0)];
    if let Some(difference) = &values.difference {
        let (low, high) = match values.quantity {
            GainQuantity::Phase => values.ends(&[difference]),
            GainQuantity::Amplitude => {
                let most = difference.iter().filter(|v| v.is_finite()).fold(1e-6_f64, |m, v| m.max(v.abs()));
                (-1.15 * most, 1.15 * most)
            }
        };
        axes[0].1 = 0.56;
        let unit = if values.quantity == GainQuantity::Phase { " (deg)" } else { "" };
        axes.push((y(low, high, &format!("Solved \u{2212} true{unit}")), 0.44));
    }
    let room = |of: fn(&Axis, &Canvas, f64) -> f64| axes.iter().map(|(a, part)| of(a, &canvas, part * sheet.height)).fold(0.0, f64::max);
    let (x0, label_room) = (room(Panel::left_room).round(), Some(room(Panel::tick_width)));
    let x = Axis { step: Some(f64::INFINITY), ..Axis::linear(0.2, n as f64 + 0.8, "") };
    let mut y0 = top;
    let mut panels = Vec::new();
    for (axis, part) in axes {
        let y1 = y0 + (part * (bottom - top)).round() - if part < 0.5 { 0.0 } else { 9.0 };
        let area = Rect { x0, x1: sheet.width - RIGHT_ROOM, y0, y1: y1.min(bottom) };
        panels.push(Panel { area, x: x.clone(), y: axis, label_room });
        y0 = y1 + 18.0;
    }
    let radius = (260.0 / n as f64).clamp(2.2, 5.0);
    let last = panels.len() - 1;
    for (k, panel) in panels.iter().enumerate() {
        panel.grid(&mut canvas);
        let (_, zero) = panel.at(0.0, 0.0);
        if panel.y.from < 0.0 {
            canvas.fill(Rect { y0: zero - 0.5, y1: zero + 0.5, ..panel.area }, [150, 150, 156]);
        }
        for a in 0..n {
            let place = |v: f64| panel.at((a + 1) as f64, v);
            if k == 1 {
                if let Some(v) = values.difference.as_ref().map(|d| d[(0, a)]).filter(|v| v.is_finite()) {
                    let (px, py) = place(v);
                    let half = (0.3 * panel.area.width() / (n as f64 + 0.6)).min(7.0);
                    canvas.fill(Rect { x0: px - half, x1: px + half, y0: py.min(zero), y1: py.max(zero) }, LINES[0]);
                }
                continue;
            }
            if let Some(v) = values.truth.as_ref().map(|t| t[(0, a)]).filter(|v| v.is_finite()) {
                canvas.dot(place(v), radius + 2.4, LINES[1], 1.0, panel.area);
                canvas.dot(place(v), radius + 0.9, [255, 255, 255], 1.0, panel.area);
            }
            if values.solved[(0, a)].is_finite() {
                canvas.dot(place(values.solved[(0, a)]), radius, LINES[0], 1.0, panel.area);
            }
        }
        panel.axes(&mut canvas, false)?;
        if k == last {
            names_below(&mut canvas, panel, &values.names)?;
            let at = (f64::midpoint(panel.area.x0, panel.area.x1), panel.area.y1 + 12.0 + widest + 12.0 + 0.73 * LABEL_EM);
            canvas.text(at, "Antenna", LABEL_EM, Align::Center, INK)?;
        }
    }
    if values.truth.is_some() {
        let style = |k: usize| Style { color: k, line: false, dots: true };
        legend_at(&mut canvas, panels[0].area, &["Solved", "True (ring)"], CORNERS[0], &style)?;
    }
    sheet.finish(canvas, panels[0].area)
}

/// Names below a panel, upwards. Where there are too many of them, every second or third is written.
fn names_below(canvas: &mut Canvas, panel: &Panel, names: &[String]) -> Result<()> {
    let every = ((NAME_EM + 2.5) * names.len() as f64 / panel.area.width()).ceil().max(1.0) as usize;
    for (k, name) in names.iter().enumerate().filter(|(k, _)| k % every == 0) {
        let (x, _) = panel.at((k + 1) as f64, panel.y.from);
        canvas.fill(Rect { x0: x - 0.5, x1: x + 0.5, y0: panel.area.y1, y1: panel.area.y1 + 4.0 }, INK);
        canvas.text_up((x + 0.36 * NAME_EM, panel.area.y1 + 8.0), name, NAME_EM, Align::Right, INK)?;
    }
    Ok(())
}

/// Many antennas and times: a row of cells for each antenna.
fn map(mut canvas: Canvas, sheet: &Sheet, values: &GainValues) -> Result<Picture> {
    let shown = values.difference.as_ref().unwrap_or(&values.solved);
    let (gradient, label) = match (&values.difference, values.quantity) {
        (Some(_), _) => (colorous::RED_BLUE, format!("Solved \u{2212} true: {}", values.label().to_lowercase())),
        (None, GainQuantity::Phase) => (colorous::SINEBOW, values.label().to_owned()),
        (None, GainQuantity::Amplitude) => (colorous::VIRIDIS, values.label().to_owned()),
    };
    let (low, high) = match (&values.difference, values.quantity) {
        (Some(_), _) => {
            let mut all: Vec<f64> = shown.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
            let k = all.len().saturating_sub(1) * 99 / 100;
            let most = if all.is_empty() { 1.0 } else { all.select_nth_unstable_by(k, f64::total_cmp).1.max(1e-6) };
            (-most, most)
        }
        (None, GainQuantity::Phase) => (-180.0, 180.0),
        (None, GainQuantity::Amplitude) => values.ends(&[shown]),
    };
    let scale = ColorScale { gradient, reversed: values.difference.is_some(), low, high, stretch: Curve::Linear, blank: BLANK };
    let (n_time, n) = shown.dim();
    let last = values.minutes.last().copied().unwrap_or(0.0);
    let half = if n_time > 1 { 0.5 * last / (n_time - 1) as f64 } else { 0.5 };
    let names = values.names.iter().map(|name| canvas.text_width(name, NAME_EM)).fold(0.0, f64::max);
    let bar = scale.bar_room(&canvas, sheet.height, 1.0);
    let area = Rect { x0: (names + 56.0).round(), x1: sheet.width - bar, y0: sheet.top(), y1: sheet.height - sheet.bottom(&canvas) };
    let x = Axis::linear(-half, last + half, "Time (min)");
    let y = Axis { step: Some(f64::INFINITY), ..Axis::linear(n as f64 + 0.5, 0.5, "Antenna") };
    let panel = Panel { area, x, y, label_room: Some(names) };
    // The cell of a time is that of the nearest solution.
    let nearest = |place: f64| {
        let minutes = -half + place * (last + 2.0 * half);
        let after = values.minutes.partition_point(|m| *m < minutes);
        let choices = [after.saturating_sub(1), after.min(n_time - 1)];
        if (values.minutes[choices[0]] - minutes).abs() < (values.minutes[choices[1]] - minutes).abs() { choices[0] } else { choices[1] }
    };
    canvas.shade(area, |x, y| scale.color(shown[(nearest(x), ((y * n as f64) as usize).min(n - 1))]));
    panel.axes(&mut canvas, true)?;
    let every = ((NAME_EM + 2.5) * n as f64 / area.height()).ceil().max(1.0) as usize;
    for (k, name) in values.names.iter().enumerate().filter(|(k, _)| k % every == 0) {
        let (_, py) = panel.at(0.0, (k + 1) as f64);
        canvas.text((area.x0 - 8.0, py + 0.36 * NAME_EM), name, NAME_EM, Align::Right, INK)?;
    }
    scale.bar(&mut canvas, bar_area(area), 1.0, &label)?;
    sheet.finish(canvas, area)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::positions;
    use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, SpectralWindow};
    use num_complex::Complex64;

    fn table(n_ant: usize, n_time: usize) -> GainTable {
        let antennas = positions(n_ant, 100.0, 0.0, 1).into_iter().enumerate();
        let antennas = antennas.map(|(k, p)| Antenna::new(format!("A{k}"), k as u32, p)).collect();
        let layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
        let times = (0..n_time).map(|t| 2_460_000.0 + t as f64 * 1e-3).collect();
        let band = SpectralWindow::band(1e9, 1e6, 1).unwrap();
        let mut table = GainTable::unity(layout, band, vec!["I".into()], times, vec![80.0; n_time]).unwrap();
        for ((t, a, _, _), g) in table.gains.indexed_iter_mut() {
            *g = Complex64::from_polar(1.0, (a as f64 * 1.7 + t as f64 * 0.1).sin());
        }
        table
    }

    #[test]
    fn every_size_of_table_is_drawn_with_and_without_the_truth() {
        for (n_ant, n_time) in [(3, 1), (96, 1), (9, 20), (64, 30)] {
            let found = table(n_ant, n_time);
            let shape = found.gains.dim();
            let differences = GainDifferences {
                phase_rad: ndarray::Array4::from_elem(shape, 0.1),
                log_amplitude: ndarray::Array4::from_elem(shape, 0.01),
            };
            for quantity in [GainQuantity::Phase, GainQuantity::Amplitude] {
                for differences in [None, Some(differences.clone())] {
                    let options = GainPlot { quantity, differences, title: "gains".into(), width: 500, height: 400 };
                    gains(&found, &options).unwrap().png().unwrap();
                }
            }
        }
        let mut none = table(3, 1);
        none.flags.fill(true);
        assert!(gains(&none, &GainPlot::default()).err().unwrap().to_string().contains("flagged"));
    }

    #[test]
    fn what_is_left_is_told() {
        let differences = GainDifferences {
            phase_rad: ndarray::Array4::from_elem((1, 3, 1, 1), 0.1),
            log_amplitude: ndarray::Array4::from_elem((1, 3, 1, 1), 0.0),
        };
        let values = GainValues::of(&table(3, 1), Some(&differences), GainQuantity::Phase);
        assert!((values.rms().unwrap() - 0.1_f64.to_degrees()).abs() < 1e-9);
        let truth = values.truth.as_ref().unwrap()[(0, 1)];
        assert!((truth - (values.solved[(0, 1)] - 0.1_f64.to_degrees())).abs() < 1e-9);
    }
}
