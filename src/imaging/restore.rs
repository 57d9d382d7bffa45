//! The restored image: the model convolved with the restoring beam, plus the residual.

use crate::fourier::Convolver;
use crate::pages::zeros;
use cittert_arrays::{RestoringBeam, SkyGrid};
use ndarray::{Array2, ArrayView1, ArrayView2, Axis, s};
use rayon::prelude::*;

/// The restoring beam \[m, l\] with its peak of 1 at the centre pixel.
#[must_use]
pub fn gaussian(grid: &SkyGrid, beam: &RestoringBeam) -> Array2<f64> {
    let (sin, cos) = beam.bpa_rad.sin_cos();
    let k = 4.0 * std::f64::consts::LN_2;
    Array2::from_shape_fn((grid.n_m, grid.n_l), |(i, j)| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        // Coordinates along and across the major axis. Its position angle is counted from +m towards +l.
        let (along, across) = ((l * sin + m * cos) / beam.bmaj_rad, (l * cos - m * sin) / beam.bmin_rad);
        (-k * (along * along + across * across)).exp()
    })
}

/// Multiply-adds per pixel for which a convolution by Fourier transforms takes as long as the sum over the bright pixels.
const CONVOLUTION: usize = 500;

/// A model \[m, l\] in flux per pixel, convolved with the beam. The result is in flux per beam.
#[must_use]
pub fn with_beam(grid: &SkyGrid, model: ArrayView2<'_, f64>, beam: &RestoringBeam) -> Array2<f64> {
    // Beyond four FWHM a Gaussian is below 1e-19 of its peak.
    let reach = (4.0 * beam.bmaj_rad / grid.cell_rad).ceil() as usize + 1;
    let side = |n: usize| 2 * reach.min(n - 1) + 1;
    let patch = gaussian(&SkyGrid { n_l: side(grid.n_l), n_m: side(grid.n_m), ..grid.clone() }, beam);
    let bright = |row: ArrayView1<'_, f64>| row.iter().enumerate().filter(|(_, v)| **v != 0.0).map(|(c, _)| c).collect();
    let rows: Vec<Vec<usize>> = model.axis_iter(Axis(0)).into_par_iter().map(bright).collect();
    let count: usize = rows.iter().map(Vec::len).sum();
    if count.saturating_mul(patch.len()) <= CONVOLUTION * model.len() {
        return sum_of_patches(model, &rows, &patch);
    }
    let convolver = Convolver::<f64>::new((grid.n_m, grid.n_l), reach);
    convolver.convolve(model, &convolver.kernel(patch.view()))
}

/// The sum of the beam at every bright pixel. `rows` lists their columns in each row.
fn sum_of_patches(model: ArrayView2<'_, f64>, rows: &[Vec<usize>], patch: &Array2<f64>) -> Array2<f64> {
    let (reach, reach_l) = (patch.nrows() / 2, patch.ncols() / 2);
    let mut out = zeros(model.dim());
    out.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(i, mut line)| {
        for from in i.saturating_sub(reach)..(i + reach + 1).min(rows.len()) {
            let beam = patch.row(i + reach - from);
            for column in &rows[from] {
                let flux = model[(from, *column)];
                let first = column.saturating_sub(reach_l);
                let last = (column + reach_l + 1).min(line.len());
                let part = beam.slice(s![first + reach_l - column..last + reach_l - column]);
                line.slice_mut(s![first..last]).scaled_add(flux, &part);
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    #[test]
    fn a_component_becomes_a_beam_where_it_stands() {
        let grid = SkyGrid::new(40, 30, 1e-3, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }).unwrap();
        let beam = RestoringBeam { bmaj_rad: 6e-3, bmin_rad: 3e-3, bpa_rad: 0.4 };
        let mut model = Array2::zeros((30, 40));
        model[(3, 37)] = 2.0;
        let restored = with_beam(&grid, model.view(), &beam);
        assert!((restored[(3, 37)] - 2.0).abs() < 1e-12);
        // Half the value at half the major axis from the peak: towards +m and +l (to the left on the sky).
        let at = |r: f64| (3.0 + r * beam.bpa_rad.cos(), 37.0 - r * beam.bpa_rad.sin());
        let (i, j) = at(3.0);
        let (i, j) = (i.round() as usize, j.round() as usize);
        let g = gaussian(&grid, &beam);
        assert!((restored[(i, j)] - 2.0 * g[(i + 12, j - 17)]).abs() < 1e-12);
        assert!(g[(18, 19)] > g[(18, 21)], "the beam leans to the left above the centre");
    }
}
