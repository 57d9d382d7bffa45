//! u-v coverage.

use super::axes::{Axis, whole_prefix};
use super::canvas::Canvas;
use super::colors::{BAR_ROOM, BLANK, ColorScale, Curve, bar_area};
use super::panel::{RIGHT_ROOM, Sheet};
use super::picture::Picture;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SpectralWindow, UvCoverage};

/// Largest number of points that is drawn.
const MOST_POINTS: usize = 400_000;

/// Draw the samples of the u-v plane. Each channel has its colour, and each visibility is drawn with its conjugate. A set with too many
/// samples is thinned evenly.
///
/// # Errors
/// No rows, or baselines of zero length.
pub fn uv_coverage(coverage: &UvCoverage, spectrum: &SpectralWindow, heading: &str, width: usize, height: usize) -> Result<Picture> {
    let (lo, hi) = spectrum.range_hz();
    let longest = coverage.longest_uv_m() * hi / SPEED_OF_LIGHT_M_S;
    if !(longest > 0.0 && longest.is_finite()) {
        return Err(ChainError::NoData("there is no baseline to draw".into()));
    }
    let mut canvas = Canvas::new(width, height)?;
    let (unit, name) = whole_prefix(longest);
    let reach = 1.06 * longest / unit;
    let x = Axis::linear(-reach, reach, format!("u ({name}\u{3bb})"));
    let y = Axis::linear(-reach, reach, format!("v ({name}\u{3bb})"));
    let many = spectrum.n_chan() > 1;
    let sheet = Sheet::new(heading, width, height);
    let panel = sheet.square(&canvas, x, y, if many { BAR_ROOM } else { RIGHT_ROOM });
    panel.grid(&mut canvas);
    let scale = ColorScale {
        gradient: colorous::VIRIDIS,
        reversed: false,
        low: lo,
        high: if many { hi } else { lo + 1.0 },
        stretch: Curve::Linear,
        blank: BLANK,
    };
    let total = 2 * coverage.n_rows() * spectrum.n_chan();
    let step = total.div_ceil(MOST_POINTS).max(1);
    // Few points are drawn large and solid, many points small and light.
    let radius = (60.0 / (total as f64).sqrt()).clamp(0.8, 2.2);
    let alpha = if total < 20_000 { 0.9 } else { 0.7 };
    for (i, uvw) in coverage.uvw_m.rows().into_iter().enumerate() {
        for (c, f) in spectrum.freq_hz().iter().enumerate() {
            // The prime factor makes sure that the thinning does not take the same channels of every row.
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
    sheet.finish(canvas, panel.area)
}
