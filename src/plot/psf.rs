//! A dirty beam: its level in decibels, so that side lobes are seen, and its profile along the radius.

use super::axes::{Axis, angle_unit, short};
use super::canvas::{Canvas, INK, Rect};
use super::colors::{BLANK, ColorScale, Curve, LINES, bar_area};
use super::heat::{Heat, Map};
use super::legend::{CORNERS, Style, legend_at};
use super::panel::{BOTTOM_ROOM, Panel, RIGHT_ROOM, Sheet};
use super::picture::Picture;
use super::radial::{Lobe, Radial};
use super::sky::ImagePlot;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, SkyFrame};
use ndarray::ArrayView2;

/// Lowest level of a picture, dB.
const LOWEST_DB: f64 = -40.0;
/// The colours reach down at least to this level, dB.
const HIGHEST_FLOOR_DB: f64 = -20.0;

/// The axis of the profile is logarithmic where the frame reaches so many widths of the main lobe from the peak.
const WIDE_FIELD: f64 = 30.0;

/// Whether an image is a dirty beam: without a unit, and exactly 1 in the middle and nowhere larger.
#[must_use]
pub fn is_psf(image: &Image) -> bool {
    let plane = image.plane(0, 0);
    let middle = plane.get((image.grid.n_m / 2, image.grid.n_l / 2)).copied();
    image.unit == BrightnessUnit::One && middle == Some(1.0) && plane.iter().all(|v| !(v.abs() > 1.0))
}

/// Decibels of a level relative to the peak.
fn db(level: f64) -> f64 {
    10.0 * level.abs().log10()
}

/// The lowest level of the colours: the multiple of 10 dB below which only a quarter of the pixels lies.
fn floor_of(plane: ArrayView2<'_, f64>) -> f64 {
    let mut levels: Vec<f64> = plane.iter().filter(|v| v.is_finite() && **v != 0.0).map(|v| db(*v)).collect();
    if levels.is_empty() {
        return LOWEST_DB;
    }
    let k = levels.len() / 4;
    let quarter = *levels.select_nth_unstable_by(k, f64::total_cmp).1;
    ((quarter / 10.0).floor() * 10.0).clamp(LOWEST_DB, HIGHEST_FLOOR_DB)
}

/// Draw a dirty beam in dB above its profile: the largest absolute value and the rms over azimuth against the distance from the peak.
///
/// # Errors
/// A plane that the image does not have, a beam whose middle is not its peak, a picture below 100 or above 8000 pixels.
pub fn psf(image: &Image, options: &ImagePlot) -> Result<Picture> {
    let (n_chan, n_pol, ..) = image.data.dim();
    for (what, index, len) in [("channel", options.chan, n_chan), ("polarisation", options.pol, n_pol)] {
        if index >= len {
            return Err(cittert_arrays::ArrayError::OutOfRange { what, index, len }.into());
        }
    }
    let (plane, grid) = (image.plane(options.chan, options.pol), &image.grid);
    let peak = plane.get((grid.n_m / 2, grid.n_l / 2)).copied().unwrap_or(f64::NAN);
    let largest = plane.iter().copied().filter(|v| v.is_finite()).fold(0.0_f64, |p, v| p.max(v.abs()));
    if !(peak > 0.0 && largest <= peak * (1.0 + 1e-3)) {
        let why = format!("the middle pixel is {peak} and the largest value {largest}: a dirty beam has its peak in the middle");
        return Err(ChainError::Incompatible(why));
    }
    let relative = Image { data: &image.data / peak, ..image.clone() };
    let radial = Radial::of(&relative, options.chan, options.pol);
    let levels = relative.plane(options.chan, options.pol).mapv(|v| if v == 0.0 { LOWEST_DB } else { db(v) });
    let low = floor_of(relative.plane(options.chan, options.pol));
    let (unit, name) = angle_unit(0.5 * grid.cell_rad * grid.n_l.max(grid.n_m) as f64);
    let (x_name, y_name) = match grid.frame {
        SkyFrame::Sky { .. } => ("Offset east", "Offset north"),
        SkyFrame::Boresight => ("l", "m"),
    };
    let sheet = Sheet::new(&options.title, options.width, options.height).with_note(numbers(&radial));
    let mut canvas = Canvas::new(options.width, options.height)?;
    let (top, bottom) = (sheet.top(), sheet.height - sheet.bottom(&canvas));
    // The upper panel gets what the lower one leaves: a quarter of the height is enough for curves.
    let profile_height = (0.27 * (bottom - top)).round();
    let x = Axis::linear(grid.l_at(-0.5) / unit, grid.l_at(grid.n_l as f64 - 0.5) / unit, format!("{x_name} ({name})"));
    let y = Axis::linear(grid.m_at(-0.5) / unit, grid.m_at(grid.n_m as f64 - 0.5) / unit, format!("{y_name} ({name})"));
    let scale = ColorScale { gradient: colorous::INFERNO, reversed: false, low, high: 0.0, stretch: Curve::Linear, blank: BLANK };
    let left = Panel::left_room(&y, &canvas, bottom - top);
    let bar = scale.bar_room(&canvas, bottom - top, 1.0);
    let (room_x, room_y) = (sheet.width - left - bar, bottom - top - profile_height - BOTTOM_ROOM);
    let k = (room_x / (x.to - x.from).abs()).min(room_y / (y.to - y.from).abs());
    let (w, h) = ((k * (x.to - x.from).abs()).round().max(2.0), (k * (y.to - y.from).abs()).round().max(2.0));
    let x0 = (left + (room_x - w) / 2.0).round();
    let area = Rect { x0, y0: top, x1: x0 + w, y1: top + h };
    let heat = Heat {
        maps: vec![Map { plane: levels.view(), title: String::new(), beam: None, levels: Vec::new() }],
        x,
        y,
        scale,
        unit: 1.0,
        bar_label: "Level (dB of the peak)".into(),
        sheet,
        extremes: false,
    };
    heat.cells(&mut canvas, levels.view(), area);
    let upper = Panel { area, x: heat.x.clone(), y: heat.y.clone(), label_room: None };
    upper.axes(&mut canvas, true)?;
    scale.bar(&mut canvas, bar_area(area), 1.0, &heat.bar_label)?;
    let lower = Rect { x0: left.round(), x1: heat.sheet.width - RIGHT_ROOM, y0: bottom - profile_height, y1: bottom };
    profile(&mut canvas, &radial, lower, low)?;
    heat.sheet.finish(canvas, area)
}

/// The panel of the profile.
fn profile(canvas: &mut Canvas, radial: &Radial, area: Rect, low: f64) -> Result<()> {
    let reach = radial.rings.last().map_or(1.0, |r| r.radius_rad);
    let (unit, name) = angle_unit(reach);
    let label = format!("Distance from the peak ({name})");
    // In a field of many beams, a linear axis has no room for the main lobe and the first side lobes.
    let nearest = 0.25 * radial.fwhm_rad.1 / unit;
    let x = if reach > WIDE_FIELD * radial.fwhm_rad.0 {
        Axis { log: true, ..Axis::linear(nearest, reach / unit, label) }
    } else {
        Axis::linear(0.0, reach / unit, label)
    };
    let panel = Panel { area, x, y: Axis::linear(low - 5.0, 2.0, "Level (dB)"), label_room: None };
    panel.grid(canvas);
    let half = 0.25 * (radial.fwhm_rad.0 + radial.fwhm_rad.1) / unit;
    if half < reach / unit {
        // The place of half the maximum.
        let (at, _) = panel.at(half, 0.0);
        let mut y = area.y0;
        while y < area.y1 {
            canvas.fill(Rect { x0: at - 0.6, x1: at + 0.6, y0: y, y1: (y + 5.0).min(area.y1) }, [120, 120, 128]);
            y += 9.0;
        }
    }
    let curve = |level: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        let point = |k: usize| panel.at((radial.rings[k].radius_rad / unit).max(panel.x.from), db(level(k)).clamp(low - 5.0, 2.0));
        (0..radial.rings.len()).map(point).collect()
    };
    canvas.line(&curve(&|k| radial.rings[k].rms), LINES[0], 1.6)?;
    canvas.line(&curve(&|k| radial.rings[k].largest), LINES[1], 1.6)?;
    for lobe in [radial.first, radial.highest].into_iter().flatten() {
        canvas.dot(panel.at(lobe.radius_rad / unit, db(lobe.level)), 4.5, INK, 0.85, area);
    }
    panel.axes(canvas, true)?;
    let names = ["Largest over azimuth", "Rms over azimuth"];
    legend_at(canvas, area, &names, CORNERS[0], &|k| Style { color: 1 - k, line: true, dots: false })
}

/// The numbers of the beam as sentences.
fn numbers(radial: &Radial) -> String {
    let (unit, name) = angle_unit(3.0 * radial.fwhm_rad.0);
    let three = |x: f64| short((x * 1e3).round() / 1e3);
    let mut text =
        format!("Full width at half maximum {} x {} {name} (dashed). ", three(radial.fwhm_rad.0 / unit), three(radial.fwhm_rad.1 / unit));
    let told = |l: Lobe| {
        let (unit, name) = angle_unit(3.0 * l.radius_rad);
        format!("{:.1} dB at {} {name}", db(l.level), three(l.radius_rad / unit)).replace('-', "\u{2212}")
    };
    if let Some((first, highest)) = radial.first.zip(radial.highest) {
        text += &if first == highest {
            format!("The first side lobe is the highest: {} (dot). ", told(first))
        } else {
            format!("First side lobe {}, highest {} (dots). ", told(first), told(highest))
        };
        text += &format!("Rms beyond the main lobe {:.1} dB.", db(radial.rms)).replace('-', "\u{2212}");
    } else {
        text += "The frame shows no side lobe.";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyGrid, SpectralWindow};
    use ndarray::Array4;

    fn beam(side_lobe: f64) -> Image {
        let grid = SkyGrid::new(64, 64, 1e-4, SkyFrame::Boresight).unwrap();
        let value = |r: usize, c: usize| {
            let d = (r as f64 - 32.0).hypot(c as f64 - 32.0);
            (-0.5 * d * d / 4.0).exp() + side_lobe * (-0.5 * (d - 15.0).powi(2) / 4.0).exp()
        };
        let mut data = Array4::from_shape_fn((1, 1, 64, 64), |(_, _, r, c)| value(r, c));
        data[[0, 0, 32, 32]] = 1.0;
        Image::new(grid, SpectralWindow::band(1e9, 1e6, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::One).unwrap()
    }

    #[test]
    fn a_beam_is_known_by_its_peak_and_side_lobes_are_told_in_decibels() {
        assert!(is_psf(&beam(0.1)));
        assert!(
            !is_psf(&Image { unit: BrightnessUnit::Kelvin, ..beam(0.1) }) && !is_psf(&Image { data: beam(0.1).data * 0.5, ..beam(0.1) })
        );
        let told = numbers(&Radial::of(&beam(0.1), 0, 0));
        assert!(told.contains("the highest: \u{2212}10.0 dB"), "{told}");
        let small = ImagePlot { title: "a beam".into(), width: 500, height: 600, ..ImagePlot::default() };
        psf(&beam(0.1), &small).unwrap().png().unwrap();
        let mut off = beam(0.1);
        off.data[[0, 0, 3, 3]] = 2.0;
        assert!(psf(&off, &small).err().unwrap().to_string().contains("peak in the middle"));
    }

    #[test]
    fn the_colours_end_where_the_picture_ends() {
        let even = |level: f64| floor_of(ndarray::Array2::from_elem((8, 8), level).view());
        assert_eq!((even(0.1), even(0.003), even(1e-9)), (-20.0, -30.0, -40.0));
    }
}
