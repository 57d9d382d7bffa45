//! A panel with two axes, and the sheet on which panels are placed below a heading.

use super::axes::Axis;
use super::canvas::{Align, Canvas, DIM, FAINT, INK, Rect};
use super::picture::Picture;
use crate::Result;

/// Size of tick labels, pixels of an em.
pub(crate) const TICK_EM: f64 = 13.0;
/// Size of axis labels, pixels of an em.
pub(crate) const LABEL_EM: f64 = 14.5;
/// Size of headings, pixels of an em.
const TITLE_EM: f64 = 17.0;
/// Size of the line below a heading, pixels of an em.
const SUBTITLE_EM: f64 = 12.5;
/// Size of the lines below a panel, pixels of an em.
pub(crate) const NOTE_EM: f64 = 12.0;
/// Room below a panel for ticks and label, pixels.
pub(crate) const BOTTOM_ROOM: f64 = 62.0;
/// Room to the right of a panel that has nothing beside it, pixels.
pub(crate) const RIGHT_ROOM: f64 = 24.0;

/// Smallest text, pixels of an em.
const SMALLEST_EM: f64 = 9.0;
/// A picture with a side below this has no lines below its panels, pixels.
const SMALL_SHEET: f64 = 450.0;
/// Distance of the lines below a panel, pixels.
const NOTE_LINE: f64 = 17.0;

/// The properties of a picture that its panels need: its size in pixels, its heading, and the lines below the panels.
pub(crate) struct Sheet {
    pub(crate) heading: String,
    subtitle: String,
    note: String,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Sheet {
    /// A sheet with this heading. A second line of the heading is smaller.
    pub(crate) fn new(heading: &str, width: usize, height: usize) -> Self {
        let (heading, subtitle) = heading.split_once('\n').unwrap_or((heading, ""));
        Self { heading: heading.into(), subtitle: subtitle.into(), note: String::new(), width: width as f64, height: height as f64 }
    }

    /// The sheet with sentences below its panels, broken into lines where they are long.
    pub(crate) fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Upper edge of the panels, pixels.
    pub(crate) fn top(&self) -> f64 {
        let line = |text: &str, height| if text.is_empty() { 0.0 } else { height };
        18.0 + line(&self.heading, 26.0) + line(&self.subtitle, 18.0)
    }

    /// Room below the panels: ticks, the label of x, and the note, pixels.
    pub(crate) fn bottom(&self, canvas: &Canvas) -> f64 {
        let lines = self.note_lines(canvas).len() as f64;
        BOTTOM_ROOM + if lines > 0.0 { NOTE_LINE * lines + 2.0 } else { 0.0 }
    }

    fn note_lines(&self, canvas: &Canvas) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        // In a small picture, the panel needs the room.
        if self.width.min(self.height) < SMALL_SHEET {
            return lines;
        }
        for word in self.note.split_whitespace() {
            match lines.last_mut().filter(|l| canvas.text_width(&format!("{l} {word}"), NOTE_EM) <= self.width - 24.0) {
                Some(line) => *line += &format!(" {word}"),
                None => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// The largest square panel, in the middle of the sheet, with `right` pixels free at its right.
    pub(crate) fn square(&self, canvas: &Canvas, x: Axis, y: Axis, right: f64) -> Panel {
        let (left, y0) = (Panel::left_room(&y, canvas, self.height), self.top());
        let side = (self.width - left - right).min(self.height - y0 - self.bottom(canvas)).round();
        let x0 = (left + (self.width - left - right - side) / 2.0).round();
        Panel { area: Rect { x0, y0, x1: x0 + side, y1: y0 + side }, x, y, label_room: None }
    }

    /// Draw the heading above a panel and the note below, and finish the picture. A text that does not fit is drawn smaller.
    ///
    /// # Errors
    /// A failure of the drawing library.
    pub(crate) fn finish(&self, mut canvas: Canvas, area: Rect) -> Result<Picture> {
        let mut above = area.y0 - 12.0;
        for (text, em, color) in [(&self.subtitle, SUBTITLE_EM, DIM), (&self.heading, TITLE_EM, INK)] {
            if !text.is_empty() {
                let (shown, em) = fitted(&canvas, text, em, self.width - 20.0);
                let half = canvas.text_width(&shown, em) / 2.0;
                // The text stands over the panel, moved where it would reach over the edge of the picture.
                let x = f64::midpoint(area.x0, area.x1).min(self.width - 10.0 - half).max(10.0 + half);
                canvas.text((x, above), &shown, em, Align::Center, color)?;
                above -= 21.0;
            }
        }
        let lines = self.note_lines(&canvas);
        for (k, line) in lines.iter().rev().enumerate() {
            let (shown, em) = fitted(&canvas, line, NOTE_EM, self.width - 24.0);
            canvas.text((12.0, canvas.size().1 as f64 - 9.0 - NOTE_LINE * k as f64), &shown, em, Align::Left, DIM)?;
        }
        Ok(Picture(canvas))
    }
}

/// Number of ticks of a y axis of this height in pixels.
fn y_ticks(height: f64) -> usize {
    (height / 62.0).max(3.0) as usize
}

/// A text and its size, made smaller where it is wider than `room`. A text that is too long at the smallest size loses its end.
pub(crate) fn fitted(canvas: &Canvas, text: &str, em: f64, room: f64) -> (String, f64) {
    let width = canvas.text_width(text, em);
    if width <= room {
        return (text.to_owned(), em);
    }
    let smaller = (0.98 * em * room / width).max(SMALLEST_EM);
    let mut shown = text.to_owned();
    while canvas.text_width(&shown, smaller) > room && shown.chars().count() > 2 {
        let keep = shown.chars().count() - 2;
        shown = shown.chars().take(keep).collect::<String>().trim_end_matches('\u{2026}').to_owned() + "\u{2026}";
    }
    (shown, smaller)
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
        self.y.ticks(y_ticks(self.area.height()))
    }

    /// Width of the widest tick label of a y axis, pixels.
    pub(crate) fn tick_width(y: &Axis, canvas: &Canvas, height: f64) -> f64 {
        let ticks = y.ticks(y_ticks(height));
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
        self.frame(canvas, with_x, true)
    }

    /// As [`Panel::axes`], without the labels of an axis that another panel beside this one shows.
    ///
    /// # Errors
    /// A failure of the drawing library.
    pub(crate) fn frame(&self, canvas: &mut Canvas, with_x: bool, with_y: bool) -> Result<()> {
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
            if !with_y {
                continue;
            }
            canvas.text((a.x0 - 9.0, y + 0.365 * TICK_EM), &text, TICK_EM, Align::Right, INK)?;
            widest = widest.max(canvas.text_width(&text, TICK_EM));
        }
        if with_x && !self.x.label.is_empty() {
            let y = a.y1 + 9.0 + TICK_EM + 12.0 + 0.73 * LABEL_EM;
            let (label, em) = fitted(canvas, &self.x.label, LABEL_EM, a.width() + 40.0);
            canvas.text((f64::midpoint(a.x0, a.x1), y), &label, em, Align::Center, INK)?;
        }
        if !with_y || self.y.label.is_empty() {
            return Ok(());
        }
        let x = a.x0 - 9.0 - self.label_room.unwrap_or(widest) - 13.0;
        let (label, em) = fitted(canvas, &self.y.label, LABEL_EM, a.height() + 24.0);
        canvas.text_up((x, f64::midpoint(a.y0, a.y1)), &label, em, Align::Center, INK)
    }
}
