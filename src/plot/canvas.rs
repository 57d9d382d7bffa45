//! The canvas of a picture. Everything is drawn at twice the size and averaged down, which smooths lines and spaces letters evenly.

use super::failed::plot_error;
use super::palette::indexed;
use super::shape::Shape;
pub(crate) use super::shape::{Align, DIM, FAINT, INK, Rect, Rgb, WHITE};
use crate::{ChainError, Result};
use plotters::backend::BitMapBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{PathElement, Polygon};
use plotters::style::{FontStyle, FontTransform, IntoFont, RGBAColor, RGBColor, ShapeStyle, TextStyle, register_font};
use std::ops::Range;
use std::sync::OnceLock;

/// Pixels drawn for each pixel shown, along each side.
const OVER: usize = 2;
/// Name under which the embedded font is known to plotters.
const FONT: &str = "DejaVu Sans";
pub(super) static FONT_BYTES: &[u8] = include_bytes!("fonts/DejaVuSans.ttf");
/// Height of a line of the font divided by its em. plotters measures font sizes in lines.
const LINE_PER_EM: f64 = 1.164;

/// The pixels of a picture. All coordinates count the pixels that are shown.
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    /// RGB of the enlarged picture.
    pixels: Vec<u8>,
    /// The same as shapes.
    shapes: Vec<Shape>,
}

/// Whether a line from `a` over `b` to `c` turns by more than a right angle.
fn turns_back(a: (i32, i32), b: (i32, i32), c: (i32, i32)) -> bool {
    let step = |from: (i32, i32), to: (i32, i32)| (i64::from(to.0) - i64::from(from.0), i64::from(to.1) - i64::from(from.1));
    let (one, two) = (step(a, b), step(b, c));
    one.0 * two.0 + one.1 * two.1 < 0
}

fn color(c: Rgb, alpha: f64) -> RGBAColor {
    RGBAColor(c[0], c[1], c[2], alpha)
}

impl Canvas {
    /// A white canvas.
    ///
    /// # Errors
    /// A side below 100 or above 8000 pixels; a font that cannot be read.
    pub(crate) fn new(width: usize, height: usize) -> Result<Self> {
        static REGISTERED: OnceLock<bool> = OnceLock::new();
        if !REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, FONT_BYTES).is_ok()) {
            return Err(plot_error("the embedded font is damaged"));
        }
        for side in [width, height] {
            if !(100..=8000).contains(&side) {
                return Err(ChainError::BadOption {
                    option: "picture size",
                    value: side.to_string(),
                    expected: "100 to 8000 pixels a side".into(),
                });
            }
        }
        Ok(Self { width, height, pixels: vec![255; width * height * OVER * OVER * 3], shapes: Vec::new() })
    }

    /// Width and height, pixels.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// What was drawn, in order.
    pub(super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The enlarged picture as plotters draws on it.
    fn area(&mut self) -> DrawingArea<BitMapBackend<'_>, Shift> {
        let size = ((self.width * OVER) as u32, (self.height * OVER) as u32);
        BitMapBackend::with_buffer(&mut self.pixels, size).into_drawing_area()
    }

    fn scaled(points: &[(f64, f64)]) -> Vec<(i32, i32)> {
        points.iter().map(|(x, y)| ((x * OVER as f64).round() as i32, (y * OVER as f64).round() as i32)).collect()
    }

    /// A line through points.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], c: Rgb, width: f64) -> Result<()> {
        self.shapes.push(Shape::Line { points: points.to_vec(), color: c, width });
        let stroke = (width * OVER as f64).round().max(1.0) as u32;
        let style = ShapeStyle { color: color(c, 1.0), filled: false, stroke_width: stroke };
        let points = Self::scaled(points);
        let area = self.area();
        // The mitre of a sharp turn would reach far out of the panel. The line therefore ends there, and a new line begins.
        let mut from = 0;
        for at in 1..points.len() {
            let last = at + 1 == points.len();
            if last || turns_back(points[at - 1], points[at], points[at + 1]) {
                area.draw(&PathElement::new(points[from..=at].to_vec(), style)).map_err(plot_error)?;
                from = at;
            }
        }
        Ok(())
    }

    /// A filled polygon.
    pub(crate) fn polygon(&mut self, points: &[(f64, f64)], c: Rgb, alpha: f64) -> Result<()> {
        self.shapes.push(Shape::Polygon { points: points.to_vec(), color: c, alpha });
        let style = ShapeStyle { color: color(c, alpha), filled: true, stroke_width: 0 };
        self.area().draw(&Polygon::new(Self::scaled(points), style)).map_err(plot_error)
    }

    /// A filled rectangle.
    pub(crate) fn fill(&mut self, r: Rect, c: Rgb) {
        self.shapes.push(Shape::Fill { area: r, color: c });
        self.paint(r, |_, _| c);
    }

    /// The outline of a rectangle.
    pub(crate) fn frame(&mut self, r: Rect, c: Rgb, width: f64) {
        let h = width / 2.0;
        for side in [
            Rect { x0: r.x0 - h, x1: r.x1 + h, y0: r.y0 - h, y1: r.y0 + h },
            Rect { x0: r.x0 - h, x1: r.x1 + h, y0: r.y1 - h, y1: r.y1 + h },
            Rect { x0: r.x0 - h, x1: r.x0 + h, y0: r.y0, y1: r.y1 },
            Rect { x0: r.x1 - h, x1: r.x1 + h, y0: r.y0, y1: r.y1 },
        ] {
            self.fill(side, c);
        }
    }

    /// Colour every drawn pixel of a rectangle by its place: x runs from 0 at the left to 1, y from 0 at the top to 1.
    pub(crate) fn shade(&mut self, r: Rect, c: impl FnMut(f64, f64) -> Rgb) {
        let (x, y) = self.paint(r, c);
        let row = |y: usize| &self.pixels[3 * (y * self.width * OVER + x.start)..3 * (y * self.width * OVER + x.end)];
        let rgb: Vec<u8> = y.clone().flat_map(|y| row(y).iter().copied()).collect();
        if !rgb.is_empty() {
            let shown = |n: usize| n as f64 / OVER as f64;
            let area = Rect { x0: shown(x.start), x1: shown(x.end), y0: shown(y.start), y1: shown(y.end) };
            self.shapes.push(Shape::Pixels { area, width: x.len(), height: y.len(), rgb });
        }
    }

    /// Colour the drawn pixels of a rectangle. Returns their columns and rows.
    fn paint(&mut self, r: Rect, mut c: impl FnMut(f64, f64) -> Rgb) -> (Range<usize>, Range<usize>) {
        // A rectangle may reach over the edge of the picture; that part is not drawn.
        let edge = |v: f64, n: usize| ((v * OVER as f64).round().max(0.0) as usize).min(n * OVER);
        let (x0, x1) = (edge(r.x0, self.width), edge(r.x1, self.width));
        let (y0, y1) = (edge(r.y0, self.height), edge(r.y1, self.height));
        for y in y0..y1 {
            for x in x0..x1 {
                let at = 3 * (y * self.width * OVER + x);
                let rgb = c((x as f64 + 0.5 - x0 as f64) / (x1 - x0) as f64, (y as f64 + 0.5 - y0 as f64) / (y1 - y0) as f64);
                self.pixels[at..at + 3].copy_from_slice(&rgb);
            }
        }
        (x0..x1, y0..y1)
    }

    /// Draw a round dot with a soft edge over the picture, inside `clip` only.
    pub(crate) fn dot(&mut self, (x, y): (f64, f64), radius: f64, c: Rgb, alpha: f64, clip: Rect) {
        self.shapes.push(Shape::Dot { at: (x, y), radius, color: c, alpha, clip });
        let s = OVER as f64;
        let (cx, cy, r) = (x * s, y * s, radius * s);
        let low = |v: f64, limit: f64| (v - r - 1.0).max(limit * s).max(0.0) as usize;
        let high = |v: f64, limit: f64, n: usize| ((v + r + 2.0).min(limit * s).max(0.0) as usize).min(n * OVER);
        for py in low(cy, clip.y0)..high(cy, clip.y1, self.height) {
            for px in low(cx, clip.x0)..high(cx, clip.x1, self.width) {
                let d = (px as f64 + 0.5 - cx).hypot(py as f64 + 0.5 - cy);
                let a = alpha * (r + 0.5 - d).clamp(0.0, 1.0);
                if a > 0.0 {
                    let at = 3 * (py * self.width * OVER + px);
                    for (k, v) in c.iter().enumerate() {
                        let old = f64::from(self.pixels[at + k]);
                        self.pixels[at + k] = (old + a * (f64::from(*v) - old)).round() as u8;
                    }
                }
            }
        }
    }

    /// Width of a text of `em` pixels, pixels.
    pub(crate) fn text_width(&self, text: &str, em: f64) -> f64 {
        let size = em * LINE_PER_EM * OVER as f64;
        (FONT, size).into_font().layout_box(text).map_or(0.0, |((x0, _), (x1, _))| f64::from(x1 - x0) / OVER as f64)
    }

    /// Text of `em` pixels whose base line passes through y.
    pub(crate) fn text(&mut self, (x, y): (f64, f64), text: &str, em: f64, align: Align, c: Rgb) -> Result<()> {
        self.shapes.push(Shape::Text { at: (x, y), text: text.to_owned(), em, align, color: c, upwards: false });
        self.write((x - self.shift(text, em, align), y), text, em, c, FontTransform::None)
    }

    /// Text that reads upwards, whose base line is at x; `align` is along the text from below.
    pub(crate) fn text_up(&mut self, (x, y): (f64, f64), text: &str, em: f64, align: Align, c: Rgb) -> Result<()> {
        self.shapes.push(Shape::Text { at: (x, y), text: text.to_owned(), em, align, color: c, upwards: true });
        self.write((x, y + self.shift(text, em, align)), text, em, c, FontTransform::Rotate270)
    }

    fn shift(&self, text: &str, em: f64, align: Align) -> f64 {
        match align {
            Align::Left => 0.0,
            Align::Center => self.text_width(text, em) / 2.0,
            Align::Right => self.text_width(text, em),
        }
    }

    fn write(&mut self, (x, y): (f64, f64), text: &str, em: f64, c: Rgb, turn: FontTransform) -> Result<()> {
        let s = OVER as f64;
        let size = em * LINE_PER_EM * s;
        // plotters puts the base line half a line below the point it is given.
        let (x, y) = match turn {
            FontTransform::None => (x * s, y * s - size / 2.0),
            _ => (x * s - size / 2.0, y * s),
        };
        let font = (FONT, size).into_font().transform(turn);
        let ink = RGBColor(c[0], c[1], c[2]);
        let style = TextStyle::from(font).color(&ink);
        self.area().draw_text(text, &style, (x.round() as i32, y.round() as i32)).map_err(plot_error)
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// Never for a canvas of valid size; the encoder's error is passed on.
    pub(crate) fn png(self) -> Result<Vec<u8>> {
        let (w, h) = (self.width, self.height);
        let mut small = vec![0_u8; w * h * 3];
        for y in 0..h {
            for x in 0..w {
                for k in 0..3 {
                    let mut sum = 0_usize;
                    for dy in 0..OVER {
                        for dx in 0..OVER {
                            sum += usize::from(self.pixels[3 * ((y * OVER + dy) * w * OVER + x * OVER + dx) + k]);
                        }
                    }
                    small[3 * (y * w + x) + k] = ((sum + OVER * OVER / 2) / (OVER * OVER)) as u8;
                }
            }
        }
        indexed(w, h, &small)
    }
}

/// A picture as the bytes of a PNG file.
///
/// # Errors
/// A failure of the encoder.
pub(crate) fn encode(picture: image::DynamicImage) -> Result<Vec<u8>> {
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).map_err(plot_error)?;
    Ok(png.into_inner())
}
