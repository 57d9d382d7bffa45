//! Planes of values as coloured cells, with axes, colour bar, contours and beam. Several planes stand side by side in the same colours.

use super::axes::Axis;
use super::canvas::{Align, Canvas, INK, Rect, WHITE};
use super::colors::{ColorScale, bar_area};
use super::contour::contours;
use super::panel::{LABEL_EM, Panel, Sheet, fitted};
use super::picture::Picture;
use crate::Result;
use ndarray::ArrayView2;

/// One plane of a picture.
pub(super) struct Map<'a> {
    pub(super) plane: ArrayView2<'a, f64>,
    /// Title above the panel, where there are several; empty for none.
    pub(super) title: String,
    pub(super) beam: Option<Ellipse>,
    /// Values of the contours.
    pub(super) levels: Vec<f64>,
}

/// A picture of coloured cells.
pub(super) struct Heat<'a> {
    pub(super) maps: Vec<Map<'a>>,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) scale: ColorScale,
    /// Divisor of the values beside the colour bar.
    pub(super) unit: f64,
    pub(super) bar_label: String,
    pub(super) sheet: Sheet,
    /// A pixel over several cells shows the value that is farthest from zero, not the mean.
    pub(super) extremes: bool,
}

/// The beam as drawn: full widths in units of the axes, position angle in rad.
#[derive(Clone, Copy)]
pub(super) struct Ellipse {
    pub(super) major: f64,
    pub(super) minor: f64,
    pub(super) pa_rad: f64,
}

/// Distance between panels side by side, pixels.
const GAP: f64 = 18.0;
/// Room above a panel that has a title of its own, pixels.
const TITLE_ROOM: f64 = 24.0;
/// Smallest height of a picture, pixels, if it may have it.
const LEAST_HEIGHT: f64 = 260.0;

impl Heat<'_> {
    pub(super) fn draw(self) -> Result<Picture> {
        let Sheet { width: w, height: h, .. } = self.sheet;
        let measure = Canvas::new(w as usize, h as usize)?;
        let n = self.maps.len() as f64;
        let titled = self.maps.iter().any(|m| !m.title.is_empty());
        let top = self.sheet.top() + if titled { TITLE_ROOM } else { 0.0 };
        let bottom = self.sheet.bottom(&measure);
        let left = Panel::left_room(&self.y, &measure, h - top - bottom);
        let bar = self.scale.bar_room(&measure, h - top - bottom, self.unit);
        // The largest panels with square cells. The picture is cut to their height.
        let (room_x, room_y) = ((w - left - bar - GAP * (n - 1.0)) / n, h - top - bottom);
        let (span_x, span_y) = ((self.x.to - self.x.from).abs(), (self.y.to - self.y.from).abs());
        let k = (room_x / span_x).min(room_y / span_y);
        let (pw, ph) = ((k * span_x).round().max(2.0), (k * span_y).round().max(2.0));
        let height = (top + ph + bottom).min(h).max(LEAST_HEIGHT.min(h));
        let all = n * pw + GAP * (n - 1.0);
        let (x0, y0) = ((left + (w - left - bar - all) / 2.0).round(), (top + (height - top - bottom - ph) / 2.0).round());
        let mut canvas = Canvas::new(w as usize, height as usize)?;
        let mut area = Rect { x0, y0, x1: x0 + pw, y1: y0 + ph };
        for (number, map) in self.maps.iter().enumerate() {
            let from = x0 + number as f64 * (pw + GAP);
            area = Rect { x0: from, x1: from + pw, ..area };
            self.cells(&mut canvas, map.plane, area);
            self.lines(&mut canvas, map, area)?;
            if let Some(beam) = map.beam {
                draw_beam(&mut canvas, area, k, beam, self.x.to > self.x.from)?;
            }
            Panel { area, x: self.x.clone(), y: self.y.clone(), label_room: None }.frame(&mut canvas, true, number == 0)?;
            if !map.title.is_empty() {
                let (title, em) = fitted(&canvas, &map.title, LABEL_EM, pw + GAP - 4.0);
                canvas.text((f64::midpoint(area.x0, area.x1), area.y0 - 9.0), &title, em, Align::Center, INK)?;
            }
        }
        self.scale.bar(&mut canvas, bar_area(area), self.unit, &self.bar_label)?;
        let over = Rect { x0, y0: area.y0 - (top - self.sheet.top()), x1: area.x1, y1: area.y1 };
        self.sheet.finish(canvas, over)
    }

    /// Colour the cells. A pixel that covers several cells shows one value of them, without the cells that have no value.
    pub(super) fn cells(&self, canvas: &mut Canvas, plane: ArrayView2<'_, f64>, area: Rect) {
        let (rows, columns) = plane.dim();
        let (half_x, half_y) = (0.25 / area.width(), 0.25 / area.height()); // half a drawn pixel
        let span = |center: f64, half: f64, n: usize| {
            let first = (((center - half) * n as f64).floor().max(0.0) as usize).min(n - 1);
            let last = (((center + half) * n as f64).ceil() as usize).clamp(first + 1, n);
            if (2.0 * half) * n as f64 <= 1.0 {
                let only = ((center * n as f64) as usize).min(n - 1);
                only..only + 1
            } else {
                first..last
            }
        };
        canvas.shade(area, |x, y| {
            let (cs, rs) = (span(x, half_x, columns), span(1.0 - y, half_y, rows));
            let (mut sum, mut n, mut farthest) = (0.0, 0_u32, 0.0_f64);
            for r in rs {
                for c in cs.clone() {
                    let v = plane[[r, c]];
                    if v.is_finite() {
                        sum += v;
                        n += 1;
                        farthest = if v.abs() > farthest.abs() { v } else { farthest };
                    }
                }
            }
            match n {
                0 => self.scale.color(f64::NAN),
                _ if self.extremes => self.scale.color(farthest),
                n => self.scale.color(sum / f64::from(n)),
            }
        });
    }

    /// Draw the contours of a plane: solid and dark or light, whichever differs more from the colour below, and blue below zero.
    fn lines(&self, canvas: &mut Canvas, map: &Map<'_>, area: Rect) -> Result<()> {
        let (rows, columns) = map.plane.dim();
        let at =
            |(c, r): (f64, f64)| (area.x0 + (c + 0.5) / columns as f64 * area.width(), area.y1 - (r + 0.5) / rows as f64 * area.height());
        for level in &map.levels {
            let [r, g, b] = self.scale.color(*level).map(f64::from);
            let light = 0.3 * r + 0.6 * g + 0.1 * b > 140.0;
            let color = match (*level < 0.0, light) {
                (true, _) => [90, 170, 255],
                (false, true) => [60, 20, 20],
                (false, false) => [245, 240, 225],
            };
            for line in contours(map.plane, *level) {
                canvas.line(&line.into_iter().map(at).collect::<Vec<_>>(), color, 0.9)?;
            }
        }
        Ok(())
    }
}

/// Largest fraction of the pixels that lie outside of the lowest contours.
const CROWDED: f64 = 0.02;

/// Contours at 3, 6, 12 ... times the noise up to the largest value, and below zero at minus the first. Where the side lobes of bright points
/// would fill the picture with lines, the first contours are left out.
pub(super) fn levels(plane: ArrayView2<'_, f64>, noise: f64) -> Vec<f64> {
    let max = plane.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    if !(noise > 0.0 && max > 3.0 * noise) {
        return Vec::new();
    }
    let beyond = |level: f64| plane.iter().filter(|v| v.abs() > level).count() as f64 / plane.len() as f64;
    let doubling = || std::iter::successors(Some(3.0 * noise), |v| Some(2.0 * v)).take_while(|v| *v < max).take(24);
    let first = doubling().find(|level| beyond(*level) < CROWDED).unwrap_or(0.5 * max);
    std::iter::once(-first).chain(doubling().filter(|level| *level >= first)).collect()
}

/// Draw the beam as a filled ellipse in a box in the lower left corner; `k` pixels are one unit of the axes.
fn draw_beam(canvas: &mut Canvas, area: Rect, k: f64, Ellipse { major, minor, pa_rad }: Ellipse, l_to_right: bool) -> Result<()> {
    // A beam as wide as half the picture would hide the image.
    if !(major * k > 0.0 && major * k < 0.5 * area.width().min(area.height())) {
        return Ok(());
    }
    let (a, b) = ((0.5 * major * k).max(1.5), (0.5 * minor * k).max(1.0));
    let side = (2.0 * a + 12.0).max(20.0);
    let frame = Rect { x0: area.x0 + 10.0, y0: area.y1 - 10.0 - side, x1: area.x0 + 10.0 + side, y1: area.y1 - 10.0 };
    canvas.fill(frame, WHITE);
    canvas.frame(frame, INK, 1.0);
    let (cx, cy) = (f64::midpoint(frame.x0, frame.x1), f64::midpoint(frame.y0, frame.y1));
    let (sin, cos) = pa_rad.sin_cos();
    let east = if l_to_right { 1.0 } else { -1.0 };
    let outline: Vec<(f64, f64)> = (0..72)
        .map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 72.0).sin_cos();
            let (l, m) = (a * c * sin + b * s * cos, a * c * cos - b * s * sin);
            (cx + east * l, cy - m)
        })
        .collect();
    canvas.polygon(&outline, [90, 96, 110], 1.0)
}
