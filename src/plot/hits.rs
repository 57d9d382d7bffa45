//! Hits of the cells of the Fourier grid.

use super::axes::{Axis, whole_prefix};
use super::canvas::WHITE;
use super::colors::{ColorScale, Curve};
use super::heat::{Heat, Map};
use super::panel::Sheet;
use super::picture::Picture;
use crate::simulate::UvMask;
use crate::{ChainError, Result};

/// Draw the number of visibilities in each cell of the Fourier grid, out to the longest baseline. Cells without a visibility are white.
///
/// # Errors
/// A mask without a visibility, a picture below 100 or above 8000 pixels.
pub fn uv_mask(mask: &UvMask, title: &str, width: usize, height: usize) -> Result<Picture> {
    let (n_v, n_u) = mask.counts.dim();
    let reach = |longest: f64, cell: f64, n: usize| ((1.04 * longest / cell).ceil() as usize + 1).min(n / 2);
    let (half_u, half_v) = (reach(mask.longest_wavelengths, mask.cell_u, n_u), reach(mask.longest_wavelengths, mask.cell_v, n_v));
    let (u0, v0) = (n_u / 2 - half_u, n_v / 2 - half_v);
    let (u1, v1) = ((n_u / 2 + half_u + 1).min(n_u), (n_v / 2 + half_v + 1).min(n_v));
    let shown = mask.counts.slice(ndarray::s![v0..v1, u0..u1]).mapv(|c| if c == 0 { f64::NAN } else { f64::from(c) });
    let high = shown.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    if high == 0.0 {
        return Err(ChainError::NoData("no cell of the mask is hit".into()));
    }
    let (unit, name) = whole_prefix(mask.longest_wavelengths);
    let edge = |k: usize, n: usize, cell: f64| (k as f64 - 0.5 - (n / 2) as f64) * cell / unit;
    Heat {
        maps: vec![Map { plane: shown.view(), title: String::new(), beam: None, levels: Vec::new() }],
        x: Axis::linear(edge(u0, n_u, mask.cell_u), edge(u1, n_u, mask.cell_u), format!("u ({name}\u{3bb})")),
        y: Axis::linear(edge(v0, n_v, mask.cell_v), edge(v1, n_v, mask.cell_v), format!("v ({name}\u{3bb})")),
        scale: ColorScale {
            gradient: colorous::VIRIDIS,
            reversed: true,
            low: 1.0,
            high: high.max(2.0),
            stretch: if high > 20.0 { Curve::Asinh { origin: 1.0, linear: 0.05 * (high - 1.0) } } else { Curve::Linear },
            blank: WHITE,
        },
        unit: 1.0,
        bar_label: "Visibilities in a cell".into(),
        sheet: Sheet::new(title, width, height),
        extremes: false,
    }
    .draw()
}
