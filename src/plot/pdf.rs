//! The shapes of a picture as PDF, on one page of the size of the picture.

use super::pdf_font::{FontRefs, PdfFont, packed};
use super::shape::{Align, Rect, Rgb, Shape};
use crate::Result;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Ref, Str};
use std::collections::BTreeMap;

/// Points of a page for each pixel: 96 pixels are one inch.
const POINTS: f32 = 0.75;
/// Objects of the file; the pictures follow.
const CATALOG: i32 = 1;
const PAGES: i32 = 2;
const PAGE: i32 = 3;
const CONTENT: i32 = 4;
const FONT: i32 = 5;
const FIRST_FREE: i32 = 10;
const FONT_NAME: Name<'static> = Name(b"F");

/// The page while it is drawn.
struct Page {
    content: Content,
    font: PdfFont,
    /// Pictures: pixels along both sides, and the packed red, green and blue.
    images: Vec<(i32, i32, Vec<u8>)>,
    /// Opacities in thousandths, which have a number each.
    alphas: BTreeMap<u32, usize>,
}

/// The shapes as a file in PDF.
///
/// # Errors
/// A font that cannot be read.
pub(super) fn pdf(width: usize, height: usize, shapes: &[Shape]) -> Result<Vec<u8>> {
    let (w, h) = (width as f32 * POINTS, height as f32 * POINTS);
    let mut page = Page { content: Content::new(), font: PdfFont::new()?, images: Vec::new(), alphas: BTreeMap::new() };
    // A PDF counts y upwards from the lower edge, shapes count it downwards in pixels.
    page.content.transform([POINTS, 0.0, 0.0, -POINTS, 0.0, h]);
    page.content.set_line_join(LineJoinStyle::RoundJoin);
    for shape in shapes {
        page.add(shape)?;
    }
    let mut file = Pdf::new();
    let at = |k: i32| Ref::new(k);
    file.catalog(at(CATALOG)).pages(at(PAGES));
    file.pages(at(PAGES)).kids([at(PAGE)]).count(1);
    let images: Vec<(String, Ref)> = (0..page.images.len()).map(|k| (format!("I{k}"), at(FIRST_FREE + k as i32))).collect();
    let first_state = FIRST_FREE + images.len() as i32;
    let mut leaf = file.page(at(PAGE));
    leaf.media_box(pdf_writer::Rect::new(0.0, 0.0, w, h)).parent(at(PAGES)).contents(at(CONTENT));
    let mut resources = leaf.resources();
    resources.fonts().pair(FONT_NAME, at(FONT));
    let mut objects = resources.x_objects();
    for (name, id) in &images {
        objects.pair(Name(name.as_bytes()), *id);
    }
    objects.finish();
    let mut states = resources.ext_g_states();
    for number in page.alphas.values() {
        states.pair(Name(format!("A{number}").as_bytes()), at(first_state + *number as i32));
    }
    states.finish();
    resources.finish();
    leaf.finish();
    file.stream(at(CONTENT), &packed(&page.content.finish())?).filter(Filter::FlateDecode);
    let [font, cid, descriptor, data, unicode] = [0, 1, 2, 3, 4].map(|k| at(FONT + k));
    page.font.write(&mut file, &FontRefs { font, cid, descriptor, data, unicode })?;
    for ((_, id), (columns, rows, data)) in images.iter().zip(&page.images) {
        let mut image = file.image_xobject(*id, data);
        image.width(*columns).height(*rows).bits_per_component(8);
        image.filter(Filter::FlateDecode);
        image.color_space().device_rgb();
        image.finish();
    }
    for (alpha, number) in &page.alphas {
        let alpha = *alpha as f32 / 1000.0;
        file.ext_graphics(at(first_state + *number as i32)).non_stroking_alpha(alpha).stroking_alpha(alpha);
    }
    Ok(file.finish())
}

impl Page {
    fn add(&mut self, shape: &Shape) -> Result<()> {
        match shape {
            Shape::Line { points, color, width } => {
                self.opacity(1.0);
                self.content.set_line_cap(LineCapStyle::ButtCap).set_line_width(*width as f32);
                self.stroke(*color).path(points);
                self.content.stroke();
            }
            Shape::Polygon { points, color, alpha } => {
                self.opacity(*alpha);
                self.fill(*color).path(points);
                self.content.close_path().fill_nonzero();
            }
            Shape::Fill { area, color } => {
                self.opacity(1.0);
                self.fill(*color).rect(area);
                self.content.fill_nonzero();
            }
            Shape::Pixels { area, width, height, rgb } => {
                self.opacity(1.0);
                let name = format!("I{}", self.images.len());
                self.images.push((*width as i32, *height as i32, packed(rgb)?));
                let (w, h) = (area.width() as f32, area.height() as f32);
                self.content.save_state().transform([w, 0.0, 0.0, -h, area.x0 as f32, area.y1 as f32]);
                self.content.x_object(Name(name.as_bytes())).restore_state();
            }
            Shape::Dot { at: (x, y), radius, color, alpha, clip } => {
                if x + radius < clip.x0 || x - radius > clip.x1 || y + radius < clip.y0 || y - radius > clip.y1 {
                    return Ok(());
                }
                let inside = x - radius >= clip.x0 && x + radius <= clip.x1 && y - radius >= clip.y0 && y + radius <= clip.y1;
                self.opacity(*alpha);
                if !inside {
                    self.content.save_state();
                    self.rect(clip);
                    self.content.clip_nonzero().end_path();
                }
                // A line without length and with round ends is a dot.
                self.content.set_line_cap(LineCapStyle::RoundCap).set_line_width(2.0 * *radius as f32);
                self.stroke(*color).path(&[(*x, *y), (*x, *y)]);
                self.content.stroke();
                if !inside {
                    self.content.restore_state();
                }
            }
            Shape::Text { at: (x, y), text, em, align, color, upwards } => {
                self.opacity(1.0);
                let (bytes, width) = self.font.encode(text);
                let em = *em as f32;
                let part = match align {
                    Align::Left => 0.0,
                    Align::Center => 0.5,
                    Align::Right => 1.0,
                };
                let back = em * width * part;
                let (x, y) = (*x as f32, *y as f32);
                let matrix = if *upwards { [0.0, -1.0, -1.0, 0.0, x, y + back] } else { [1.0, 0.0, 0.0, -1.0, x - back, y] };
                self.fill(*color);
                self.content.begin_text().set_font(FONT_NAME, em).set_text_matrix(matrix).show(Str(&bytes)).end_text();
            }
        }
        Ok(())
    }

    fn opacity(&mut self, alpha: f64) {
        let next = self.alphas.len();
        let number = *self.alphas.entry((1000.0 * alpha).round() as u32).or_insert(next);
        self.content.set_parameters(Name(format!("A{number}").as_bytes()));
    }

    fn stroke(&mut self, color: Rgb) -> &mut Self {
        let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
        self.content.set_stroke_rgb(r, g, b);
        self
    }

    fn fill(&mut self, color: Rgb) -> &mut Self {
        let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
        self.content.set_fill_rgb(r, g, b);
        self
    }

    fn path(&mut self, points: &[(f64, f64)]) {
        for (k, (x, y)) in points.iter().enumerate() {
            let (x, y) = (*x as f32, *y as f32);
            if k == 0 {
                self.content.move_to(x, y)
            } else {
                self.content.line_to(x, y)
            };
        }
    }

    fn rect(&mut self, r: &Rect) {
        self.content.rect(r.x0 as f32, r.y0 as f32, r.width() as f32, r.height() as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn find(file: &[u8], word: &[u8], from: usize) -> Option<usize> {
        file[from..].windows(word.len()).position(|w| w == word).map(|k| k + from)
    }

    /// The unpacked stream of an object, as a reader finds it: by the table at the end, and by the length that the object gives.
    fn stream(file: &[u8], object: usize) -> Vec<u8> {
        let text = String::from_utf8_lossy(file);
        let table: usize = text.rsplit("startxref").next().unwrap().split_whitespace().next().unwrap().parse().unwrap();
        assert!(file[table..].starts_with(b"xref"));
        let entry = std::str::from_utf8(&file[table..]).unwrap().lines().nth(2 + object).unwrap();
        let offset: usize = entry.split(' ').next().unwrap().parse().unwrap();
        assert!(file[offset..].starts_with(format!("{object} 0 obj").as_bytes()));
        let begin = find(file, b"stream\n", offset).unwrap() + 7;
        let head = std::str::from_utf8(&file[offset..begin]).unwrap();
        let length: usize = head.split("/Length ").nth(1).unwrap().split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap();
        assert!(file[begin + length..].trim_ascii_start().starts_with(b"endstream"));
        let mut out = Vec::new();
        flate2::read::ZlibDecoder::new(&file[begin..begin + length]).read_to_end(&mut out).unwrap();
        out
    }

    #[test]
    fn a_file_holds_its_shapes_where_its_table_says() {
        let clip = Rect { x0: 10.0, y0: 10.0, x1: 90.0, y1: 90.0 };
        let dot = |x: f64| Shape::Dot { at: (x, 50.0), radius: 5.0, color: [255, 0, 0], alpha: 0.5, clip };
        let text =
            |upwards| Shape::Text { at: (3.0, 4.0), text: "5 \u{3bc}Jy".into(), em: 12.0, align: Align::Center, color: [0, 0, 0], upwards };
        let pixels = Shape::Pixels { area: clip, width: 2, height: 1, rgb: vec![1, 2, 3, 4, 5, 6] };
        let line = Shape::Line { points: vec![(1.0, 2.0), (30.0, 40.0)], color: [0, 0, 255], width: 1.5 };
        let file = pdf(100, 80, &[pixels, line, dot(50.0), dot(88.0), dot(300.0), text(false), text(true)]).unwrap();
        assert!(file.starts_with(b"%PDF-") && file.trim_ascii_end().ends_with(b"%%EOF"));
        let page = String::from_utf8(stream(&file, CONTENT as usize)).unwrap();
        // The dot outside is not drawn, and the one over the edge is cut.
        assert_eq!((page.matches("\nW").count(), page.matches(" TL").count()), (1, 0), "{page}");
        assert_eq!((page.matches("/I0 Do").count(), page.matches("Tj").count(), page.matches("\nS").count()), (1, 2, 3), "{page}");
        assert_eq!(stream(&file, FIRST_FREE as usize), [1, 2, 3, 4, 5, 6]);
        // The cut font is a TrueType file with a part of the glyphs.
        let font = stream(&file, (FONT + 3) as usize);
        assert!(font.starts_with(&[0, 1, 0, 0]) && font.len() < 20_000, "{}", font.len());
        let text = String::from_utf8_lossy(&file);
        assert!(text.contains("/MediaBox [0 0 75 60]") && text.contains("<03BC>"));
    }
}
