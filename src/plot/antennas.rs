//! Antenna positions.

use super::axes::Axis;
use super::canvas::{Align, Canvas, INK, Rect};
use super::colors::LINES;
use super::panel::{RIGHT_ROOM, Sheet};
use super::picture::Picture;
use crate::Result;
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame};

/// Size of antenna names, pixels of an em.
const NAME_EM: f64 = 10.5;
/// Radius of the dot of an antenna whose diameter is too small to be shown to scale, pixels.
const SMALL_DOT: f64 = 3.5;
/// Largest number of antennas whose names are drawn.
const MOST_NAMES: usize = 60;

/// Draw the antennas of a layout from above, or along the boresight. Diameters are to scale where they are large enough to be seen.
/// Names are drawn where there is room.
///
/// # Errors
/// A picture below 100 or above 8000 pixels.
pub fn layout(layout: &ArrayLayout, heading: &str, width: usize, height: usize) -> Result<Picture> {
    let antennas = layout.antennas();
    let bounds = |k: usize| {
        let all = antennas.iter().map(|a| a.position_m[k]);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let ((x_lo, x_hi), (y_lo, y_hi)) = (bounds(0), bounds(1));
    let largest = antennas.iter().filter_map(|a| a.diameter_m).fold(0.0, f64::max);
    let half = 0.5 * (x_hi - x_lo).max(y_hi - y_lo).max(largest).max(1e-3) * 1.14 + 0.6 * largest;
    let (unit, name) = [(1e3, "km"), (1.0, "m"), (1e-3, "mm")].into_iter().find(|u| half >= 0.3 * u.0).unwrap_or((1e-3, "mm"));
    let (cx, cy) = (f64::midpoint(x_lo, x_hi), f64::midpoint(y_lo, y_hi));
    let (x_name, y_name) = match layout.frame {
        LayoutFrame::Boresight => ("x", "y"),
        LayoutFrame::EastNorthUp(_) => ("East", "North"),
    };
    let axis = |c: f64, label: &str| Axis::linear((c - half) / unit, (c + half) / unit, format!("{label} ({name})"));
    let (x, y) = (axis(cx, x_name), axis(cy, y_name));
    let mut canvas = Canvas::new(width, height)?;
    let sheet = Sheet::new(heading, width, height);
    let panel = sheet.square(&canvas, x, y, RIGHT_ROOM);
    panel.grid(&mut canvas);
    let per_metre = panel.area.width() / (2.0 * half);
    let place = |a: &Antenna| {
        let (x, y) = panel.at(a.position_m[0] / unit, a.position_m[1] / unit);
        (x, y, a.diameter_m.map_or(0.0, |d| 0.5 * d * per_metre))
    };
    let mut taken = Vec::new();
    for (x, y, radius) in antennas.iter().map(place) {
        if radius > SMALL_DOT {
            canvas.dot((x, y), radius, LINES[0], 0.35, panel.area);
            canvas.dot((x, y), 1.5, LINES[0], 1.0, panel.area);
        } else {
            canvas.dot((x, y), if antennas.len() > 100 { 2.5 } else { SMALL_DOT }, LINES[0], 1.0, panel.area);
        }
        let r = radius.max(SMALL_DOT);
        taken.push(Rect { x0: x - r, x1: x + r, y0: y - r, y1: y + r });
    }
    if antennas.len() <= MOST_NAMES {
        for a in antennas {
            let (px, py, radius) = place(a);
            let (r, w) = (radius.max(SMALL_DOT), canvas.text_width(&a.name, NAME_EM));
            // A name stands to the right, to the left, above or below. A name without room is left out.
            let spots = [
                (px + r + 3.0, py + 0.36 * NAME_EM),
                (px - r - 3.0 - w, py + 0.36 * NAME_EM),
                (px - w / 2.0, py - r - 3.0),
                (px - w / 2.0, py + r + 3.0 + 0.75 * NAME_EM),
            ];
            for (x, y) in spots {
                let area = Rect { x0: x - 1.0, x1: x + w + 1.0, y0: y - 0.8 * NAME_EM, y1: y + 0.25 * NAME_EM };
                let inside =
                    area.x0 > panel.area.x0 + 2.0 && area.x1 < panel.area.x1 - 2.0 && area.y0 > panel.area.y0 && area.y1 < panel.area.y1;
                if inside && !taken.iter().any(|t| t.overlaps(&area)) {
                    canvas.text((x, y), &a.name, NAME_EM, Align::Left, INK)?;
                    taken.push(area);
                    break;
                }
            }
        }
    }
    panel.axes(&mut canvas, true)?;
    sheet.finish(canvas, panel.area)
}
