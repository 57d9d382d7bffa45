//! A plane as a beam smooths it.

use crate::{ChainError, Result};
use cittert_arrays::{RestoringBeam, SkyGrid};
use ndarray::{Array2, ArrayView2};

/// A plane convolved with a Gaussian beam whose sum is 1: the average of the brightness over the beam. Outside the frame the sky is taken as 0.
///
/// # Errors
/// The beam has no width, or is wider than the frame.
pub fn convolve(plane: ArrayView2<'_, f64>, grid: &SkyGrid, beam: &RestoringBeam) -> Result<Array2<f64>> {
    let widest = beam.bmaj_rad / grid.cell_rad;
    if !(beam.bmin_rad > 0.0 && beam.bmaj_rad >= beam.bmin_rad && widest < grid.n_l.max(grid.n_m) as f64 && beam.bpa_rad.is_finite()) {
        let value = format!("{} x {} rad", beam.bmaj_rad, beam.bmin_rad);
        return Err(ChainError::bad_option("beam", value, "positive axes below the width of the image"));
    }
    // The covariance of the beam in cells (column, row) is separated into a vertical Gaussian and a horizontal one. The centre of the
    // horizontal one shifts by `slope` from row to row, so that each row needs taps only at the tilted beam.
    let to_sigma = 1.0 / (2.0 * (2.0 * std::f64::consts::LN_2).sqrt() * grid.cell_rad);
    let (major, minor) = ((beam.bmaj_rad * to_sigma).powi(2), (beam.bmin_rad * to_sigma).powi(2));
    let (sin, cos) = beam.bpa_rad.sin_cos();
    let sin = sin * grid.l_sign();
    let (cxx, cyy, cxy) = (major * sin * sin + minor * cos * cos, major * cos * cos + minor * sin * sin, (major - minor) * sin * cos);
    let (slope, across) = (cxy / cyy, cxx - cxy * cxy / cyy);
    let reach = |variance: f64| (5.0 * variance.sqrt()).ceil() as isize;
    let (rx, ry) = (reach(across) + 1, reach(cyy));
    let (rows, columns) = plane.dim();
    let mut out = Array2::zeros((rows, columns));
    let mut total = 0.0;
    for dy in -ry..=ry {
        let center = slope * dy as f64;
        let first = (center.round() as isize) - rx;
        let taps: Vec<f64> = (0..=2 * rx)
            .map(|k| (-(((first + k) as f64 - center).powi(2)) / (2.0 * across) - (dy * dy) as f64 / (2.0 * cyy)).exp())
            .collect();
        total += taps.iter().sum::<f64>();
        for row in 0..rows {
            let Some(from) = row.checked_add_signed(-dy).filter(|r| *r < rows) else { continue };
            let source = plane.row(from);
            for column in 0..columns {
                let mut sum = 0.0;
                for (k, tap) in taps.iter().enumerate() {
                    if let Some(c) = column.checked_add_signed(-(first + k as isize)).filter(|c| *c < columns) {
                        sum += tap * source[c];
                    }
                }
                out[[row, column]] += sum;
            }
        }
    }
    out /= total;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    #[test]
    fn a_convolved_point_is_the_beam_with_its_position_angle() {
        let beam = RestoringBeam { bmaj_rad: 8e-3, bmin_rad: 4e-3, bpa_rad: 0.6 };
        for frame in [SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.3, frame: "icrs".into() }, SkyFrame::Boresight] {
            let g = SkyGrid::new(48, 48, 1e-3, frame).unwrap();
            let mut plane = Array2::zeros((48, 48));
            plane[[24, 24]] = 1.0;
            let out = convolve(plane.view(), &g, &beam).unwrap();
            assert!((out.sum() - 1.0).abs() < 1e-5);
            let at = |along: f64, across: f64| {
                let (sin, cos) = 0.6_f64.sin_cos();
                let (l, m) = (along * sin + across * cos, along * cos - across * sin);
                (g.column_of(l).round() as usize, g.row_of(m).round() as usize)
            };
            for (along, across) in [(4e-3, 0.0), (0.0, 2e-3), (3e-3, 1e-3)] {
                let (column, row) = at(along, across);
                // The exact offset of that pixel from the middle.
                let (l, m) = (g.l_at(column as f64), g.m_at(row as f64));
                let (x, y) = (l * 0.6_f64.sin() + m * 0.6_f64.cos(), l * 0.6_f64.cos() - m * 0.6_f64.sin());
                let truth = (-4.0 * std::f64::consts::LN_2 * ((x / 8e-3).powi(2) + (y / 4e-3).powi(2))).exp();
                assert!((out[[row, column]] / out[[24, 24]] - truth).abs() < 1e-9, "{along} {across}");
            }
        }
    }
}
