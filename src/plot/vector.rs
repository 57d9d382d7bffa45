//! The shapes of a picture as SVG.

use super::failed::plot_error;
use super::palette::indexed;
use super::shape::{Align, Rect, Rgb, Shape, WHITE};
use crate::Result;
use base64::Engine;
use std::fmt::Write;

/// The shapes as a file in SVG.
pub(super) fn svg(width: usize, height: usize, shapes: &[Shape]) -> Result<String> {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"DejaVu Sans, Verdana, sans-serif\">\n"
    );
    let page = Rect { x0: 0.0, y0: 0.0, x1: width as f64, y1: height as f64 };
    let mut clips: Vec<Rect> = Vec::new();
    for shape in std::iter::once(&Shape::Fill { area: page, color: WHITE }).chain(shapes) {
        // Writing to a String does not fail, but the encoder of pixels may.
        write(&mut out, shape, &mut clips).map_err(|_| plot_error("pixels cannot be encoded"))?;
    }
    Ok(out + "</svg>\n")
}

fn write(out: &mut String, shape: &Shape, clips: &mut Vec<Rect>) -> std::fmt::Result {
    match shape {
        Shape::Line { points, color, width } => {
            write!(out, "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" points=\"", hex(*color))?;
            list(out, points)?;
            writeln!(out, "\"/>")
        }
        Shape::Polygon { points, color, alpha } => {
            write!(out, "<polygon fill=\"{}\" fill-opacity=\"{alpha}\" points=\"", hex(*color))?;
            list(out, points)?;
            writeln!(out, "\"/>")
        }
        Shape::Fill { area, color } => writeln!(out, "<rect {} fill=\"{}\"/>", place(area), hex(*color)),
        Shape::Pixels { area, width, height, rgb } => {
            let png = indexed(*width, *height, rgb).map_err(|_| std::fmt::Error)?;
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let how = "preserveAspectRatio=\"none\" image-rendering=\"pixelated\"";
            writeln!(out, "<image {} {how} href=\"data:image/png;base64,{data}\"/>", place(area))
        }
        Shape::Dot { at: (x, y), radius, color, alpha, clip } => {
            let inside = x - radius >= clip.x0 && x + radius <= clip.x1 && y - radius >= clip.y0 && y + radius <= clip.y1;
            if x + radius < clip.x0 || x - radius > clip.x1 || y + radius < clip.y0 || y - radius > clip.y1 {
                return Ok(());
            }
            let cut = if inside { String::new() } else { format!(" clip-path=\"url(#clip{})\"", clip_number(out, clips, clip)?) };
            let opacity = if *alpha < 1.0 { format!(" fill-opacity=\"{alpha}\"") } else { String::new() };
            writeln!(out, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"{}\"{opacity}{cut}/>", hex(*color))
        }
        Shape::Text { at: (x, y), text, em, align, color, upwards } => {
            let anchor = match align {
                Align::Left => "start",
                Align::Center => "middle",
                Align::Right => "end",
            };
            let turn = if *upwards { format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"") } else { String::new() };
            let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
            let color = hex(*color);
            writeln!(
                out,
                "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{em}\" text-anchor=\"{anchor}\" fill=\"{color}\"{turn}>{text}</text>"
            )
        }
    }
}

/// The number of the clip path of a rectangle, which is defined where it is first used.
fn clip_number(out: &mut String, clips: &mut Vec<Rect>, clip: &Rect) -> Result<usize, std::fmt::Error> {
    if let Some(k) = clips.iter().position(|c| c == clip) {
        return Ok(k);
    }
    clips.push(*clip);
    writeln!(out, "<clipPath id=\"clip{}\"><rect {}/></clipPath>", clips.len() - 1, place(clip))?;
    Ok(clips.len() - 1)
}

fn list(out: &mut String, points: &[(f64, f64)]) -> std::fmt::Result {
    points.iter().try_for_each(|(x, y)| write!(out, "{x:.2},{y:.2} "))
}

fn place(r: &Rect) -> String {
    format!("x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\"", r.x0, r.y0, r.width(), r.height())
}

fn hex(c: Rgb) -> String {
    format!("#{:02x}{:02x}{:02x}", c[0], c[1], c[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_written_in_their_order_and_cut_at_their_panel() {
        let clip = Rect { x0: 10.0, y0: 10.0, x1: 90.0, y1: 90.0 };
        let dot = |x: f64| Shape::Dot { at: (x, 50.0), radius: 5.0, color: [255, 0, 0], alpha: 0.5, clip };
        let text = Shape::Text { at: (3.0, 4.0), text: "a<b".into(), em: 12.0, align: Align::Center, color: [0, 0, 0], upwards: true };
        let found = svg(100, 100, &[dot(50.0), dot(88.0), dot(300.0), text]).unwrap();
        assert_eq!(found.matches("<circle").count(), 2);
        assert_eq!((found.matches("clip-path").count(), found.matches("<clipPath").count()), (1, 1));
        assert!(found.contains("fill=\"#ff0000\" fill-opacity=\"0.5\"") && found.contains("a&lt;b") && found.contains("rotate(-90"));
        assert!(found.starts_with("<svg") && found.ends_with("</svg>\n"));
    }
}
