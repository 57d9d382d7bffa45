//! A panel with two axes, and the sheet on which panels are placed below a heading.

use super::axes::Axis;
use super::canvas::{Align, Canvas, FAINT, INK, Rect};
use super::picture::Picture;
use crate::Result;

/// Size of tick labels, pixels of an em.
pub(crate) const TICK_EM: f64 = 13.0;
/// Size of axis labels, pixels of an em.
pub(crate) const LABEL_EM: f64 = 14.5;
/// Size of headings, pixels of an em.
const TITLE_EM: f64 = 16.0;
/// Room below a panel for ticks and label, pixels.
pub(crate) const BOTTOM_ROOM: f64 = 62.0;
/// Room to the right of a panel that has nothing beside it, pixels.
pub(crate) const RIGHT_ROOM: f64 = 24.0;

/// The properties of a picture that its panels need: its size in pixels and its heading.
pub(crate) struct Sheet<'a> {
    pub(crate) heading: &'a str,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl<'a> Sheet<'a> {
    pub(crate) fn new(heading: &'a str, width: usize, height: usize) -> Self {
        Self { heading, width: width as f64, height: height as f64 }
    }

    /// Upper edge of the panels, pixels.
    pub(crate) fn top(&self) -> f64 {
        if self.heading.is_empty() { 18.0 } else { 44.0 }
    }

    /// The largest square panel, in the middle of the sheet, with `right` pixels free at its right.
    pub(crate) fn square(&self, canvas: &Canvas, x: Axis, y: Axis, right: f64) -> Panel {
        let (left, y0) = (Panel::left_room(&y, canvas, self.height), self.top());
        let side = (self.width - left - right).min(self.height - y0 - BOTTOM_ROOM).round();
        let x0 = (left + (self.width - left - right - side) / 2.0).round();
        Panel { area: Rect { x0, y0, x1: x0 + side, y1: y0 + side }, x, y, label_room: None }
    }

    /// Draw the heading above a panel, shortened where it does not fit, and finish the picture.
    ///
    /// # Errors
    /// A failure of the drawing library.
    pub(crate) fn finish(&self, mut canvas: Canvas, area: Rect) -> Result<Picture> {
        let mut shown = self.heading.to_owned();
        while canvas.text_width(&shown, TITLE_EM) > self.width - 20.0 && shown.chars().count() > 4 {
            let keep = shown.chars().count() - 2;
            shown = shown.chars().take(keep).collect::<String>().trim_end_matches('\u{2026}').to_owned() + "\u{2026}";
        }
        if !shown.is_empty() {
            canvas.text((f64::midpoint(area.x0, area.x1), area.y0 - 12.0), &shown, TITLE_EM, Align::Center, INK)?;
        }
        Ok(Picture(canvas))
    }
}

/// A panel with two axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Panel {
    pub(crate) area: Rect,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// Width kept for the tick labels of y, pixels. Panels above each other share it, so that their axis labels line up.
    pub(crate) label_room: Option<f64>,
}

impl Panel {
    /// The pixel of a value.
    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (self.area.x0 + self.x.place(x) * self.area.width(), self.area.y1 - self.y.place(y) * self.area.height())
    }

    /// Draw the grid lines, before the data.
    pub(crate) fn grid(&self, canvas: &mut Canvas) {
        for (v, _) in self.x_ticks() {
            let (x, _) = self.at(v, self.y.from);
            canvas.fill(Rect { x0: x - 0.5, x1: x + 0.5, ..self.area }, FAINT);
        }
        for (v, _) in self.y_ticks() {
            let (_, y) = self.at(self.x.from, v);
            canvas.fill(Rect { y0: y - 0.5, y1: y + 0.5, ..self.area }, FAINT);
        }
    }

    /// Ticks along x. There are fewer of them where labels are long, so that labels never touch.
    fn x_ticks(&self) -> Vec<(f64, String)> {
        let mut count = (self.area.width() / 90.0).max(2.0) as usize;
        loop {
            let ticks = self.x.ticks(count);
            let widest = ticks.iter().map(|t| t.1.chars().count()).max().unwrap_or(0) as f64 * TICK_EM * 0.64 + 12.0;
            if count <= 2 || ticks.len() as f64 * widest <= self.area.width() {
                return ticks;
            }
            count -= 1;
        }
    }

    fn y_ticks(&self) -> Vec<(f64, String)> {
        self.y.ticks((self.area.height() / 70.0).max(2.0) as usize)
    }

    /// Width of the widest tick label of a y axis, pixels.
    pub(crate) fn tick_width(y: &Axis, canvas: &Canvas, height: f64) -> f64 {
        let ticks = y.ticks((height / 70.0).max(2.0) as usize);
        ticks.iter().map(|t| canvas.text_width(&t.1, TICK_EM)).fold(0.0, f64::max)
    }

    /// Room for the tick labels and the label of the y axis at the left of a panel, pixels.
    pub(crate) fn left_room(y: &Axis, canvas: &Canvas, height: f64) -> f64 {
        12.0 + LABEL_EM + 14.0 + Self::tick_width(y, canvas, height) + 10.0
    }

    /// Draw frame, ticks and labels, over the data.
    ///
    /// # Errors
    /// A failure of the drawing library.
    pub(crate) fn axes(&self, canvas: &mut Canvas, with_x: bool) -> Result<()> {
        let a = self.area;
        canvas.frame(a, INK, 1.0);
        for (v, text) in self.x_ticks() {
            let (x, _) = self.at(v, self.y.from);
            canvas.fill(Rect { x0: x - 0.5, x1: x + 0.5, y0: a.y1, y1: a.y1 + 5.0 }, INK);
            if with_x {
                canvas.text((x, a.y1 + 9.0 + 0.73 * TICK_EM), &text, TICK_EM, Align::Center, INK)?;
            }
        }
        let mut widest = 0.0_f64;
        for (v, text) in self.y_ticks() {
            let (_, y) = self.at(self.x.from, v);
            canvas.fill(Rect { x0: a.x0 - 5.0, x1: a.x0, y0: y - 0.5, y1: y + 0.5 }, INK);
            canvas.text((a.x0 - 9.0, y + 0.365 * TICK_EM), &text, TICK_EM, Align::Right, INK)?;
            widest = widest.max(canvas.text_width(&text, TICK_EM));
        }
        if with_x {
            let y = a.y1 + 9.0 + TICK_EM + 12.0 + 0.73 * LABEL_EM;
            canvas.text((f64::midpoint(a.x0, a.x1), y), &self.x.label, LABEL_EM, Align::Center, INK)?;
        }
        let x = a.x0 - 9.0 - self.label_room.unwrap_or(widest) - 13.0;
        canvas.text_up((x, f64::midpoint(a.y0, a.y1)), &self.y.label, LABEL_EM, Align::Center, INK)
    }
}
