//! The power |V|^2 of an image at any place of the u-v plane.

use super::beam::BeamHessian;
use cittert_arrays::SkyGrid;
use ndarray::ArrayView2;

/// The squared transform of an image that is padded to twice its size. |V|^2 is the transform of an autocorrelation, which is twice as wide as the image, so these
/// samples hold all of it.
#[derive(Debug)]
pub(super) struct PowerPlane {
    /// \[u, v\], one half of the plane.
    powers: Vec<f32>,
    padded: (usize, usize),
    /// Samples a wavelength along v and u.
    scale: (f64, f64),
}

impl PowerPlane {
    /// Of an image \[m, l\] on a grid.
    pub(super) fn of(beam: &BeamHessian, grid: &SkyGrid, image: ArrayView2<'_, f32>) -> Self {
        let (powers, padded) = beam.powers(image);
        let along_l = grid.l_at(1.0) - grid.l_at(0.0);
        Self { powers, padded, scale: (padded.0 as f64 * grid.cell_rad, padded.1 as f64 * along_l) }
    }

    /// The power on a baseline in wavelengths, by linear interpolation; 0 where pixels are too large to show it.
    pub(super) fn at(&self, u: f64, v: f64) -> f64 {
        let (p_m, p_l) = self.padded;
        let (mut y, mut x) = (v * self.scale.0, u * self.scale.1);
        if x < 0.0 {
            // The image is real.
            (y, x) = (-y, -x);
        }
        if !(x < (p_l / 2) as f64 && y.abs() < (p_m / 2) as f64) {
            return 0.0;
        }
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let sample = |step_x: usize, step_y: i64| {
            let row = (row as i64 + step_y).rem_euclid(p_m as i64) as usize;
            f64::from(self.powers[(column as usize + step_x) * p_m + row])
        };
        let along = |step_x: usize| sample(step_x, 0) * (1.0 - fy) + sample(step_x, 1) * fy;
        along(0) * (1.0 - fx) + along(1) * fx
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;
    use ndarray::Array2;
    use std::f64::consts::TAU;

    #[test]
    fn samples_are_those_of_a_direct_sum_in_all_quadrants() {
        for frame in [SkyFrame::Boresight, SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.3, frame: "icrs".into() }] {
            let grid = SkyGrid::new(24, 32, 2e-3, frame).unwrap();
            let mut point = Array2::zeros((2 * grid.n_m, 2 * grid.n_l));
            point[(grid.n_m, grid.n_l)] = 1.0_f32;
            let beam = BeamHessian::of_beam(&grid, point, 1.0);
            let image = Array2::from_shape_fn((grid.n_m, grid.n_l), |(i, j)| ((i * 7 + j * 3 + i * j) % 11) as f32);
            let plane = PowerPlane::of(&beam, &grid, image.view());
            let ((p_m, p_l), top) = (plane.padded, plane.at(0.0, 0.0));
            for (x, y) in [(3, 5), (3, -5), (-4, 2), (-7, -9), (0, 4), (11, 0)] {
                // A place of a sample, in wavelengths.
                let (u, v) = (f64::from(x) / (p_l as f64 * grid.cell_rad), f64::from(y) / (p_m as f64 * grid.cell_rad));
                let (mut re, mut im) = (0.0, 0.0);
                for ((i, j), value) in image.indexed_iter() {
                    let phase = TAU * (u * grid.l_at(j as f64) + v * grid.m_at(i as f64));
                    re += f64::from(*value) * phase.cos();
                    im += f64::from(*value) * phase.sin();
                }
                let power = re * re + im * im;
                assert!((plane.at(u, v) - power).abs() < 1e-6 * top, "({x}, {y}): {} {power}", plane.at(u, v));
            }
            assert!(plane.at(1e9, 0.0) == 0.0 && plane.at(0.0, -1e9) == 0.0 && plane.at(f64::NAN, 0.0) == 0.0);
        }
    }
}
