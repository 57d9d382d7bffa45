//! Lines with error bars.

use super::axes::{Axis, BOTTOM_ROOM, Panel, TICK_EM, title};
use super::canvas::{Align, Canvas, INK, Rect, WHITE};
use super::colors::LINES;
use super::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::{ChainError, Result};

/// One line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// Half lengths of the error bars, below and above; empty for none \[point\].
    pub errors: Vec<(f64, f64)>,
}

/// How to draw the lines.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveOptions {
    /// Title; empty for none.
    pub title: String,
    /// Label of the x axis with its unit.
    pub x_label: String,
    /// Label of the y axis with its unit.
    pub y_label: String,
    /// Logarithmic x axis.
    pub log_x: bool,
    /// Logarithmic y axis.
    pub log_y: bool,
    /// Draw markers at the points.
    pub markers: bool,
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels.
    pub height: usize,
}

impl Default for CurveOptions {
    fn default() -> Self {
        Self {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            log_x: false,
            log_y: false,
            markers: true,
            width: DEFAULT_WIDTH,
            height: DEFAULT_HEIGHT * 3 / 4,
        }
    }
}

/// Draw lines with error bars and a legend. Points that are not finite, or not positive on a logarithmic axis, are left out.
///
/// # Errors
/// No point that can be drawn, error bars that are not one for each point.
pub fn curves(series: &[Series], options: &CurveOptions) -> Result<Vec<u8>> {
    let usable = |(x, y): (f64, f64)| x.is_finite() && y.is_finite() && !(options.log_x && x <= 0.0) && !(options.log_y && y <= 0.0);
    let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    for s in series {
        if !s.errors.is_empty() && s.errors.len() != s.points.len() {
            return Err(ChainError::Incompatible(format!(
                "line {:?} has {} points but {} error bars",
                s.name,
                s.points.len(),
                s.errors.len()
            )));
        }
        for (k, (x, y)) in s.points.iter().enumerate().filter(|(_, p)| usable(**p)) {
            let (below, above) = s.errors.get(k).copied().unwrap_or((0.0, 0.0));
            let low = if options.log_y && y - below <= 0.0 { *y } else { y - below };
            for (end, lo, hi) in [(0, *x, *x), (1, low, y + above)] {
                if lo.is_finite() && hi.is_finite() {
                    ends[end] = (ends[end].0.min(lo), ends[end].1.max(hi));
                }
            }
        }
    }
    if ends.iter().any(|(lo, hi)| lo > hi) {
        return Err(ChainError::NoData("no line has a point that can be drawn".into()));
    }
    let x = axis(ends[0], options.log_x, &options.x_label, false);
    let y = axis(ends[1], options.log_y, &options.y_label, true);
    let mut canvas = Canvas::new(options.width, options.height)?;
    let top = if options.title.is_empty() { 18.0 } else { 44.0 };
    let left = Panel::left_room(&y, &canvas, options.height as f64 - top - BOTTOM_ROOM);
    let area = Rect { x0: left.round(), y0: top, x1: options.width as f64 - 28.0, y1: options.height as f64 - BOTTOM_ROOM };
    let mut panel = Panel { area, x, y, label_room: None };
    let named: Vec<&str> = series.iter().map(|s| s.name.as_str()).collect();
    let legend = named.iter().any(|n| !n.is_empty());
    let mut corner = (true, false);
    if legend {
        match emptiest_corner(&canvas, series, &panel, &usable) {
            Some(free) => corner = free,
            None => make_room(&mut panel, legend_frame(&canvas, area, &named, corner).height() + 16.0),
        }
    }
    panel.grid(&mut canvas);
    for (k, s) in series.iter().enumerate() {
        let color = LINES[k % LINES.len()];
        let points: Vec<(f64, f64)> = s.points.iter().copied().filter(|p| usable(*p)).map(|(x, y)| panel.at(x, y)).collect();
        if points.len() > 1 {
            canvas.line(&points, color, 1.8)?;
        }
        for (i, (below, above)) in s.errors.iter().enumerate().filter(|(i, _)| usable(s.points[*i])) {
            let (px, py) = s.points[i];
            let (at, y_high) = panel.at(px, py + above);
            let low = if options.log_y { (py - below).max(panel.y.from) } else { py - below };
            let (_, y_low) = panel.at(px, low);
            if !(y_high.is_finite() && y_low.is_finite()) {
                continue;
            }
            canvas.fill(Rect { x0: at - 0.6, x1: at + 0.6, y0: y_high, y1: y_low }, color);
            for y in [y_high, y_low] {
                canvas.fill(Rect { x0: at - 3.5, x1: at + 3.5, y0: y - 0.6, y1: y + 0.6 }, color);
            }
        }
        if options.markers {
            for p in points {
                canvas.dot(p, 3.6, color, 1.0, panel.area);
            }
        }
    }
    panel.axes(&mut canvas, true)?;
    if legend {
        legend_at(&mut canvas, panel.area, &named, corner)?;
    }
    if !options.title.is_empty() {
        title(&mut canvas, panel.area, &options.title, options.width as f64 - 20.0)?;
    }
    canvas.png()
}

/// An axis a little longer than its data; from 0 where a linear y axis begins near it.
fn axis((lo, hi): (f64, f64), log: bool, label: &str, from_zero: bool) -> Axis {
    let (from, to) = if log {
        let margin = (hi / lo).powf(0.05).max(1.1);
        (lo / margin, hi * margin)
    } else {
        let margin = if hi > lo { 0.05 * (hi - lo) } else { 0.5 * hi.abs().max(1.0) };
        (if from_zero && lo >= 0.0 && lo < 0.4 * hi { 0.0 } else { lo - margin }, hi + margin)
    };
    Axis { from, to, log, step: None, label: label.to_owned() }
}

/// Lengthen the y axis upwards by so many pixels.
fn make_room(panel: &mut Panel, pixels: f64) {
    let share = pixels / (panel.area.height() - pixels).max(1.0);
    let y = &mut panel.y;
    y.to = if y.log { y.to * (y.to / y.from).powf(share) } else { y.to + share * (y.to - y.from) };
}

/// Corner of the panel (right, bottom) where a legend covers none of the lines and error bars.
fn emptiest_corner(canvas: &Canvas, series: &[Series], panel: &Panel, usable: &dyn Fn((f64, f64)) -> bool) -> Option<(bool, bool)> {
    let names: Vec<&str> = series.iter().map(|s| s.name.as_str()).collect();
    let corners = [(true, false), (false, false), (true, true), (false, true)];
    let mut covered = [0_u32; 4];
    let frames = corners.map(|c| legend_frame(canvas, panel.area, &names, c));
    let mut meet = |p: (f64, f64)| {
        for (n, f) in covered.iter_mut().zip(&frames) {
            *n += u32::from(f.x0 - 5.0 < p.0 && p.0 < f.x1 + 5.0 && f.y0 - 5.0 < p.1 && p.1 < f.y1 + 5.0);
        }
    };
    for s in series {
        let mut last: Option<(f64, f64)> = None;
        for (k, p) in s.points.iter().enumerate().filter(|(_, p)| usable(**p)) {
            let at = panel.at(p.0, p.1);
            let (below, above) = s.errors.get(k).copied().unwrap_or((0.0, 0.0));
            let (_, high) = panel.at(p.0, p.1 + above);
            let low = p.1 - below;
            let (_, low) = if usable((p.0, low)) { panel.at(p.0, low) } else { (at.0, panel.area.y1) };
            for t in 0..=10 {
                let t = f64::from(t) / 10.0;
                meet((at.0, high + t * (low - high)));
                if let Some(from) = last {
                    meet((from.0 + t * (at.0 - from.0), from.1 + t * (at.1 - from.1)));
                }
            }
            last = Some(at);
        }
    }
    // min_by_key keeps the first of equals: the upper right, where readers look.
    (0..4).min_by_key(|k| covered[*k]).filter(|k| covered[*k] == 0).map(|k| corners[k])
}

/// Where a legend goes in a corner.
fn legend_frame(canvas: &Canvas, area: Rect, names: &[&str], (right, bottom): (bool, bool)) -> Rect {
    let widest = names.iter().map(|n| canvas.text_width(n, TICK_EM)).fold(0.0, f64::max);
    let (w, h) = (widest + 46.0, names.len() as f64 * 20.0 + 10.0);
    let x0 = if right { area.x1 - 12.0 - w } else { area.x0 + 12.0 };
    let y0 = if bottom { area.y1 - 12.0 - h } else { area.y0 + 12.0 };
    Rect { x0, y0, x1: x0 + w, y1: y0 + h }
}

/// A legend in the upper right corner, a dot a name.
pub(crate) fn legend(canvas: &mut Canvas, area: Rect, names: &[&str]) -> Result<()> {
    legend_at(canvas, area, names, (true, false))
}

fn legend_at(canvas: &mut Canvas, area: Rect, names: &[&str], corner: (bool, bool)) -> Result<()> {
    let frame = legend_frame(canvas, area, names, corner);
    let (x0, y0) = (frame.x0, frame.y0);
    canvas.fill(frame, WHITE);
    canvas.frame(frame, [190, 190, 195], 1.0);
    for (k, name) in names.iter().enumerate() {
        let y = y0 + 15.0 + 20.0 * k as f64;
        let color = LINES[k % LINES.len()];
        canvas.fill(Rect { x0: x0 + 8.0, x1: x0 + 32.0, y0: y - 0.9, y1: y + 0.9 }, color);
        canvas.dot((x0 + 20.0, y), 3.6, color, 1.0, frame);
        canvas.text((x0 + 38.0, y + 0.365 * TICK_EM), name, TICK_EM, Align::Left, INK)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_drawn_in_their_colours_and_bad_points_left_out() {
        let s = Series {
            name: "a".into(),
            points: vec![(1.0, 1.0), (2.0, f64::NAN), (3.0, 100.0), (-1.0, 5.0)],
            errors: vec![(0.5, 0.5), (1.0, 1.0), (200.0, 10.0), (0.0, 0.0)],
        };
        let options = CurveOptions { log_x: true, log_y: true, width: 400, height: 300, ..CurveOptions::default() };
        let png = curves(std::slice::from_ref(&s), &options).unwrap();
        let picture = ::image::load_from_memory(&png).unwrap().to_rgb8();
        assert!(picture.pixels().filter(|p| p.0 == LINES[0]).count() > 300);
        let e = curves(&[Series { points: vec![(-1.0, 1.0)], ..Series::default() }], &options).unwrap_err().to_string();
        assert!(e.contains("no line"), "{e}");
        assert!(curves(&[Series { errors: vec![(1.0, 1.0)], ..s }], &options).is_err());
    }
}
