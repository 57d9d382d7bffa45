//! Lines with error bars.

use super::axes::Axis;
use super::canvas::{Canvas, Rect};
use super::colors::LINES;
use super::legend::{CORNERS, Corner, Style, legend_at, legend_frame};
use super::panel::{Panel, Sheet};
use super::picture::Picture;
use super::size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::{ChainError, Result};

/// One line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend; a line without a name is not in the legend.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// Lengths of the error bars below and above each point; empty for no error bars \[point\].
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
    /// Styles of the first lines \[line\]. Each of the other lines has its own colour, and markers if `markers` is set.
    pub styles: Vec<Style>,
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels.
    pub height: usize,
}

impl CurveOptions {
    fn style(&self, index: usize) -> Style {
        self.styles.get(index).copied().unwrap_or(Style { color: index, line: true, dots: self.markers })
    }
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
            styles: Vec::new(),
            width: DEFAULT_WIDTH,
            height: DEFAULT_HEIGHT * 3 / 4,
        }
    }
}

/// Draw lines with error bars and a legend. Points that are not finite, or not positive on a logarithmic axis, are left out.
///
/// # Errors
/// No point that can be drawn, or a number of error bars that differs from the number of points.
pub fn curves(series: &[Series], options: &CurveOptions) -> Result<Picture> {
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
    let sheet = Sheet::new(&options.title, options.width, options.height);
    let (top, bottom) = (sheet.top(), sheet.height - sheet.bottom(&canvas));
    let left = Panel::left_room(&y, &canvas, bottom - top);
    let area = Rect { x0: left.round(), y0: top, x1: sheet.width - 28.0, y1: bottom };
    let mut panel = Panel { area, x, y, label_room: None };
    // Lines with a name, by index, and their names.
    let (keys, named): (Vec<usize>, Vec<&str>) =
        series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()).map(|(k, s)| (k, s.name.as_str())).unzip();
    let free = if named.is_empty() { None } else { free_corner(&canvas, series, &panel, &named, &usable) };
    let corner = free.unwrap_or(CORNERS[0]);
    if free.is_none() && !named.is_empty() {
        make_room(&mut panel, legend_frame(&canvas, area, &named, corner).height() + 16.0);
    }
    panel.grid(&mut canvas);
    for (k, s) in series.iter().enumerate() {
        let style = options.style(k);
        let color = LINES[style.color % LINES.len()];
        let points: Vec<(f64, f64)> = s.points.iter().copied().filter(|p| usable(*p)).map(|(x, y)| panel.at(x, y)).collect();
        if style.line && points.len() > 1 {
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
        if style.dots {
            for p in points {
                canvas.dot(p, 3.6, color, 1.0, panel.area);
            }
        }
    }
    panel.axes(&mut canvas, true)?;
    if !named.is_empty() {
        legend_at(&mut canvas, panel.area, &named, corner, &|k| options.style(keys[k]))?;
    }
    sheet.finish(canvas, panel.area)
}

/// An axis a little longer than its data. A linear y axis begins at 0 where the data begin near 0.
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

/// The first corner of the panel in which a legend covers none of the lines and error bars.
fn free_corner(canvas: &Canvas, series: &[Series], panel: &Panel, names: &[&str], usable: &dyn Fn((f64, f64)) -> bool) -> Option<Corner> {
    let mut free = [true; 4];
    let frames = CORNERS.map(|c| legend_frame(canvas, panel.area, names, c));
    let mut meet = |p: (f64, f64)| {
        for (free, f) in free.iter_mut().zip(&frames) {
            *free &= !(f.x0 - 5.0 < p.0 && p.0 < f.x1 + 5.0 && f.y0 - 5.0 < p.1 && p.1 < f.y1 + 5.0);
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
    (0..4).find(|k| free[*k]).map(|k| CORNERS[k])
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
        let png = curves(std::slice::from_ref(&s), &options).unwrap().png().unwrap();
        let picture = ::image::load_from_memory(&png).unwrap().to_rgb8();
        assert!(picture.pixels().filter(|p| p.0 == LINES[0]).count() > 300);
        let dots = Style { color: 3, line: false, dots: true };
        let png = curves(&[Series { errors: Vec::new(), ..s.clone() }], &CurveOptions { styles: vec![dots], ..options.clone() })
            .unwrap()
            .png()
            .unwrap();
        let picture = ::image::load_from_memory(&png).unwrap().to_rgb8();
        let colored = |c: usize| picture.pixels().filter(|p| p.0 == LINES[c]).count();
        assert!(colored(0) == 0 && (20..200).contains(&colored(3)), "{} {}", colored(0), colored(3));
        let e = curves(&[Series { points: vec![(-1.0, 1.0)], ..Series::default() }], &options).err().unwrap().to_string();
        assert!(e.contains("no line"), "{e}");
        assert!(curves(&[Series { errors: vec![(1.0, 1.0)], ..s }], &options).is_err());
    }
}
