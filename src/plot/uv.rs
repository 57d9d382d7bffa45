//! u-v coverage.

use super::axes::{Axis, BOTTOM_ROOM, Panel, title, whole_prefix};
use super::canvas::{Canvas, Rect};
use super::colors::{BAR_ROOM, BLANK, ColorScale, bar_area};
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SpectralWindow, UvCoverage};

/// Points drawn at most: more cannot be told apart.
const MOST_POINTS: usize = 400_000;

/// Draw where the array samples the u-v plane, each channel in its colour, each visibility with its conjugate. Longer sets are
/// thinned evenly.
///
/// # Errors
/// No rows, or baselines of no length.
pub fn uv_coverage(coverage: &UvCoverage, spectrum: &SpectralWindow, heading: &str, width: usize, height: usize) -> Result<Vec<u8>> {
    let (_, f_high) = spectrum.range_hz();
    let longest = coverage.longest_uv_m() * f_high / SPEED_OF_LIGHT_M_S;
    if !(longest > 0.0 && longest.is_finite()) {
        return Err(ChainError::NoData("there is no baseline to draw".into()));
    }
    let mut canvas = Canvas::new(width, height)?;
    let (unit, name) = whole_prefix(longest);
    let reach = 1.06 * longest / unit;
    let x = Axis::linear(-reach, reach, format!("u ({name}\u{3bb})"));
    let y = Axis::linear(-reach, reach, format!("v ({name}\u{3bb})"));
    let many = spectrum.n_chan() > 1;
    let top = if heading.is_empty() { 18.0 } else { 44.0 };
    let left = Panel::left_room(&y, &canvas, height as f64);
    let right = if many { BAR_ROOM } else { 24.0 };
    let side = (width as f64 - left - right).min(height as f64 - top - BOTTOM_ROOM).round();
    let x0 = (left + (width as f64 - left - right - side) / 2.0).round();
    let panel = Panel { area: Rect { x0, y0: top, x1: x0 + side, y1: top + side }, x, y, label_room: None };
    panel.grid(&mut canvas);
    let (lo, hi) = spectrum.range_hz();
    let scale = ColorScale {
        gradient: colorous::VIRIDIS,
        reversed: false,
        low: lo,
        high: if many { hi } else { lo + 1.0 },
        soften: 0.0,
        blank: BLANK,
    };
    let total = 2 * coverage.n_rows() * spectrum.n_chan();
    let step = total.div_ceil(MOST_POINTS).max(1);
    // Few points are drawn large and solid, many small and light.
    let radius = (60.0 / (total as f64).sqrt()).clamp(0.8, 2.2);
    let alpha = if total < 20_000 { 0.9 } else { 0.7 };
    for (i, uvw) in coverage.uvw_m.rows().into_iter().enumerate() {
        for (c, f) in spectrum.freq_hz().iter().enumerate() {
            // A prime times the row keeps the thinning from picking the same channels of every row.
            if (i * 7919 + c) % step != 0 {
                continue;
            }
            let k = f / SPEED_OF_LIGHT_M_S / unit;
            let color = if many { scale.color(*f) } else { [38, 84, 140] };
            for sign in [1.0, -1.0] {
                canvas.dot(panel.at(sign * uvw[0] * k, sign * uvw[1] * k), radius, color, alpha, panel.area);
            }
        }
    }
    panel.axes(&mut canvas, true)?;
    if many {
        let (unit, letter) = whole_prefix(hi);
        scale.bar(&mut canvas, bar_area(panel.area), unit, &format!("Frequency ({letter}Hz)"))?;
    }
    if !heading.is_empty() {
        title(&mut canvas, panel.area, heading, width as f64 - 20.0)?;
    }
    canvas.png()
}
