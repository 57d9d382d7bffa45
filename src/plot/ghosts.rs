//! The beam over the field in which ghosts lie, in decibels, with its highest lobes and the field that is free of exact ghosts.

use super::axes::Axis;
use super::canvas::{Canvas, Rgb};
use super::colors::{BAR_ROOM, BLANK, ColorScale, Curve, bar_area};
use super::heat::{Heat, Map};
use super::panel::{Panel, Sheet};
use super::picture::Picture;
use crate::Result;
use cittert_arrays::GhostMap;

/// Lowest level of the colours, dB.
const FLOOR_DB: f64 = -30.0;
/// Radius of the ring around a lobe, pixels.
const RING: f64 = 7.0;
/// The rings and the edge of the field that is free of ghosts.
const MARK: Rgb = [90, 220, 255];

/// Draw the map with direction cosines along its axes. Rings mark its lobes. A circle around the centre is the edge of the field whose sources have
/// no exact ghosts in it.
///
/// # Errors
/// A picture below 100 or above 8000 pixels.
pub fn ghosts(map: &GhostMap, title: &str, width: usize, height: usize) -> Result<Picture> {
    let edge = map.radius() + 0.5 * map.cell;
    // A pixel of the picture shows the highest of its cells, which counts from the floor here, because a mean would hide narrow ghosts.
    let above = map.levels.mapv(|v| if v.is_nan() { v } else { (10.0 * v.max(1e-9).log10() - FLOOR_DB).max(0.0) });
    let scale = |low: f64| ColorScale {
        gradient: colorous::INFERNO,
        reversed: false,
        low,
        high: low - FLOOR_DB,
        stretch: Curve::Linear,
        blank: BLANK,
    };
    let free = 0.5 * map.ghosts.alias_free_field_rad;
    let note = match free < std::f64::consts::FRAC_PI_2 {
        true => "Rings: lobes of at least the stated level. Circle: the field whose sources have no exact ghosts in it.",
        false => "Rings: lobes of at least the stated level.",
    };
    let sheet = Sheet::new(title, width, height).with_note(note);
    let mut canvas = Canvas::new(width, height)?;
    let axis = |name: &str| Axis::linear(-edge, edge, format!("{name} (direction cosine)"));
    let panel = sheet.square(&canvas, axis("l"), axis("m"), BAR_ROOM);
    let heat = Heat {
        maps: vec![Map { plane: above.view(), title: String::new(), beam: None, levels: Vec::new() }],
        x: panel.x.clone(),
        y: panel.y.clone(),
        scale: scale(0.0),
        unit: 1.0,
        bar_label: String::new(),
        sheet,
        extremes: true,
    };
    heat.cells(&mut canvas, above.view(), panel.area);
    if free < std::f64::consts::FRAC_PI_2 {
        circle(&mut canvas, &panel, panel.at(0.0, 0.0), free.sin() * panel.area.width() / (2.0 * edge))?;
    }
    for lobe in &map.lobes {
        for sign in [1.0, -1.0] {
            circle(&mut canvas, &panel, panel.at(sign * lobe.lm[0], sign * lobe.lm[1]), RING)?;
        }
    }
    panel.axes(&mut canvas, true)?;
    scale(FLOOR_DB).bar(&mut canvas, bar_area(panel.area), 1.0, "Level (dB of the peak)")?;
    heat.sheet.finish(canvas, panel.area)
}

/// A circle; only the parts that lie in the panel are drawn.
fn circle(canvas: &mut Canvas, panel: &Panel, (x, y): (f64, f64), radius: f64) -> Result<()> {
    let area = panel.area;
    let mut part: Vec<(f64, f64)> = Vec::new();
    for k in 0..=90 {
        let (s, c) = (f64::from(k) * std::f64::consts::TAU / 90.0).sin_cos();
        let at = (x + radius * c, y + radius * s);
        if (area.x0..=area.x1).contains(&at.0) && (area.y0..=area.y1).contains(&at.1) {
            part.push(at);
        } else if !part.is_empty() {
            canvas.line(&std::mem::take(&mut part), MARK, 1.4)?;
        }
    }
    if part.len() > 1 { canvas.line(&part, MARK, 1.4) } else { Ok(()) }
}
